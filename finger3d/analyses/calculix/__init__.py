"""Input decks of CalculiX: a press as its solver ccx reads it."""
