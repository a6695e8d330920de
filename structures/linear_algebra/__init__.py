"""Sparse symmetric matrices: factorisations, orders of elimination, checks, buckling loads."""
