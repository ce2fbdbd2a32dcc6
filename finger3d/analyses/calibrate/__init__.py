"""Gauge strain as a function of the friction coefficient, with its tolerances."""
