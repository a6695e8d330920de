"""Structures from modes and from frequency responses, against the bodies that they were taken from."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import hertzlink as hl

DATA = Path(__file__).parent / "data" / "calculix"
RATIO = 0.005
HERTZ = np.arange(50.0, 2e4, 25.0)
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


@pytest.fixture(scope="module")
def plate() -> hl.Structure:
    """A clamped plate, reduced to oscillators without damping."""
    body = hl.kirchhoff_plate(0.2, 0.2, 4e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), highest_frequency=6e4)
    return hl.reduce(body.at(0.1, 0.1), until=1e-3)


def ratio(structure: hl.Structure) -> float:
    """Return AR of a chain of 12 beads on it."""
    chain = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.02)
    run = hl.CoSimulation(chain, structure).run(until=1e-3)
    return float(hl.reflections(run, sensor=5).primary.amplitude_ratio)


def mobility(structure: hl.Structure, hertz: Any) -> Any:
    s, square = 2j * np.pi * hertz[:, None], structure.stiffness.diagonal()
    return (s * structure.contact**2 / (square + s**2 + 2.0 * RATIO * np.sqrt(square) * s)).sum(axis=1)


def test_modes_of_calculix_are_those_of_its_matrices() -> None:
    cell = hl.from_matrices(
        DATA / "one_cell.mas", DATA / "one_cell.sti", hl.ALUMINIUM_6061, node=7, residual_flexibility=0.0
    )
    square, vectors = eigh(cell.stiffness.toarray(), cell.mass.toarray())
    shapes = vectors.T @ cell.contact
    read = hl.from_modes(
        DATA / "one_cell.frd", hl.ALUMINIUM_6061, node=7, residual_flexibility=float((shapes**2 / square)[3:].sum())
    )
    np.testing.assert_allclose(read.stiffness.diagonal(), square[:3], rtol=1e-8)
    np.testing.assert_allclose(np.abs(read.contact), np.abs(shapes[:3]), rtol=2e-6)  # six digits
    compliance = float((read.contact**2 / read.stiffness.diagonal()).sum()) + read.flexibility
    assert compliance == pytest.approx(float(cell.contact @ np.linalg.solve(cell.stiffness.toarray(), cell.contact)))


@pytest.mark.parametrize(
    ("text", "scale"),
    [
        ("frequency, shape, ratio\n0, 100.0, 0\n2000, 150.0, 0.01\n", 1e-3),
        ("\ufeff0, 100.0, 0\n2000, 150.0, 0.01\n", 1e-3),
        ("damping (%);f [kHz];φ (1/sqrt(t))\n0;0;100.0\n1;2;150.0\n", 1.0),
        ("# modes of a plate\n# f / rad/s   shape / t^-0.5   ζ / -\n0 100.0 0\n12566.370614 150.0 0.01\n", 1e-3),
        ("omega [rad/s];shape;damping\n0;100,0;0\n12566,370614;150,0;0,01\n", 1e-3),
        ("mode,frequency,phi,damping\n,Hz,1/√kg,%\n1,0,3.1622776602,0\n2,2000,4.7434164903,1\n", 1.0),
    ],
)
def test_tables_in_the_units_of_their_heads(tmp_path: Path, text: str, scale: float) -> None:
    (tmp_path / "modes.csv").write_text(text, "utf-8")
    body = hl.from_modes(tmp_path / "modes.csv", hl.PTFE, residual_flexibility=0.0, scale=scale)
    np.testing.assert_allclose(body.contact**-2, [0.1, 0.1 / 1.5**2], rtol=1e-9)  # 1e-4 t
    np.testing.assert_allclose(body.damping.diagonal(), [0.0, 2.0 * 0.01 * 2.0 * np.pi * 2000.0], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frequency (MHz), shape\n9, 1\n", "'frequency .MHz.' must state one of Hz, kHz, rad/s"),
        ("omega, shape\n9, 1\n", "'omega' must state its unit, rad/s"),
        (
            "f, shape, Modal mass (kg)\n9, 1, 1\n",
            "'Modal mass .kg.' is of no column: must be frequency, shape",
        ),
        ("1,500;2,125\n", "'1,500' may have a decimal comma, or one between thousands; write decimal points"),
        ("900,5;2.1\n", "'900,5' may have a decimal comma, or one between thousands"),
        ("eigenvalue, shape\n9, 1\n", "'eigenvalue' names no frequency; convert the column"),
        ("f (Hz), shape (mm)\n9, 1\n", "'shape .mm.' must state one of 1/√kg, 1/√t"),
        ("f, shape, loss factor\n9, 1, 0.1\n", "'loss factor' names no damping ratio"),
        ("f, shape, damping\n9, 1, 0.5\n", "has a damping ratio of 0.5; write the head damping"),
        ("f, damping\n9, 0.1\n", "has no column shape: must be frequency, shape, damping ratio"),
        ("f, freq, shape\n9, 9, 1\n", "'freq' is a second one of frequency"),
        ("f Hz shape damping ratio\n9 1 0.1\n", "does not divide into heads of 3 columns"),
        ("1, 900, 2\n2, 2500, 1\n", "its first column counts 1, 2 …"),
    ],
)
def test_heads_that_leave_something_open_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "modes.csv").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=message):
        hl.from_modes(tmp_path / "modes.csv", hl.PTFE, residual_flexibility=0.0)


@pytest.mark.parametrize("mark", [";", "\t", " "])
@pytest.mark.parametrize("heads", ["", "frequency (Hz){0}shape{0}damping (%)\n"])
def test_tables_with_decimal_commas(tmp_path: Path, heads: str, mark: str) -> None:
    rows = "900,5;2,1;1\n2500;1,8;2\n" if heads else "900,5;2,1;0,01\n2500;1,8;2e-2\n"
    (tmp_path / "modes.csv").write_text(heads.format("\t" if mark == " " else mark) + rows.replace(";", mark))
    body = hl.from_modes(tmp_path / "modes.csv", hl.PTFE, residual_flexibility=0.0)
    omega = 2.0 * np.pi * np.array([900.5, 2500.0])
    np.testing.assert_allclose(body.stiffness.diagonal(), omega**2)
    np.testing.assert_allclose(body.contact, [2.1, 1.8])
    np.testing.assert_allclose(body.damping.diagonal(), [0.02 * omega[0], 0.04 * omega[1]])


def test_what_stands_beside_modes_is_not_read_past(tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text("f, shape (1/√kg)\n900, 1\n", "utf-8")
    table: Any = tmp_path / "modes.csv"
    for frequencies, beside, message in (
        (table, {"shapes": [1.0]}, "shapes: the file of the modes holds them"),
        (table, {"node": 7}, "node = 7: a table is of one point"),
        (table, {"scale": 1e-3}, r"scale = 0.001: modes.csv states shapes in 1/√kg"),
        ([900.0], {"shapes": [1.0], "node": 7}, "node = 7: is for files"),
    ):
        with pytest.raises(ValueError, match=message):
            hl.from_modes(frequencies, hl.PTFE, residual_flexibility=0.0, **beside)


def test_a_plate_of_its_lower_modes_reflects_as_the_plate(plate: hl.Structure) -> None:
    full, count = ratio(plate), 40
    square, shapes = plate.stiffness.diagonal(), plate.contact
    higher = float((shapes**2 / square)[count:].sum())
    lower = np.sqrt(square[:count]) / (2.0 * np.pi)

    def error(residual: float) -> float:
        body = hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=shapes[:count], residual_flexibility=residual)
        return abs(ratio(body) / full - 1.0)

    assert error(higher) < 2e-3
    assert error(0.0) > 5.0 * error(higher)
    with pytest.warns(hl.HertzlinkWarning, match="lack the compliance of all higher ones"):
        hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=shapes[:count])


def test_too_few_modes_are_warned_of(plate: hl.Structure) -> None:
    lower = np.sqrt(plate.stiffness.diagonal()[:6]) / (2.0 * np.pi)
    body = hl.from_modes(lower, hl.ALUMINIUM_6061, shapes=plate.contact[:6], residual_flexibility=0.0)
    with pytest.warns(hl.HertzlinkWarning, match="modes up to .* kHz suits it"):
        hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, impact_speed=0.02), body).run(until=1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_mobility_becomes_the_plate(plate: hl.Structure, noise: float) -> None:
    rng = np.random.default_rng(3)
    error = rng.standard_normal(HERTZ.size) + 1j * rng.standard_normal(HERTZ.size)
    measured = mobility(plate, HERTZ) * (1.0 + noise * error / np.sqrt(2.0))
    body = hl.from_frequency_response(measured, hl.ALUMINIUM_6061, frequency=HERTZ, tolerance=max(noise, 3e-3))
    assert ratio(body) == pytest.approx(ratio(hl.damped(plate, hl.damping.Modal(RATIO))), rel=3e-3)
    fit = body.origin["fit"]
    assert fit["error"] < max(1.05 * noise, 3e-3)
    assert fit["least_real_part"] >= 0.0
    assert (body.damping.diagonal() >= 0.0).all()
    assert body.flexibility >= 0.0


def spring(hertz: Any) -> Any:
    """Return the mobility of 14.1 g on 1.7e7 N/m with 20 N s/m, and of 2e-8 m/N in series."""
    s = 2j * np.pi * hertz
    return s / (1.7e7 + 20.0 * s + 0.0141 * s**2) + 2e-8 * s


@pytest.mark.parametrize(("quantity", "order"), [("receptance", -1), ("mobility", 0), ("accelerance", 1)])
def test_a_mass_on_a_spring_is_found(tmp_path: Path, quantity: str, order: int) -> None:
    hertz = np.linspace(0.0, 9e3, 400)
    values = spring(hertz) * (2j * np.pi * np.maximum(hertz, 1e-3)) ** order
    table = np.column_stack([1e-3 * hertz, 1e3 * values.imag, 1e3 * values.real])
    unit = {"receptance": "mm/N", "mobility": "mm/(N s)", "accelerance": "(mm/s^2)/N"}[quantity]
    head = f"f / kHz, Im [{unit}], Re [{unit}]"
    np.savetxt(tmp_path / "body.csv", table, delimiter=",", header=head, comments="")
    body = hl.from_frequency_response(tmp_path / "body.csv", hl.PTFE, quantity=quantity, tolerance=1e-6)
    heaviest = int(np.argmax(body.contact))
    assert body.contact[heaviest] ** -2 == pytest.approx(0.0141, rel=1e-4)
    assert body.stiffness.diagonal()[heaviest] == pytest.approx(1.7e7 / 0.0141, rel=1e-4)
    assert body.damping.diagonal()[heaviest] == pytest.approx(20.0 / 0.0141, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda y: y.conj() * -1.0, "gives energy at 100 % of its frequencies"),
        (lambda y: np.random.default_rng(0).uniform(1.0, 9.0, HERTZ.size), "its fit by .* modes is .* off"),
        (lambda y: 0.0 * y, "must not be zero"),
        (lambda y: y * np.nan, "must hold finite complex numbers"),
        (lambda y: y[:10], "must be a list as long as the response"),
        (lambda y: "no.csv", "there is no such file"),
        (lambda y: "body.stl", "there is no such file"),
    ],
)
def test_responses_of_no_passive_body_are_refused(change: Callable[[Any], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.from_frequency_response(change(spring(HERTZ)), hl.PTFE, frequency=HERTZ)


def test_magnitude_and_phase_are_no_parts(tmp_path: Path) -> None:
    (tmp_path / "body.csv").write_text("Hz, magnitude, phase (deg)\n100, 1, 90\n")
    with pytest.raises(ValueError, match="'magnitude' names no real part; convert the column"):
        hl.from_frequency_response(tmp_path / "body.csv", hl.PTFE)


def test_a_frequency_that_stands_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="holds 50"):
        hl.from_frequency_response(spring(HERTZ), hl.PTFE, frequency=[50.0, *HERTZ[:-1]])


def test_universal_files(tmp_path: Path) -> None:
    """Datasets 55 and 58 by the published layouts; modal masses are not 1."""
    pytest.importorskip("pyuff")
    path, lines = str(tmp_path / "test.uff"), list[str]()
    for i, (hertz, along) in enumerate([(900.0, [2.0, 4.0]), (2500.0, [-1.0, 6.0])], 1):
        lines += [f"{-1:6d}", f"{55:6d}", *["NONE"] * 5]
        lines += ["".join(f"{n:10d}" for n in row) for row in ((1, 2, 2, 8, 2, 3), (2, 4, 1, i))]
        lines.append("".join(f"{x:13.5e}" for x in (hertz, 4.0, 0.01, 0.0)))
        for node, z in zip((3, 8), along, strict=True):
            lines += [f"{node:10d}", "".join(f"{x:13.5e}" for x in (0.0, 0.0, z))]
        lines.append(f"{-1:6d}")
    values = spring(HERTZ)
    for node in (8, 3):
        lines += [f"{-1:6d}", f"{58:6d}", *["NONE"] * 5]
        lines.append(f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{3:4d} {'NONE':10s}{8:10d}{3:4d}")
        lines.append(f"{5:10d}{HERTZ.size:10d}{1:10d}{HERTZ[0]:13.5e}{25.0:13.5e}{0.0:13.5e}")
        lines += [f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}" for code in (18, 11, 13, 0)]
        pairs = np.stack([values.real, values.imag], axis=1).ravel()
        lines += ["".join(f"{x:13.5e}" for x in pairs[k : k + 6]) for k in range(0, pairs.size, 6)]
        lines.append(f"{-1:6d}")
    Path(path).write_text("\n".join([*lines, ""]))
    body = hl.from_modes(path, hl.PTFE, node=8, residual_flexibility=0.0)
    np.testing.assert_allclose(body.contact, [2.0, 3.0])  # 4/√4 and 6/√4
    np.testing.assert_allclose(np.sqrt(body.stiffness.diagonal()) / (2.0 * np.pi), [900.0, 2500.0])
    np.testing.assert_allclose(body.damping.diagonal(), 0.02 * 2.0 * np.pi * np.array([900.0, 2500.0]))
    measured = hl.from_frequency_response(path, hl.PTFE)
    assert measured.contact.max() ** -2 == pytest.approx(0.0141, rel=1e-2)
    with pytest.raises(ValueError, match="has no node 9 among its 2"):
        hl.from_modes(path, hl.PTFE, node=9)


def test_nastran_modes_are_divided_by_their_masses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A double of pyNastran gives what its reader gives of a file of NORM=MAX, whose masses are not 1."""
    folder = tmp_path / "pyNastran" / "op2"
    folder.mkdir(parents=True)
    for package in (folder.parent, folder):
        (package / "__init__.py").touch()  # else the true one, where it is installed, would come first
    (folder / "op2.py").write_text(
        "from types import SimpleNamespace as Table\n"
        "import numpy as np\n"
        "shapes = np.zeros((2, 2, 6))\n"
        "shapes[:, 1, 2] = 1.0, -0.5\n"
        "def read_op2(*_, **__):\n"
        "    square, nodes = (2.0 * np.pi * np.array([900.0, 2500.0])) ** 2, np.array([[1, 1], [8, 1]])\n"
        "    vectors = Table(eigns=square, node_gridtype=nodes, data=shapes, modes=[1, 3])\n"
        "    table = Table(mode=np.array([1, 2, 3]), generalized_mass=np.array([0.04, 1.0, 0.25]))\n"
        "    return Table(eigenvectors={1: vectors}, eigenvalues={'modes': table})\n"
    )
    (tmp_path / "modes.op2").touch()
    monkeypatch.syspath_prepend(tmp_path)
    body = hl.from_modes(tmp_path / "modes.op2", hl.PTFE, node=8, residual_flexibility=0.0)
    np.testing.assert_allclose(body.contact, [5.0, -1.0])  # 1/√0.04 and −0.5/√0.25
    np.testing.assert_allclose(np.sqrt(body.stiffness.diagonal()) / (2.0 * np.pi), [900.0, 2500.0])


@pytest.mark.thorough
def test_ansys_results_of_its_reader() -> None:
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    beam = hl.from_modes(examples.rstfile, hl.STEEL_316, node=25, residual_flexibility=0.0)
    hertz = np.sqrt(beam.stiffness.diagonal()) / (2.0 * np.pi)
    # The times that its manual prints for this file, Hz.
    np.testing.assert_allclose(hertz[:3], [7366.49503969, 7366.49503969, 11504.89523664], rtol=1e-9)
    # The sixth is the first longitudinal mode of the free bar, 1 × 1 × 5, struck at an end: c/2l, and √(2/m).
    modulus, density, length = 16.9e6, 4.1408e-4, 5.0
    assert hertz[5] == pytest.approx(np.sqrt(modulus / density) / (2.0 * length), rel=5e-3)
    assert abs(beam.contact[5]) == pytest.approx(np.sqrt(2.0 / (density * length)), rel=0.015)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "holds no line of numbers"),
        ("a.csv", b"900, 1.0, 0.01, 3\n", "has 4 columns of numbers: must be frequency, shape, damping ratio"),
        ("a.csv", b"-900, 1.0\n", "must be zero or a positive number"),
        ("a.frd", b"\x00" * 9, "holds no displacements of modes"),
        ("a.frd", b" -4  DISP        4    1\n", "holds no displacements of modes"),
        ("a.frd", b"  100CL  101 x          8   MODAL\n -4  DISP\n", "is damaged near"),
        ("a.frd", (DATA / "one_cell.frd").read_bytes().replace(b" -1         1", b" -1         2"), "has no node 1 in"),
        ("a.uff", b"    -1\n    55\nrubbish\n    -1\n", "cannot be read as a .uff file|needs pyuff"),
        ("a.op2", b"\x00" * 9, "cannot be read as a .op2 file|needs pyNastran"),
        ("a.png", b"", "must be one of .csv"),
    ],
)
def test_bad_files_of_modes_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message) as caught:
        hl.from_modes(tmp_path / name, hl.PTFE, node=None if name == "a.csv" else 1, residual_flexibility=0.0)
    assert "\n" not in str(caught.value)
