"""A store notices what build and measure use from outside: globals, closures, defaults, and their code."""

import importlib
import linecache
import shutil
import sys
from pathlib import Path

import pytest
import xarray as xr

import hertzlink as hl

OUTSIDE = """
from functools import cache
from types import SimpleNamespace
import hertzlink as hl
import numpy as np
import settings

SPEED, TABLE, CACHE, LEVELS = 0.3, {"wall": [hl.PTFE]}, {}, np.linspace(0.0, 1.0, 50)
MASS = hl.Structure([[0.05]], [[2e6]], None, [1.0], 0.0, hl.Surface(hl.STEEL_316))
calls = 0


class Part:
    scale = 2.0

    def bead(self, radius=1e-3):
        return hl.Sphere(radius * self.scale, hl.STEEL_440C)


class Wall:
    def __init__(self, thickness):
        self.thickness, self.made = thickness, []

    def note(self):
        self.made.append(self.thickness)


class Setup:
    speed = 0.2


class Slotted:
    __slots__ = ("level",)


SETUP, SLOTTED = Setup(), Slotted()
SLOTTED.level = 1.0
WALL, NAMES = Wall(0.1), SimpleNamespace(limit=7)
TOOLS = {"half": lambda number: 0.5 * number}


def factory(preload):
    def build(length):
        '''Of a length.'''
        global calls
        calls += 1
        CACHE[length] = calls
        WALL.note()
        assert TOOLS["half"](settings.double(NAMES.limit)) > 0.0
        assert SETUP.speed + SLOTTED.level > 0.0
        chain = hl.Chain([Part().bead()] * 2, Part().bead(), SPEED, preload=preload)
        return hl.CoSimulation(chain, MASS if length > settings.LIMIT else wall())
    return build


@cache
def wall(place=0):
    return hl.half_space(TABLE["wall"][place])


def measure(run):
    return run[["contact_force"]].max() * LEVELS[-1] * THRESHOLD["of"].item()


THRESHOLD = {"of": np.float64(2.0)}
build = factory(1.0)
# settings.py
LIMIT = OTHER = 0.5
TWO = 2.0

def double(number):
    return TWO * number
"""


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "SPEED, TABLE, CACHE, LEVELS = 0.3",
            "SPEED, TABLE, CACHE, LEVELS = 0.4",
            "SPEED of build = 0.3 there and 0.4",
        ),
        ("[hl.PTFE]", "[hl.NYLON]", r"TABLE of wall\.wall\[0\]\[1\]\.density = 2151\.0 there and"),
        ("[[2e6]]", "[[3e6]]", "MASS of build not the same"),
        ("scale = 2.0", "scale = 3.0", r"Part\.scale = 2\.0 there and 3\.0 here"),
        ("radius=1e-3", "radius=2e-3", r"default radius of bead = 0\.001 there"),
        ("place=0", "place=-1", "default place of wall = 0 there"),
        ("factory(1.0)", "factory(2.0)", r"preload of build = 1\.0 there"),
        ("LIMIT = OTHER = 0.5", "LIMIT = OTHER = 0.6", r"settings\.LIMIT = 0\.5 there and 0\.6 here"),
        ("settings.LIMIT", "settings.OTHER", None),
        ("Wall(0.1)", "Wall(0.2)", r"WALL\.thickness = 0\.1 there"),
        ("limit=7", "limit=8", r"NAMES\.limit = 7 there"),
        ("SLOTTED.level = 1.0", "SLOTTED.level = 2.0", r"SLOTTED\.level = 1\.0 there and 2\.0 here"),
        ("WALL, NAMES", "SETUP.speed = 0.3\nWALL, NAMES", r"SETUP\.speed = 0\.2 there and 0\.3 here"),
        ("TWO = 2.0", "TWO = 3.0", r"TWO of double = 2\.0 there"),
        ("TWO = 2.0", "TWO = 2", ""),
        ("0.5 * number", "number / 2", None),
        ("self.made = thickness, []", "self.made = thickness, [3.0]", None),
        ("1.0, 50", "1.1, 50", r"LEVELS of measure\[2\] not the same"),
        ("float64(2.0)", "float64(3.0)", r"THRESHOLD of measure\.of = 2\.0 there"),
        ("length > settings", "length < settings", None),
        ("calls = 0", "calls = 0  # so far", ""),
        ("Of a length.", "Of another length.", ""),
        ("[hl.PTFE]}, {}", "[hl.PTFE]}, {0.0: 7}", ""),
        ("calls = 0", "calls = 9", ""),
    ],
)
def test_what_build_uses_from_outside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder, before: str, after: str,
    message: str | None,
) -> None:  # fmt: skip
    """Changed data are refused by name, changed code is warned of; comments and caches may change."""
    monkeypatch.syspath_prepend(tmp_path)

    def run(text: str) -> xr.Dataset:
        for name, content in zip(("plant", "settings"), text.split("# settings.py\n"), strict=True):
            (tmp_path / f"{name}.py").write_text(content)
            sys.modules.pop(name, None)
        linecache.clearcache()
        importlib.invalidate_caches()
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        plant = importlib.import_module("plant")
        return hl.sweep(plant.build, 2e-5, 1, plant.measure, tmp_path / "store", length=[0.0, 1.0])

    assert before in OUTSIDE
    first = run(OUTSIDE)
    if message:
        with pytest.raises(ValueError, match=f"sweep.json was made with other data: {message}.*use another folder"):
            run(OUTSIDE.replace(before, after))
        return
    recwarn.clear()
    again = run(OUTSIDE.replace(before, after))
    assert again.contact_force.identical(first.contact_force)
    said = ["the code of build or measure is not that with which" in str(one.message) for one in recwarn]
    assert any(said) == (message is None)
    assert ("the code of build" in again.attrs["warnings"]) == (message is None)
