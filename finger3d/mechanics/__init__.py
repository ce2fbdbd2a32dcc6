"""The model, its formulation and the solution along a load path."""
