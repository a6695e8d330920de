"""Compiled functions of structures: motion of oscillators and coupled degrees of freedom."""
