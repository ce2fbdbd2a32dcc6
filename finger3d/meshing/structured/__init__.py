"""Structured meshes of sections and swept solids."""
