"""Beams struck from the side, under an axial force and on elastic ground."""

from plates.beam import beam, beam_buckling_force

__all__ = ["beam", "beam_buckling_force"]
