"""Frictional contact of one load increment: the conditions, the friction law and the solvers."""
