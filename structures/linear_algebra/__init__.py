"""Sparse symmetric matrices: checks and factorisations."""
