"""Beads, their contacts, and the chain that they form. Uses the structures room only."""
