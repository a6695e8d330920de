"""Couplings to other programs: FMI and preCICE."""
