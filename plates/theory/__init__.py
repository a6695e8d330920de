"""Closed forms of impacts on plates and of waves in them."""
