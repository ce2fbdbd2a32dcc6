"""The press along the path of the object."""
