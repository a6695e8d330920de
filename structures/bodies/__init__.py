"""Elastic bodies: rods, layered cylinders, solids, half-spaces; each becomes a structure."""
