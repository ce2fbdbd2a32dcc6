"""Discretisation errors, mesh refinement, predicted cost and advice."""
