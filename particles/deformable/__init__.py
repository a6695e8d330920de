"""Deformable beads, which vibrate."""
