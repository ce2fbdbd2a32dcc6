"""A local page with sliders that presses a condensed finger as they move."""
