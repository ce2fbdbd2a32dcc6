"""Forces and stiffness of solids, and what is embedded in them."""
