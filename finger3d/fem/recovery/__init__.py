"""Fields recovered from the unknowns."""
