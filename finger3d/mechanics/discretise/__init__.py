"""From the model to the discretised problem."""
