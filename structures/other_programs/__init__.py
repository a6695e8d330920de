"""Structures from matrices, modes and frequency responses that other programs or experiments give."""
