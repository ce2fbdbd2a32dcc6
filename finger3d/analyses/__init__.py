"""What a user asks for: press, compare, calibrate, sweep, optimise and validate."""
