"""Numbers of a model from signals."""
