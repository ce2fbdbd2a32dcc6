"""Bodies in small strain, elastic and viscoelastic."""
