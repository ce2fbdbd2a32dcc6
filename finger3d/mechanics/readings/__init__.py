"""Readings of a press: gauges, markers and taxels."""
