"""Plates as structures. Uses the structures room only."""
