"""Material laws of solids, and what is embedded in them."""
