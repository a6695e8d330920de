"""Sparse symmetric matrices: factorisations, checks."""
