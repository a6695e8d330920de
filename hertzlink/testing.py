"""Regression tests of your own models: their waves, compared with a reference that was saved."""

from coupling.references import assert_same_waves as assert_same_waves
from hertzlink._help import offer as _offer

_offer(__name__)
