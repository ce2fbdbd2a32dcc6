"""Analyses: press, compare, calibrate, sweep, optimise and validate."""
