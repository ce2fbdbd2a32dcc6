"""Shapes: designs, CAD solids, sections and triangulated surfaces."""
