"""Checks of a participant of your own: `checks.check_structure(make)`. Everything random has a seed."""
