"""Meshes of simplices: shape functions, quality, search."""
