"""Unstructured meshes of solids by fTetWild and netgen."""
