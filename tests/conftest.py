"""Hypothesis draws the same examples each time: everything random has a seed."""

from hypothesis import settings

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")
