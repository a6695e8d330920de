"""Sparse symmetric matrices: factorisations, checks, buckling loads."""
