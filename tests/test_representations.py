"""What objects print in a terminal and in a notebook: a line and a short table, with the same numbers."""

import html
import re
from functools import cache
from typing import Any

import pytest

import hertzlink as hl
from coupling.results.waves import NoWave, Reflections

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 16, BEAD, 0.44, gravity=9.81, preload=1.5)


@cache
def shown() -> dict[str, Any]:
    """One object of each class, by the pattern of its line."""
    rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-3)
    simulation = hl.CoSimulation(hl.Chain([BEAD] * 16, BEAD, 0.44), rod)
    run = simulation.run(until=1e-3)
    waves = hl.reflections(run, 8)
    plate = hl.kirchhoff_plate(0.2, 0.15, 3e-3, hl.ALUMINIUM_6061, hl.Supports(*4 * ["clamped"]))
    struck = plate.at([0.05, 0.15], [0.07, 0.07])
    two = hl.CoSimulation([CHAIN, CHAIN], [hl.ContactPoint(struck, 0), hl.ContactPoint(struck, 1)])
    return {
        r"Chain\(16 Sphere, struck by Sphere at 0.44 m/s, gravity=9.81, preload=1.5\)": CHAIN,
        r"Structure\(rod, unknowns: \d+, contacts: 1, damping: none, reduced for: 0.001 s\)": rod,
        r"CoSimulation\(16 beads on rod; Condensed\(tolerance=1e-11\)\)": simulation,
        r"CoSimulation\(2 chains, 1 structure, 2 contacts; Condensed\(tolerance=1e-11\)\)": two,
        r"CoSimulation\(1 bead on nothing; .*\)": hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.3), None),
        r"<Kirchhoff plate, 0.2 × 0.15 m, 3 mm of aluminium 6061; .*>": plate,
        r"Wave\([\d.]+ N at [\d.]+ µs\)": waves.incident,
        r"ReflectedWave\([\d.]+ N at [\d.]+ µs, AR = 0\.\d{4}, TOF = .* µs\)": waves.primary,
        r"NoWave\(which='primary', reason='the record is short'\)": NoWave("primary", "the record is short"),
    }


def text_of(table: str) -> str:
    assert re.fullmatch("<table>.*</table>", table)
    return html.unescape(re.sub("<[^>]+>", " ", table))


def test_a_line_without_matrices_or_beads() -> None:
    for pattern, one in shown().items():
        assert re.fullmatch(pattern, repr(one)), repr(one)
        assert len(repr(one)) < 160


def test_a_notebook_shows_the_same_numbers() -> None:
    """In the same units: a table that shows J where the line shows mJ has other digits."""
    for one in shown().values():
        if not hasattr(one, "_repr_html_"):
            continue  # a chain: its simulation has one
        table = text_of(one._repr_html_())
        for number in re.findall(r"(?<![\w.])\d+\.?\d*(?![\w.])", repr(one)):
            assert number in table, (number, table)


def test_text_is_escaped() -> None:
    table = Reflections(*[NoWave("primary", "a < b & c")] * 3)._repr_html_()
    assert "a &lt; b &amp; c" in table


def test_corners_in_place_of_an_outline() -> None:
    """The message stays short."""
    with pytest.raises(ValueError, match=r"shape = \(\(0\.1.*… *: must be an Outline\(corners\)") as found:
        hl.mindlin_panel(hl.circle(0.1), 2e-3, hl.ALUMINIUM_6061)  # type: ignore[arg-type]
    assert len(str(found.value)) < 300
