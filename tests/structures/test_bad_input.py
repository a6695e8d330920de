"""Bad input to structures: each error names the argument and its value, in one line."""

from typing import Any

import pytest

import hertzlink as hl

BLOCK: dict[str, Any] = {
    "mass": [[0.05]], "stiffness": [[2e6]], "damping": None, "contact": [1.0], "flexibility": 0.0,
    "surface": hl.Surface(hl.STEEL_316),
}  # fmt: skip


@pytest.mark.parametrize("origin", ["x", 3, None, [("kind", "block")]])
def test_an_origin_that_is_no_mapping(origin: Any) -> None:
    with pytest.raises(ValueError, match=r"origin = .*: must be a mapping such as \{\"kind\": \"block\"\}"):
        hl.Structure(**BLOCK, origin=origin)


def test_an_origin_of_a_users_own_is_never_taken_for_ours() -> None:
    """Names that structures of hertzlink use in an origin may hold anything."""
    names = ("thickness", "section", "supports", "reduction", "cells", "highest_frequency", "kind")
    block = hl.Structure(**BLOCK, origin=dict.fromkeys(names, "own"))
    bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    run = hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.1), block).run(5e-5)
    assert '"thickness": "own"' in run.attrs["input"]
