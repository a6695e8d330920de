"""Regression tests of your own models: their waves, compared with a reference that was saved."""

from coupling.references import assert_same_waves

__all__ = ["assert_same_waves"]
