"""Boundary surfaces, their traces, and their deformation."""
