"""`ModalPlate`: one basis of a rectangle for all places, thicknesses and materials."""

from dataclasses import replace

import numpy as np
import pytest
from independent.plates import levy

import hertzlink as hl
from plates.modal import modes_at
from plates.section import homogeneous_section

BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, BEAD, impact_speed=0.31)
ALUMINIUM = hl.ALUMINIUM_6061
UNTIL = 0.4e-3


def ratio(structure: hl.Structure, until: float = UNTIL) -> float:
    return float(hl.amplitude_ratio(hl.CoSimulation(CHAIN, structure).run(until), sensor=7))


def plate_of(
    length: float, width: float, edges: tuple[str, ...], thickness: float = 2e-3, frequency: float = 40e3
) -> hl.Plate:
    return hl.kirchhoff_plate(length, width, thickness, ALUMINIUM, hl.Supports(*edges), highest_frequency=frequency)


def frequencies(edges: tuple[str, ...], sides: tuple[float, float] = (1.0, 1.0)) -> np.ndarray:
    """ω a² √(ρt/D) of all modes, from the lowest on; ν = 0.3."""
    # A place off both middle lines moves in all of them.
    fourth, _ = modes_at(sides, (edges[:2], edges[2:]), (0.31, 0.23), 0.3, 100.0)
    return np.sqrt(np.sort(fourth))


@pytest.mark.parametrize(
    ("edges", "expected"),
    [
        (("clamped",) * 4, [35.992, 73.413, 73.413, 108.27]),
        (("free",) * 4, [0.0, 0.0, 0.0, 13.489, 19.789, 24.432]),
        (("clamped", "clamped", "free", "free"), [22.272, 26.529, 43.664, 61.466, 67.549, 79.904]),
        (("free", "free", "clamped", "clamped"), [22.272, 26.529, 43.664, 61.466, 67.549, 79.904]),
        (("clamped", "free", "free", "free"), [3.4917, 8.5246, 21.429, 27.331]),
        (("clamped", "clamped", "simple", "free"), [23.460, 35.612, 63.126, 66.808]),
        (("clamped", "simple", "clamped", "simple"), [27.056, 60.544, 60.791, 92.865]),
    ],
)
def test_frequencies_are_leissas(edges: tuple[str, ...], expected: list[float]) -> None:
    """J. Sound Vib. 31 (1973) 257, ν = 0.3: upper bounds by Ritz's method; free corners cost them 1 %."""
    found = frequencies(edges)[: len(expected)]
    assert found == pytest.approx(expected, rel=1e-2, abs=2e-2)
    assert np.all(found < np.array(expected) * (1.0 + 1e-3) + 2e-2)


@pytest.mark.parametrize("held", ["clamped", "simple", "free"])
@pytest.mark.parametrize("turned", [False, True])
def test_frequencies_between_two_simple_edges_are_levys(held: str, turned: bool) -> None:
    """Plates of 1 × 0.6, exactly; the modes across are sines, whichever way the plate lies."""
    exact = np.sort(np.concatenate([levy(1.0 / 0.6, held, m, 300.0) for m in range(1, 6)]))
    edges, sides = ("simple", "simple", held, held), (1.0, 0.6)
    found = frequencies((*edges[2:], *edges[:2]), sides[::-1]) if turned else frequencies(edges, sides)
    exact = exact[exact < 200.0]
    assert found[: exact.size] == pytest.approx(exact, rel=2e-5)


@pytest.mark.parametrize(
    "edge", ["clamped", *(pytest.param(e, marks=pytest.mark.thorough) for e in ("simple", "free"))]
)
def test_before_other_echoes_it_is_the_exact_half_plane(edge: str) -> None:
    modal = hl.ModalPlate(plate_of(0.4, 0.5, (edge, "free", "free", "free"), frequency=30e3), UNTIL)
    for distance, thickness in ((0.01, 2e-3), (0.02, 2e-3), (0.02, 4e-3)):
        exact = ratio(hl.half_plane(thickness, ALUMINIUM, edge, distance, UNTIL))
        assert ratio(modal.at(distance, 0.21, thickness)) == pytest.approx(exact, abs=2e-4)


@pytest.mark.parametrize(
    ("edges", "sides", "place", "near"),
    [
        (("clamped",) * 4, (0.25, 0.18), (0.05, 0.06), 1e-4),
        (("clamped", "clamped", "simple", "free"), (0.3, 0.2), (0.27, 0.1), 1e-4),
        *(
            pytest.param(*case, marks=pytest.mark.thorough)
            for case in (
                (("clamped",) * 4, (0.25, 0.18), (0.125, 0.17), 1e-4),
                (("clamped",) * 4, (0.25, 0.18), (0.012, 0.015), 3e-4),
                (("simple", "simple", "free", "free"), (0.3, 0.1), (0.1, 0.02), 3e-4),
                (("free",) * 4, (0.2, 0.15), (0.02, 0.02), 3e-4),
            )
        ),
    ],
)
def test_it_is_the_plate_of_a_fine_mesh(
    edges: tuple[str, ...], sides: tuple[float, float], place: tuple[float, float], near: float
) -> None:
    """It is struck on and off the middle lines, in a corner, and between unlike edges."""
    mesh = plate_of(*sides, edges, frequency=200e3).at(*place)
    expected = ratio(hl.reduce(mesh, UNTIL, 1e-3, 1200))
    assert ratio(hl.ModalPlate(plate_of(*sides, edges), UNTIL).at(*place)) == pytest.approx(expected, abs=near)


def test_echoes_of_all_edges_return() -> None:
    """The trace of 0.6 ms holds several."""
    until, place, edges = 0.6e-3, (0.05, 0.06), ("clamped",) * 4
    run, fine = (
        hl.CoSimulation(CHAIN, structure).run(until)
        for structure in (
            hl.ModalPlate(plate_of(0.25, 0.18, edges), until).at(*place),
            hl.reduce(plate_of(0.25, 0.18, edges, frequency=200e3).at(*place), until, 1e-3, 1200),
        )
    )
    expected = hl.sensor_force(fine, 7).values
    found = np.interp(fine.time, run.time, hl.sensor_force(run, 7))
    assert np.abs(found - expected).max() < 3e-4 * expected.max()


def test_thickness_and_material_scale_frequencies_and_motion() -> None:
    """ω ∝ t √(E/ρ) and φ² ∝ 1/ρt, so a slow plate repeats a fast one in a longer time."""
    edges, place = ("clamped", "free", "simple", "clamped"), (0.04, 0.05)
    foil = hl.Material(16.0 * ALUMINIUM.youngs_modulus, ALUMINIUM.poisson_ratio, 4.0 * ALUMINIUM.density)
    modal = hl.ModalPlate(plate_of(0.2, 0.15, edges), UNTIL)
    usual, other = modal.at(*place), modal.at(*place, 3e-3, foil)
    assert (other.surface.material, other.origin["thickness"]) == (foil, 3e-3)
    assert other.origin["at"] == list(place)
    assert "face" not in other.origin
    assert ratio(other) != pytest.approx(ratio(usual), abs=1e-2)
    thick = replace(plate_of(0.2, 0.15, edges, frequency=200e3), section=homogeneous_section(3e-3, foil))
    assert ratio(other) == pytest.approx(ratio(hl.reduce(thick.at(*place), UNTIL, 1e-3, 1200)), abs=1e-4)
    # r = 3 times as fast, 54 times as stiff: 54 ŵ(r s) is the other's ŵ(s).
    s = 2.0 * np.pi * 40e3
    one, fast = (
        (body.contact**2 / (body.stiffness.diagonal() + rate**2)).sum() + body.flexibility
        for body, rate in ((usual, s), (other, 3.0 * s))
    )
    assert one == pytest.approx(54.0 * fast, rel=1e-4)


def test_results_are_smooth() -> None:
    """Second differences of AR over steps of 1 µm, and of 1e-5 of the thickness."""
    modal = hl.ModalPlate(plate_of(0.2, 0.15, ("clamped", "clamped", "free", "free")), UNTIL)
    places = [ratio(modal.at(0.02 + 1e-6 * i, 0.06)) for i in range(7)]
    walls = [ratio(modal.at(0.02, 0.06, 2e-3 * (1.0 + 1e-5 * i))) for i in range(7)]
    for values in (places, walls):
        assert abs(np.diff(values)).min() > 0.0
        assert abs(np.diff(values, 2)).max() < 1e-8


def test_a_plate_and_its_mirror_image_answer_alike() -> None:
    modal = hl.ModalPlate(plate_of(0.2, 0.15, ("clamped", "clamped", "free", "free")), UNTIL)
    one, *others = (modal.at(*place) for place in ((0.03, 0.04), (0.17, 0.04), (0.03, 0.11), (0.17, 0.11)))
    for other in others:
        assert ratio(other) == pytest.approx(ratio(one), abs=1e-9)


@pytest.mark.parametrize(
    "plate",
    [
        plate_of(0.2, 0.15, ("clamped", "symmetry", "free", "free")),
        replace(plate_of(0.2, 0.15, ("clamped",)), additions=(hl.PointMass(0.1, 0.1, 1e-3),)),
        hl.mindlin_plate(0.2, 0.15, 2e-3, ALUMINIUM, hl.Supports("clamped")),
        hl.kirchhoff_plate(0.2, 0.15, 2e-3, ALUMINIUM, hl.Supports(hl.ElasticEdge(1e6))),
        hl.kirchhoff_plate(0.2, 0.15, None, hl.Laminate([hl.Ply(ALUMINIUM, 1e-3)] * 2), hl.Supports("clamped")),
        hl.kirchhoff_plate(0.2, 0.15, 2e-3, ALUMINIUM, hl.Supports("clamped"), cells=(4, 4)),
    ],
)
def test_other_plates_are_reduced(plate: hl.Plate) -> None:
    with pytest.raises(ValueError, match="reduce"):
        hl.ModalPlate(plate, UNTIL)


@pytest.mark.parametrize(("place", "why"), [((0.3, 0.1), "between 0 and 0.2 m"), ((0.0, 0.0), "edge that is held")])
def test_a_place_must_move(place: tuple[float, float], why: str) -> None:
    modal = hl.ModalPlate(plate_of(0.2, 0.15, ("free", "free", "clamped", "free")), UNTIL)
    with pytest.raises(ValueError, match=why):
        modal.at(*place)
    assert modal.at(0.2, 0.1).size > 0  # a free edge moves
