"""Physical effects beyond the baseline, one a file; each fills one slot of the model."""
