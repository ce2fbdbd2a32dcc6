"""What a press leaves: states, increments and their history, and the margin to slip."""
