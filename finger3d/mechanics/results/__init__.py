"""What a press leaves: increments, zones, and checks of the surface."""
