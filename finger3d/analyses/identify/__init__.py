"""Values of scene keys from a measured press."""
