"""Schemes by which chains and structures agree on the contact forces of a window."""
