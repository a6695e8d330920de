"""Elastic bodies: rods, layered cylinders, solids, half-spaces. Each builder returns a Structure."""
