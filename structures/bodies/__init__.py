"""Elastic bodies: rods, layered cylinders, solids, shells, half-spaces; each becomes a structure."""
