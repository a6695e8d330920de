"""Compiled functions of structures: the motion of oscillators and of coupled degrees of freedom."""
