"""Beads that deform and vibrate."""
