"""Warnings are of one kind, and name the line of the user's code."""

import warnings

import pytest

import hertzlink as hl
from structures.caution import caution


def test_a_caution_names_the_line_that_called():
    with pytest.warns(hl.HertzlinkWarning, match="too long") as caught:
        caution("too long")
    assert caught[0].filename == __file__


def test_one_filter_makes_all_cautions_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        with pytest.raises(hl.HertzlinkWarning, match="too long"):
            caution("too long")
