"""Warnings are of one kind, and name the line of the user's code."""

import warnings
from threading import Thread

import pytest

import hertzlink as hl
from structures.caution import caution, collected


def test_a_caution_names_the_line_that_called() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="too long") as caught:
        caution("too long")
    assert caught[0].filename == __file__


def test_one_filter_makes_all_cautions_errors() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        with pytest.raises(hl.HertzlinkWarning, match="too long"):
            caution("too long")


def test_collected_cautions_warn_nobody() -> None:
    """The inner of two collections takes its own."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with collected() as outer:
            caution("first")
            with collected() as inner:
                caution("second")
            caution("third")
    assert (outer, inner) == (["first", "third"], ["second"])


def test_another_thread_is_not_collected_from() -> None:
    with warnings.catch_warnings(record=True) as caught, collected() as here:
        warnings.simplefilter("always")
        thread = Thread(target=caution, args=("elsewhere",))
        thread.start()
        thread.join()
    assert here == []
    assert [str(one.message) for one in caught] == ["elsewhere"]
