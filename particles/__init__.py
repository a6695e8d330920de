"""Beads, their contacts, and the chains that they form. This package imports only `structures`."""
