"""Parameters of a model, identified from signals."""
