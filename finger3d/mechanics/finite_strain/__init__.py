"""Bodies at finite strain."""
