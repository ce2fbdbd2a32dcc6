"""Results as they are stored: states of chosen increments, VTU files, summaries."""
