"""Figures, renderings, animations and the interactive window."""
