"""A described part is declared once: its checks, warnings, data and tables follow from its signature."""

import pickle
import re
import warnings
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import pytest

import hertzlink as hl
from hertzlink.quantities import Count, OneOf, Quantity
from structures.described import Described, description, registered

ROOMS = ("structures", "particles", "plates", "coupling")


def ours() -> list[Described]:
    described = [one for one in registered() if str(one.target.__module__).partition(".")[0] in ROOMS]
    more = (hl.CoSimulation.__init__, hl.CoSimulation.run, hl.reduce, hl.laws.computed_law)
    return [*described, *filter(None, map(description, more))]


def test_a_parameter_without_an_annotation_is_refused() -> None:
    """Nothing would check it, and a case could not give it."""

    def block(side: hl.quantities.Length, material):  # type: ignore[no-untyped-def]
        return None

    with pytest.raises(
        ValueError,
        match=r"block: material must have an annotation, such as material: float or material: hl\.quantities",
    ):
        hl.described(block)


def test_all_kinds_are_different() -> None:
    tables = [one.kind for one in ours() if one.makes is hl.Structure]
    assert len(tables) == len(set(tables))


@hl.described
class Part:
    """A part. With words."""

    length: hl.quantities.Length
    ratio: Annotated[float, Quantity(low=0.5, high=2.0)] = 1.0
    form: Annotated[str, OneOf("round", "flat")] = "round"
    count: Annotated[int, Count(2)] = 3
    material: hl.Material | None = None
    name: str = ""


@hl.described
class Longer(Part):
    """A part of a part."""

    more: Annotated[float, Quantity("s", "a time", "1 ms", or_zero=True, likely=(0.0, 1.0), above="ms")] = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.more == 0.25:
            raise ValueError("more = 0.25: must be another")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"length": -1.0}, "length = -1.0: must be a positive number of m"),
        ({"length": "1 mm"}, "length = '1 mm': must be a finite number of m"),
        ({"length": None}, "length = None: must be a finite number of m"),
        ({"ratio": 3.0}, "ratio = 3.0: must lie between 0.5 and 2"),
        ({"form": "rund"}, "form = 'rund': must be one of 'round', 'flat' (did you mean 'round'?)"),
        ({"count": 1}, "count = 1: must be a whole number, 2 or more"),
        ({"material": "PTFE"}, "material = 'PTFE': must be a Material; MATERIALS[name] gives one by name"),
        ({"name": 3}, "name = 3: must be a text"),
        ({"more": 0.25}, "more = 0.25: must be another"),
        ({"more": float("nan")}, "more = nan: must be a finite number of s"),
    ],
)
def test_arguments_are_checked_by_their_annotations(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        Longer(**{"length": 1.0, **arguments})


def test_numbers_become_floats_and_all_else_stays() -> None:
    part = Longer(2, np.float32(0.5), "flat", 4, hl.PTFE, "mine")
    assert (type(part.length), type(part.ratio), part.material) == (float, float, hl.PTFE)
    assert repr(part).startswith("Longer(length=2.0, ratio=0.5, form='flat', count=4")
    assert pickle.loads(pickle.dumps(part)) == part == replace(part)
    assert hash(part) == hash(Longer(2.0, 0.5, "flat", 4, hl.PTFE, "mine"))
    with pytest.raises(AttributeError):
        part.length = 3.0  # type: ignore[misc]


def test_a_number_in_another_unit_is_asked_for_at_the_line_of_the_user() -> None:
    with pytest.warns(
        hl.HertzlinkWarning, match=r"Longer 'mine' more = 20: is read as 20 s, .* mean \S+ ms\?"
    ) as caught:
        Longer(1.0, name="mine", more=20.0)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Longer(1.0, more=0.0)


def test_a_class_that_derives_without_the_decorator_is_checked_too() -> None:
    class Own(Part):
        def __init__(self) -> None:
            super().__init__(-1.0)

    with pytest.raises(ValueError, match="length"):
        Own()


def test_a_function_notes_its_arguments_and_names_wrong_ones() -> None:
    @hl.described
    def block(
        side: hl.quantities.Length, material: hl.Material, note: str = "", *, spring: float | None = None
    ) -> hl.Structure:
        return hl.Structure([[material.density * side**3]], [[0.0]], None, [1.0], 0.0, hl.Surface(material), {"n": 1})

    origin = block(0.02, material=hl.PTFE).origin
    assert {**origin, "material": None} == {"kind": "block", "side": 0.02, "material": None, "note": "", "n": 1}
    with pytest.raises(TypeError, match=r"block\(\) missing 1 required positional argument: 'material'"):
        block(0.02)  # type: ignore[call-arg]
    known = description(block)
    assert known is not None
    assert [one.required for one in known.parameters.values()] == [True, True, False, False]
