"""Runs whose quantities vary as arrays: the same numbers as one run at a time, and errors that name the quantity."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from coupling.sweeps import family
from coupling.sweeps.varied import Varied

BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
PLATE = hl.kirchhoff_plate(0.2, 0.2, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
SMALL = hl.reduce(PLATE.at(0.02, 0.1), until=1.2e-3)
UNTIL = 6e-4


def tap(loss: Any = None, beads: int = 8, structure: Any = SMALL, **more: Any) -> hl.CoSimulation:
    """A chain on a small plate."""
    chain = hl.Chain([BEAD] * beads, BEAD, 0.3, dissipation=loss)
    return hl.CoSimulation(chain, structure, accuracy="screening", **more)


def quantities(runs: int, *names: str) -> dict[str, Any]:
    """Values of some quantities, or of all."""
    draw = np.random.default_rng(5).uniform
    all_of_them = {
        "chain.impact_speed": draw(0.2, 0.4, runs),
        "chain.bead.radius": draw(4e-3, 5e-3, runs),
        "chain.bead.material.youngs_modulus": draw(1.8e11, 2.2e11, runs),
        "chain.beads[3].material.density": draw(7000.0, 8000.0, runs),
        "structure.thickness": draw(2e-3, 2.4e-3, runs),
        "structure.material.youngs_modulus": draw(6e10, 8e10, runs),
        "structure.material.density": draw(2600.0, 2800.0, runs),
    }
    return {name: column for name, column in all_of_them.items() if name in names or not names}


FEW = "chain.impact_speed", "chain.bead.radius", "structure.thickness"
"""Quantities of few corners."""

LOSSES = (
    None,
    hl.LinearDashpot(3.0),
    hl.PowerDashpot(5.58, 1.81, "thesis"),
    hl.MassProportional(100.0),
    hl.KuwabaraKono(1e-6),
    hl.Tsuji(0.05),
    hl.Restitution(0.9),
)


@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: type(loss).__name__)
def test_arrays_hold_what_one_run_is_built_of(loss: Any) -> None:
    """Masses, stiffnesses, losses and oscillators of each run are those of the simulation with its values."""
    columns = quantities(5) if loss is None else quantities(5, *FEW)
    if isinstance(loss, hl.Restitution | hl.LinearDashpot):
        columns["chain.dissipation.coefficient"] = np.array([0.8, 0.85, 0.9, 0.8, 0.95])
    varied, window = Varied(tap(loss), columns), 4e-7
    arrays = varied.model(window)
    for run in range(5):
        simulation = varied.at(run)
        chain, oscillators = simulation.chain.model, simulation.structure.window(window)
        pairs = [
            (arrays.stiffness, chain.law.stiffness),
            (arrays.inverse_mass, chain.inverse_mass),
            (arrays.flexibility, chain.springs[1]),
            (arrays.speed, simulation.chain.start().velocity[0]),
            *zip(arrays.structure[:4], oscillators[:4], strict=True),  # type: ignore[index]
        ]
        if loss is not None:
            pairs.append((arrays.coefficient, chain.loss.coefficient))
        for column, value in pairs:
            assert column is not None
            np.testing.assert_allclose(column[..., run], value, rtol=1e-13)


@pytest.mark.parametrize("loss", [None, hl.Restitution(0.9)], ids=["elastic", "loss"])
def test_each_run_is_that_of_its_own_simulation(loss: Any) -> None:
    """In the same windows and steps, forces agree to rounding and AR and TOF with them."""
    columns, simulation = quantities(3, *FEW), tap(loss)
    kept = hl.vary(simulation, UNTIL, columns, sensors=[4], keep="forces")
    waves = hl.vary(simulation, UNTIL, columns, sensors=[4])
    varied = Varied(simulation, columns)
    runs = family.FamilyRuns(varied, UNTIL, float(kept.time[1]), family.kept_at([4], 8), 0, 0.01)
    steps = runs.engine.of_length(runs.engine.length)[1].steps[0, 0]
    window = runs.plan.length
    for run in range(3):
        alone = varied.at(run).replace(window=window, substeps=1, dt=window / steps)
        expected = alone.run(UNTIL, save_every=runs.plan.interval)
        force = expected.contact_force.sel(contact=[4, 5])
        np.testing.assert_allclose(kept.contact_force[run], force, atol=1e-9 * float(force.max()))
        for name, measure in (("amplitude_ratio", hl.amplitude_ratio), ("time_of_flight", hl.time_of_flight)):
            assert float(waves[name][run, 0, 0]) == pytest.approx(float(measure(expected, 4)), rel=1e-9)
        assert float(waves["structure.thickness"][run]) == columns["structure.thickness"][run]


@pytest.mark.usefixtures("cores")
def test_runs_do_not_depend_on_threads_or_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """One thread, three, and parts of two runs give the same bits."""
    columns = quantities(5, "chain.impact_speed", "structure.thickness")
    results = [hl.vary(tap(), UNTIL, columns, sensors=[4], threads=1)]
    results.append(hl.vary(tap(), UNTIL, columns, sensors=[4], threads=3))
    monkeypatch.setattr(family, "MEASURED_AT_ONCE", 1.0)
    results.append(hl.vary(tap(), UNTIL, columns, sensors=[4]))
    for other in results[1:]:
        assert other.drop_attrs().equals(results[0].drop_attrs())


def test_waves_are_those_of_the_forces() -> None:
    """AR, TOF and secondary waves are those that the measures find in the forces of the same runs."""
    columns = quantities(3, "chain.impact_speed")
    forces = hl.vary(tap(), 1e-3, columns, sensors=[3, 5], keep="forces")
    waves = hl.vary(tap(), 1e-3, columns, sensors=[3, 5])
    for sensor in (3, 5):
        for wave in ("primary", "secondary"):
            at = {"sensor": sensor, "wave": wave}
            np.testing.assert_array_equal(waves.amplitude_ratio.sel(at), hl.amplitude_ratio(forces, sensor, wave))
            np.testing.assert_array_equal(waves.time_of_flight.sel(at), hl.time_of_flight(forces, sensor, wave))


def test_run_that_does_not_end_is_done_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that the loop gives up is done in windows that may be halved; what fails then is NaN, with a reason."""
    columns = quantities(3, "chain.impact_speed")
    expected = hl.vary(tap(), UNTIL, columns, sensors=[4])
    real = family.do_runs

    def giving_up(runs: Any, first: int, last: int, *rest: Any) -> None:
        real(runs, first, last, *rest)
        rest[-1][1] = 2

    monkeypatch.setattr(family, "do_runs", giving_up)
    mended = hl.vary(tap(), UNTIL, columns, sensors=[4], threads=1)
    np.testing.assert_allclose(mended.amplitude_ratio, expected.amplitude_ratio, rtol=1e-3)
    monkeypatch.setattr(Varied, "at", lambda *_: tap().replace(window=1.0))
    with pytest.warns(hl.HertzlinkWarning, match="1 of 3 runs failed"):
        failed = hl.vary(tap(), UNTIL, columns, sensors=[4], threads=1)
    assert np.isnan(failed.amplitude_ratio[1]).all()
    assert np.isfinite(failed.amplitude_ratio[[0, 2], 0, 0]).all()
    assert "window" in str(failed.error.values[1])


def test_warnings_come_from_the_corners_of_the_ranges() -> None:
    """Metal that yields in the fastest run is a warning of the result."""
    with pytest.warns(hl.HertzlinkWarning, match="yield"):
        waves = hl.vary(tap(), UNTIL, {"chain.impact_speed": [0.1, 1.0]}, sensors=[4])
    assert "yield" in waves.attrs["warnings"]


@dataclass(frozen=True)
class OwnLoss(hl.Dissipation):
    """A loss of a user's own."""

    piece = "dashpot"

    def coefficients(self, mass: Any) -> Any:
        """Return one number for each mass."""
        return np.full_like(mass, 2.0)


BAD: list[tuple[Any, dict[str, Any], str]] = [
    (tap(), {"quantities": {}}, "quantities = {}: must be values by path"),
    (tap(), {"quantities": [1.0]}, "quantities = "),
    (tap(), {"quantities": {"chain.impact_speed": 0.3}}, "chain.impact_speed: has the shape"),
    (tap(), {"quantities": {"chain.impact_speed": []}}, "chain.impact_speed: has the shape"),
    (tap(), {"quantities": {"chain.impact_speed": ["fast"]}}, "chain.impact_speed = .*: must be numbers"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3, np.nan]}}, "chain.impact_speed: is nan for run 1"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3, -1.0]}}, "chain.impact_speed = -1.0: impact_speed = -1.0"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3], "structure.thickness": [2e-3, 3e-3]}}, "1, .* 2"),
    (tap(), {"quantities": {"chain.impact": [0.3]}}, '"chain.impact" cannot vary'),
    (tap(), {"quantities": {"speed": [0.3]}}, '"speed" cannot vary'),
    (tap(), {"quantities": {"a..b": [0.3]}}, '"a..b" is no path'),
    (tap(), {"quantities": {"structure.length": [0.3]}}, '"structure.length" cannot vary'),
    (tap(), {"quantities": {"chain.beads.radius": [5e-3]}}, '"chain.beads.radius" names no bead'),
    (tap(), {"quantities": {"chain.beads[8].radius": [5e-3]}}, r"chain.beads\[8\].radius.*has 8 beads"),
    (tap(), {"quantities": {"chain.bead.mass": [5e-3]}}, "chain.bead.mass.*Sphere has no mass; it has radius"),
    (tap(), {"quantities": {"chain.bead.radius": [0.0, 5e-3]}}, "chain.bead.radius = 0.0: radius = 0.0"),
    (tap(), {"quantities": {"chain.dissipation.coefficient": [1.0]}}, "chain.dissipation.coefficient = 1.0: NoneType"),
    (tap(OwnLoss()), {"quantities": {"chain.bead.radius": [5e-3]}}, "a loss of your own cannot vary"),
    (tap(structure=hl.half_space(hl.PTFE)), {"quantities": {"structure.thickness": [2e-3]}}, "does not scale"),
    (tap(structure=PLATE.at(0.02, 0.1)), {"quantities": {"structure.thickness": [2e-3]}}, "has no oscillators"),
    (tap(scheme=hl.Aitken()), {"quantities": {"chain.impact_speed": [0.3]}}, "the compiled loop cannot run"),
    (tap(window=hl.Adaptive(1e-4)), {"quantities": {"chain.impact_speed": [0.3]}}, "in equal windows"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3]}, "keep": "all"}, "keep = 'all'"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3]}, "device": "tpu"}, "device = 'tpu'"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3]}, "sensors": [9]}, r"sensors = \[9\]"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3]}, "threads": 0}, "threads = 0"),
    (tap(), {"quantities": {"chain.impact_speed": [0.3]}, "save_every": 1.0}, "save_every = 1.0"),
    ("a tap", {"quantities": {"chain.impact_speed": [0.3]}}, "simulation = 'a tap'"),
]


@pytest.mark.parametrize(("simulation", "arguments", "message"), BAD)
def test_bad_input_names_the_argument(simulation: Any, arguments: dict[str, Any], message: str) -> None:
    """A line that names the quantity or the argument."""
    with pytest.raises(ValueError, match=message) as error:
        hl.vary(simulation, UNTIL, **{"sensors": [4], **arguments})
    assert "\n" not in str(error.value)


def test_bodies_that_differ_are_named_one_by_one() -> None:
    """chain.bead is the bead of a chain of equal ones; cylinders and laws of a user's own need a function."""
    other = hl.Sphere(4e-3, hl.STEEL_316)
    mixed = hl.CoSimulation(hl.Chain([BEAD, other, BEAD], BEAD, 0.3), SMALL)
    with pytest.raises(ValueError, match=r"chain.bead.radius = .*: the beads differ; name one"):
        hl.vary(mixed, UNTIL, {"chain.bead.radius": [5e-3]})
    law = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3, law=hl.laws.PowerLaw(1e10)), SMALL)
    with pytest.raises(ValueError, match="law: of contact 1 does not follow"):
        hl.vary(law, UNTIL, {"chain.bead.radius": [5e-3]})
    hollow = hl.HollowSphere(5e-3, 4e-3, hl.STEEL_316)
    with pytest.raises(ValueError, match="HollowSphere: only Spheres vary"):
        hl.vary(hl.CoSimulation(hl.Chain([hollow] * 3, BEAD, 0.3), SMALL), UNTIL, {"chain.bead.radius": [5e-3]})
    pressed = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3, gravity=9.81), SMALL)
    with pytest.raises(ValueError, match=r"chain.bead.radius: cannot vary where a preload or gravity"):
        hl.vary(pressed, UNTIL, {"chain.bead.radius": [5e-3]})


SIMULATED = Path(__file__).parent / "simulated_gpu.py"


def test_gpu_gives_the_same_numbers_in_the_simulator() -> None:
    """Forces and waves agree to 1e-12, also of a law and a loss of a user's own."""
    pytest.importorskip("numba_cuda")
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    command = [sys.executable, str(SIMULATED)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    differences = dict(line.split() for line in done.stdout.splitlines())
    assert set(differences) == {"forces", "waves", "own"}
    assert all(float(difference) < 1e-12 for difference in differences.values()), differences


def test_without_a_gpu_there_is_one_line() -> None:
    """Neither a missing package nor a missing GPU shows a traceback of another library."""
    with pytest.raises(ValueError, match='device = "gpu": ') as error:
        hl.vary(tap(), UNTIL, {"chain.impact_speed": [0.3]}, device="gpu")
    assert "\n" not in str(error.value)
