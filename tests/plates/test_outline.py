"""Outlines of panels: names of edges, circles, meshes, bad input."""

import builtins
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from plates.shapes.shape import Cells

SQUARE = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.3), (0.0, 0.3)]
HOLE = [(0.1, 0.1), (0.2, 0.1), (0.15, 0.2)]


def area(mesh: Any) -> float:
    one, other = (mesh.p[:, mesh.t[i]] - mesh.p[:, mesh.t[0]] for i in (1, 2))
    return float(0.5 * abs(one[0] * other[1] - one[1] * other[0]).sum())


def test_names_of_edges() -> None:
    assert hl.Outline(SQUARE, holes=[HOLE]).names == ["side 1", "side 2", "side 3", "side 4", "hole 1"]
    assert hl.Outline(SQUARE, edges="rim").names == ["rim"]
    assert hl.Outline(SQUARE, edges=["a", "b", "a", "c"]).names == ["a", "b", "c"]


def test_circle_keeps_its_area() -> None:
    x, y = np.array(hl.circle(0.2, centre=(1.0, 2.0), corners=24)).T
    assert 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == pytest.approx(np.pi * 0.2**2, rel=1e-9)
    assert (x.mean(), y.mean()) == pytest.approx((1.0, 2.0))


def test_mesh_fits_the_outline() -> None:
    """Area, length of each edge, a corner at the contact, sizes there and far away."""
    pytest.importorskip("gmsh")
    outline = hl.Outline(SQUARE, holes=[HOLE], edges=["bottom", "right", "top", "left"])
    mesh, edges = outline.mesh(0.25, 0.25, Cells(2e-3, 0.5, 0.05))
    assert area(mesh) == pytest.approx(0.3 * 0.3 - 0.005, rel=1e-9)
    lengths = {name: float(np.linalg.norm(np.diff(mesh.p[:, mesh.facets[:, on]], axis=1)[:, 0], axis=0).sum())
               for name, on in edges.items()}  # fmt: skip
    assert lengths == pytest.approx(
        {"bottom": 0.3, "right": 0.3, "top": 0.3, "left": 0.3, "hole 1": 0.1 + 0.0125**0.5 * 2}
    )
    away = np.linalg.norm(mesh.p - np.array([[0.25], [0.25]]), axis=0)
    sizes = np.linalg.norm(np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0], axis=0)
    assert away.min() < 1e-12
    assert 1e-3 < sizes[(mesh.facets == away.argmin()).any(axis=0)].max() < 4e-3
    assert 0.02 < sizes.max() < 0.1


def test_cells_are_no_larger_than_the_outline() -> None:
    """gmsh ends the process at sizes of 1e300."""
    pytest.importorskip("gmsh")
    coarse = hl.Outline(SQUARE).mesh(0.05, 0.05, Cells(1e300, 0.3, 1e300))
    assert 2 <= coarse.mesh.nelements < 50


def test_without_gmsh(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file")
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r"libGLU.*pip install hertzlink\[mesh\]"):
        hl.Outline(SQUARE).mesh(0.1, 0.1, Cells(0.05, 0.5, 0.1))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"corners": SQUARE[:2]}, "must be three corners"),
        ({"corners": "abc"}, "corners = 'abc'"),
        ({"corners": [(0.0, 0.0), (1.0, 0.0), 3.0]}, r"corners\[2\] = 3\.0: must be \(x, y\)"),
        ({"corners": [(0.0, 0.0), (float("nan"), 0.0), (1.0, 1.0)]}, r"corners\[1\]\[0\] = nan"),
        ({"corners": [*SQUARE, SQUARE[0]]}, r"corners\[0\], corners\[4\]: must not coincide; both are at \(0, 0\)"),
        (
            {"corners": [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]]},
            r"corners\[0\]: .* must not cross that from corners\[2\]",
        ),
        ({"corners": [(0.0, 0.0), (0.3, 0.0), (0.1, 0.0), (0.1, 0.2)]}, "must not lie on the side"),
        ({"corners": [(0.0, 0.0), (0.3, 0.0), (0.3, 0.3), (0.1, 0.0), (0.0, 0.3)]}, "must not lie on the side"),
        ({"holes": [[(0.2, 0.1), (0.4, 0.1), (0.2, 0.2)]]}, "must not cross that from holes"),
        ({"holes": [[(0.5, 0.1), (0.6, 0.1), (0.5, 0.2)]]}, r"holes\[0\]: must lie inside"),
        ({"holes": [HOLE, [(0.14, 0.12), (0.16, 0.12), (0.15, 0.14)]]}, r"holes\[1\]: must lie inside .* another hole"),
        ({"holes": np.array(0.1)}, r"holes\[0\] = array\(0\.1\): must be three corners"),
        ({"holes": HOLE}, r"holes\[0\] = \(0\.1, 0\.1\): must be three corners"),
        ({"edges": ["a", "b"]}, "must be one name, or 4"),
        ({"edges": ["a", "b", "c", 4]}, r"edges = \['a', 'b', 'c', 4\]: must be a list of names"),
    ],
)
def test_bad_outlines(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Outline(**({"corners": SQUARE} | given))


@pytest.mark.parametrize("place", [(0.15, 0.13), (0.4, 0.1)])
def test_contact_in_a_hole_or_outside(place: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="must lie inside the outline, and not in a hole"):
        hl.mindlin_panel(hl.Outline(SQUARE, holes=[HOLE]), 1e-3, hl.PTFE).at(*place)


@pytest.mark.parametrize("size", [1e-3, 0.3])
def test_a_corner_touches_a_side_by_its_distance_from_it(size: float) -> None:
    """A corner comes close to the side opposite, which is oblique: touching means nearer than 1e-9 of the size."""
    turned = np.array([(0.8, 0.6), (-0.6, 0.8)])

    def panel(gap: float) -> hl.Outline:
        return hl.Outline(size * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.5, gap), (0.0, 1.0)]) @ turned)

    assert panel(1e-8).area == pytest.approx(0.5 * size**2, rel=1e-6)
    with pytest.raises(ValueError, match=r"must not cross|must not lie on"):
        panel(1e-10)
