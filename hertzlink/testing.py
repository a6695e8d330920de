"""Regression tests of your own models: their waves, compared with a saved reference."""

from hertzlink.references import assert_same_waves as assert_same_waves
