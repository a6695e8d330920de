"""The contact interface, the co-simulation, and what is measured on it. May use all other rooms."""
