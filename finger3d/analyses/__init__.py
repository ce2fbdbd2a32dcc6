"""Analyses: press, compare, calibrate, sweep and optimise."""
