"""Finite elements on simplices: assembly, static condensation, recovery of fields."""
