"""What a press leaves: states, increments and their history, and the limit of slip."""
