"""Contact laws of pairs of beads: by formulas, by finite elements, and with yielding."""
