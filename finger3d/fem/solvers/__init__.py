"""Direct solvers and static condensation."""
