"""Refinement of a mesh by bisection, and prescribed edge lengths."""
