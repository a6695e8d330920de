"""The errors of each accuracy, compared with much finer runs."""

import pytest

import hertzlink as hl

BEAD = hl.Sphere(4.765e-3, hl.STEEL_440C)
UNTIL = 1.6e-3


def structures() -> dict[str, hl.Structure]:
    rods = {"steel": hl.Layer(hl.STEEL_440C, 0.1, 9.525e-3), "PTFE": hl.Layer(hl.PTFE, 0.1, 9.525e-3)}
    found = {name: hl.reduce(hl.rod([layer]), until=UNTIL) for name, layer in rods.items()}
    tip = hl.Structure([[BEAD.mass]], [[1e6]], None, [1.0], 0.0, hl.Surface(hl.STEEL_440C))  # type: ignore[arg-type]
    return {**found, "half-space": hl.half_space(hl.PTFE), "light tip": tip}


STRUCTURES = structures()

PROMISED = {"screening": (1e-4, 6e-4, 1e-4), "default": (2e-5, 1e-4, 1e-6), "reference": (2e-6, 1e-5, 1e-7)}
"""Changes of AR, of AR on a light tip, and of energy."""


def ratios(name: str, accuracy: str, **keywords: float) -> tuple[float, float, float]:
    """AR of both waves, and the energy that was created."""
    chain = hl.Chain([BEAD] * 20, BEAD, impact_speed=0.31)
    run = hl.CoSimulation(chain, STRUCTURES[name], accuracy=accuracy, **keywords).run(UNTIL)  # type: ignore[arg-type]
    waves = hl.reflections(run, sensor=10)
    secondary = waves.secondary
    assert secondary is not None
    return (float(waves.primary.amplitude_ratio), float(secondary.amplitude_ratio), float(hl.energy_error(run)))


@pytest.fixture(scope="module")
def finest() -> dict[str, tuple[float, float, float]]:
    """A run with 640 windows and 5 120 steps in a contact."""
    found = {}
    for name, structure in STRUCTURES.items():
        time = hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, 0.31), structure).interface.contact_time
        found[name] = ratios(name, "default", window=time / 640, dt=time / 5120)
    return found


@pytest.mark.parametrize("accuracy", PROMISED)
@pytest.mark.parametrize("name", STRUCTURES)
def test_errors_are_those_that_are_promised(
    name: str, accuracy: str, finest: dict[str, tuple[float, float, float]]
) -> None:
    primary, secondary, energy = ratios(name, accuracy)
    promised, chattering, made = PROMISED[accuracy]
    allowed = chattering if name == "light tip" else promised
    assert abs(primary - finest[name][0]) < allowed
    assert abs(secondary - finest[name][1]) < allowed
    assert energy < made


def test_what_is_given_is_kept() -> None:
    """A given window and dt hold in any accuracy, and the plan is part of a run's input."""
    chain = hl.Chain([BEAD] * 5, BEAD, 0.31)
    plans = [hl.CoSimulation(chain, None, accuracy=name).plan(2e-4) for name in PROMISED]
    assert plans[0].length > 2.0 * plans[1].length > 4.0 * plans[2].length
    own = [hl.CoSimulation(chain, None, window=1e-6, dt=1e-8, accuracy=name) for name in PROMISED]
    assert {one.plan(2e-4).length for one in own} == {1e-6}
    assert {one.chain.steps(1e-6) for one in own} == {100}


def test_an_unknown_accuracy_is_refused() -> None:
    with pytest.raises(ValueError, match="accuracy = 'coarse': must be one of 'default', 'screening'"):
        hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.31), None, accuracy="coarse")
