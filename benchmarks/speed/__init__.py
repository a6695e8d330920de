"""Benchmarks for asv: set-ups of the scripts in the folder above, timed over commits."""
