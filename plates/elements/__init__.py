"""Finite elements of plates."""
