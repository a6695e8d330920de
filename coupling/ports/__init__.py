"""The coupling to other programs by preCICE."""
