"""All studies: each printed number has its row, tables are honest, figures are drawn and described."""

import pytest
from quick import found, quick

from hertzlink.studies import STUDIES, captions, draw, study
from hertzlink.studies.compare import compare, printed, table

FAST = ("ellipsoids", "cylinders", "rod-stiffness")
SLOW = [name for name in STUDIES if name not in (*FAST, "thesis")]
EACH = [*FAST, *(pytest.param(name, marks=pytest.mark.thorough) for name in SLOW)]


@pytest.mark.parametrize("name", EACH)
def test_each_printed_number_has_its_row(name: str) -> None:
    assert set(printed(name)) <= set(found(name))


@pytest.mark.parametrize("name", EACH)
def test_a_table_holds_no_nan_and_fits_a_terminal(name: str) -> None:
    text = table(compare(name, study(name).numbers(quick(name))))
    assert "nan" not in text.replace("tangent", "").lower().split()
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("name", EACH)
def test_figures_are_drawn_and_described(name: str) -> None:
    with draw.style():
        figures = study(name).figures(quick(name))
    assert set(figures) == set(captions(name))
    for figure in figures.values():
        figure.draw_without_rendering()
        assert any(axis.get_xlabel() for axis in figure.axes)
        assert any(axis.get_ylabel() for axis in figure.axes)


def test_every_study_has_a_line_and_captions() -> None:
    assert all(about.endswith(".") and captions(name) for name, about in STUDIES.items())
