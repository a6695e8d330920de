"""Plates as structures. This package imports only `structures`."""
