"""A local page that answers while its sliders move, from a condensed finger."""
