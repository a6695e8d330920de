"""`ReducedPlate`: one basis for all positions in a range."""

import pickle

import numpy as np
import pytest

import hertzlink as hl
from plates.contacts import contacts_at
from plates.elements.self_displacement import self_displacement
from plates.section import homogeneous_section
from structures.reduction import EXPANSION_POINT, Modes, change, pulse_answer

UNTIL, Y, LOW, HIGH = 0.8e-3, 0.1, 0.02, 0.035
PLATE = hl.kirchhoff_plate(
    0.15, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"), highest_frequency=30e3
)
PRESTRESSED = hl.kirchhoff_plate(
    0.15, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped"), additions=[hl.Prestress(1e4, 0.0)]
)
ON_SPRINGS = hl.kirchhoff_plate(0.15, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left=hl.ElasticEdge(1e6, 10.0)))
BEAD = hl.Sphere(3e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.31)


@pytest.fixture(scope="module")
def reduced():
    return hl.ReducedPlate(PLATE, UNTIL, (LOW, HIGH), Y)


def run(structure):
    return hl.CoSimulation(CHAIN, structure, window=1e-6).run(UNTIL)


def on_its_mesh(reduced, x, face="front"):
    """The full structure on the mesh of the reduced plate, with the same flexibility."""
    grid = np.linspace(LOW, HIGH, reduced._count(LOW, HIGH))
    _, _, matrices, _ = PLATE.meshed(contacts_at(grid, np.full(grid.size, Y), "front"))
    small = reduced.at(x, np.full(np.shape(x), Y) if np.ndim(x) else Y, face)
    signs = np.where(np.atleast_1d(face) == "front", 1.0, -1.0)
    contact = np.column_stack([reduced._vector(float(one), Y) for one in np.atleast_1d(x)]) * signs
    full = hl.Structure(
        matrices.mass, matrices.stiffness, None, contact, small.flexibility, small.surface, small.origin,
        matrices=matrices,
    )  # fmt: skip
    return small, full


def answer(structure, pulse=25e-6):
    square, count = structure.stiffness.diagonal(), structure.contacts
    modes = Modes(square, structure.contact.reshape(square.size, count), None, [], np.eye(1))
    return pulse_answer(modes, UNTIL, pulse)


@pytest.mark.parametrize("x", [LOW, 0.0237, 0.0311, 0.0334])
def test_each_position_agrees_with_its_own_reduction(reduced, x):
    small, full = on_its_mesh(reduced, x)
    own = hl.reduce(full, UNTIL, tolerance=1e-3)
    assert small.size < own.size
    found, expected = run(small), run(own)
    assert float(hl.amplitude_ratio(found, 5)) == pytest.approx(float(hl.amplitude_ratio(expected, 5)), abs=1e-4)
    trace, other = (hl.sensor_force(one, 5).values for one in (found, expected))
    assert np.abs(trace - other).max() < 1e-3 * other.max()


def test_positions_between_nodes_agree_with_a_mesh_of_their_own(reduced):
    for x in (0.0237, 0.0311):
        found = float(hl.amplitude_ratio(run(reduced.at(x, Y)), 5))
        own = float(hl.amplitude_ratio(run(hl.reduce(PLATE.at(x, Y), UNTIL)), 5))
        assert found == pytest.approx(own, rel=5e-3)  # what docs/numerics.md states of the meshes


def test_own_displacement_does_not_ripple_with_the_cells(reduced):
    # Of e^(st), s = 2π · 35 kHz, on a plate without edges the displacement is that of all positions.
    found = []
    for x in np.linspace(0.03, HIGH, 11):
        one = reduced.at(float(x), Y)
        found.append(one.contact**2 @ (1.0 / (one.stiffness.diagonal() + EXPANSION_POINT**2)) + one.flexibility)
    assert np.ptp(found) < 1.5e-3 * np.mean(found)


@pytest.mark.parametrize("pulse", [25e-6, 12.5e-6])
@pytest.mark.parametrize("x", [LOW, 0.0257, 0.0319])
def test_the_error_estimate_is_honest(reduced, x, pulse):
    small, full = on_its_mesh(reduced, x)
    error = change(answer(small, pulse), answer(hl.reduce(full, UNTIL, tolerance=1e-4), pulse))
    report = small.origin["reduction"]
    stated = dict([(report["pulse"], report["error_estimate"]), *report["shorter_pulses"]])
    assert error < 2.0 * stated[pulse]


def test_several_contacts(reduced):
    face = ["front", "back"]
    small, full = on_its_mesh(reduced, [0.0231, 0.031], face)
    assert small.contacts == 2
    own = answer(hl.reduce(full, UNTIL, tolerance=1e-3))
    assert change(answer(small), own) < 0.05
    assert abs(own[0, 1]).max() > 0.1 * abs(own[0, 0]).max()


def test_amplitude_ratio_is_a_smooth_function_of_the_position(reduced):
    places = 0.0237 + 1e-6 * np.arange(-4, 5)
    found = [float(hl.amplitude_ratio(run(reduced.at(float(x), Y)), 5)) for x in places]
    step = np.linspace(-1.0, 1.0, 9)
    assert np.ptp(found) > 1e-6
    assert np.abs(found - np.polyval(np.polyfit(step, found, 2), step)).max() < 1e-9


THIN, THICK = 2.29e-3, 4.58e-3


@pytest.fixture(scope="module")
def walls():
    """One basis for thicknesses whose ratio is two."""
    return hl.ReducedPlate(PLATE, UNTIL, (LOW, HIGH), Y, thickness=(THIN, THICK))


@pytest.mark.parametrize("thickness", [THIN, 3.2e-3, THICK])
@pytest.mark.parametrize("x", [LOW, 0.0257])
def test_thicknesses_share_a_basis(walls, thickness, x):
    # On the same mesh, reduced for this thickness and this position alone.
    frequency = 30e3 * thickness / THIN
    plate = hl.kirchhoff_plate(0.15, 0.2, thickness, hl.ALUMINIUM_6061, PLATE.supports, highest_frequency=frequency)
    one = walls.at(x, Y, thickness=thickness)
    grid = np.linspace(LOW, HIGH, walls._count(LOW, HIGH))
    _, _, matrices, _ = plate.meshed(contacts_at(grid, np.full(grid.size, Y), "front"))
    full = hl.Structure(
        matrices.mass, matrices.stiffness, None, walls._vector(x, Y), one.flexibility, one.surface, one.origin,
        matrices=matrices,
    )  # fmt: skip
    own = hl.reduce(full, UNTIL, tolerance=1e-3)
    assert one.valid_until == UNTIL
    assert one.origin["thickness"] == thickness
    report = one.origin["reduction"]
    for pulse, error in [(25e-6, report["error_estimate"]), report["shorter_pulses"][0]]:
        assert change(answer(own, pulse), answer(one, pulse)) < 2.0 * error
    found, expected = run(one), run(own)
    assert float(hl.amplitude_ratio(found, 5)) == pytest.approx(float(hl.amplitude_ratio(expected, 5)), abs=1e-4)
    assert float(hl.time_of_flight(found, 5)) == pytest.approx(float(hl.time_of_flight(expected, 5)), abs=1e-7)


@pytest.mark.parametrize("thickness", [THIN, THICK])
def test_thicknesses_at_one_place_share_the_vectors_of_the_thickest(thickness):
    one = hl.ReducedPlate(PLATE, UNTIL, 0.03, Y, thickness=(THIN, THICK)).at(0.03, Y, thickness=thickness)
    frequency = 30e3 * thickness / THIN
    plate = hl.kirchhoff_plate(0.15, 0.2, thickness, hl.ALUMINIUM_6061, PLATE.supports, highest_frequency=frequency)
    own = hl.reduce(plate.at(0.03, Y), UNTIL, tolerance=1e-3)
    assert change(answer(own), answer(one)) < 2e-2
    ratios = [float(hl.amplitude_ratio(run(each), 5)) for each in (one, own)]
    assert ratios[0] == pytest.approx(ratios[1], abs=1e-4)


def test_a_thickness_beyond_the_range_scales(walls):
    thicker, thinner = (walls.at(0.03, Y, thickness=one) for one in (1.5 * THICK, 0.5 * THIN))
    assert thicker.valid_until == pytest.approx(UNTIL / 1.5)
    assert thinner.valid_until == pytest.approx(2.0 * UNTIL)
    assert thinner.origin["reduction"]["pulse"] == pytest.approx(50e-6)


def test_other_thickness_is_the_scaled_structure(reduced):
    one, other = reduced.at(0.03, Y, thickness=4e-3), hl.scaled(reduced.at(0.03, Y), 4e-3)
    assert np.array_equal(one.stiffness.diagonal(), other.stiffness.diagonal())
    assert one.valid_until == other.valid_until < UNTIL


def test_a_copy_from_another_process_gives_the_same_bits(reduced):
    one, other = (each.at(0.0277, Y) for each in (reduced, pickle.loads(pickle.dumps(reduced))))
    assert np.array_equal(one.contact, other.contact)
    assert one.flexibility == other.flexibility


def test_a_rectangle_of_positions():
    area = hl.ReducedPlate(PLATE, 0.3e-3, (0.06, 0.068), (0.1, 0.106), tolerance=0.05)
    for x, y in ((0.0631, 0.1037), (0.067, 0.1)):
        own = hl.reduce(PLATE.at(x, y), 0.3e-3)
        found = [
            float(hl.CoSimulation(CHAIN, one, window=1e-6).run(0.3e-3).contact_force.max())
            for one in (area.at(x, y), own)
        ]
        assert found[0] == pytest.approx(found[1], rel=2e-3)


def test_self_displacement_between_nodes():
    # c of square cells: 0.0021 at a node, 0.0040 at the middle of an edge, 0.0058 in the middle of a cell.
    wall, cell = homogeneous_section(2e-3, hl.ALUMINIUM_6061), 2.5e-3
    nodes = cell * np.arange(-14, 16)
    own, unit = self_displacement(wall, nodes, nodes), cell**2 / wall.bending[0, 0]
    assert own.missing(0.0, 0.0) == 0.0
    assert own.missing(0.5 * cell, 0.0) / unit == pytest.approx(0.0019, abs=2e-4)
    assert own.missing(0.5 * cell, 0.5 * cell) / unit == pytest.approx(0.0037, abs=3e-4)
    assert own.missing(7.5 * cell, -3.0 * cell) == pytest.approx(own.missing(0.5 * cell, 0.0), rel=1e-9)


def test_too_few_vectors_warn():
    with pytest.warns(hl.HertzlinkWarning, match="40 vectors leave an error"):
        hl.ReducedPlate(PLATE, UNTIL, (LOW, HIGH), Y, largest=40)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"plate": "plate"}, "plate"),
        ({"plate": hl.mindlin_plate(0.2, 0.2, 4e-3, hl.BRASS_360, hl.Supports())}, "Mindlin plate"),
        ({"until": 0.0}, "until"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"pulse": 0.0}, "pulse"),
        ({"largest": 0}, "largest"),
        ({"thickness": 0.0}, "thickness"),
        ({"thickness": (4e-3, 2e-3)}, "thickness = .*least number comes first"),
        ({"thickness": (2e-3, 0.16)}, "exceeds the plate's shorter side"),
        ({"thickness": (2e-3, 3e-3), "plate": PRESTRESSED}, "does not scale with thickness.*additions"),
        ({"thickness": (2e-3, 3e-3), "plate": ON_SPRINGS}, "does not scale with thickness.*elastic edges"),
        ({"x": (0.03, 0.02)}, "least number comes first"),
        ({"x": (0.01, 0.02, 0.03)}, "x = "),
        ({"x": "left"}, "x = "),
        ({"x": (0.1, 0.2)}, "must lie on the plate"),
        ({"x": (0.01, 1e9)}, "must lie on the plate"),
        ({"x": (0.0, 0.02)}, "clamped edge"),
        ({"x": (0.01, 0.14), "y": (0.01, 0.19)}, "smaller range"),
    ],
)
def test_bad_input(changes, words):
    given = {"plate": PLATE, "until": UNTIL, "x": (LOW, HIGH), "y": Y} | changes
    with pytest.raises(ValueError, match=words):
        hl.ReducedPlate(**given)


@pytest.mark.parametrize(("x", "y"), [(0.0199, Y), (0.036, Y), (0.03, 0.11), ([0.03, 0.05], [Y, Y])])
def test_positions_outside_the_range_are_refused(reduced, x, y):
    with pytest.raises(ValueError, match="was reduced for contacts"):
        reduced.at(x, y)


def test_the_latest_place_serves_no_other_place_face_or_wall(reduced):
    first = reduced.at(0.0231, Y)
    others = [
        reduced.at(0.0233, Y), reduced.at(0.0231, Y, thickness=3e-3), reduced.at([0.0231, 0.03], [Y, Y]),
        reduced.at([0.0231, 0.03], [Y, Y], ["front", "back"]),
    ]  # fmt: skip
    assert len(reduced._latest) == 1
    for i, one in enumerate([first, *others]):
        assert not any(np.array_equal(one.contact, other.contact) for other in [first, *others][i + 1 :])
    spoiled = reduced.at(0.0231, Y)
    for numbers in (spoiled.contact, spoiled.mass.data, spoiled.stiffness.data):
        numbers[...] = 0.0
    spoiled.origin["reduction"]["shared"]["x"] = "spoiled"
    again = reduced.at(0.0231, Y)
    assert np.array_equal(again.contact, first.contact)
    assert np.array_equal(again.mass.data, first.mass.data)
    assert np.array_equal(again.stiffness.data, first.stiffness.data)
    assert again.origin == first.origin
    assert reduced.at(0.0231, Y, "back").origin["face"] == "back"
