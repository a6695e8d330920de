"""The chain in other programs: FMI and preCICE."""
