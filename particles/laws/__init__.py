"""Contact laws of pairs of beads: by formula and computed."""
