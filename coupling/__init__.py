"""The contact interface, the co-simulation and its measures. This room may use all other rooms."""
