"""Derivatives of AR and TOF, uncertainty budgets, and what users get wrong."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import hertzlink as hl
from coupling.results.findings import kind
from structures.caution import HertzlinkWarning, collected

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
MODULUS, SPEED = 3e9, 0.3


def build(modulus=MODULUS, impact_speed=SPEED):
    """Return a chain on a half-space: Hertz's law alone, so that all times scale with v^(−1/5)."""
    wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    return hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, impact_speed), wall)


@pytest.fixture(scope="module")
def change():
    return hl.sensitivities(build, until=7e-4, sensors=[6, 8], modulus=MODULUS, impact_speed=SPEED)


def test_times_scale_with_the_speed_as_dimensional_analysis_says(change):
    by_speed = change.sel(parameter="impact_speed")
    expected = -change.time_of_flight / (5.0 * SPEED)
    assert by_speed.time_of_flight_derivative.values == pytest.approx(expected.values, rel=1e-3)
    assert abs(by_speed.amplitude_ratio_derivative * SPEED).max() < 1e-4
    # F = v^1.2 f(t v^0.2), so dF/dv = (1.2 F + 0.2 t dF/dt) / v at each time.
    force, time = change.contact_force.values, change.time.values
    slope = (1.2 * force + 0.2 * time[:, None] * CubicSpline(time, force)(time, 1)) / SPEED
    # A spline does not follow the corner of F″ where a contact opens.
    assert abs(by_speed.contact_force_derivative.values - slope).max() < 1e-2 * abs(slope).max()


def test_derivatives_are_those_of_the_run_itself(change):
    run = build().run(until=7e-4, sensors=[6, 8])
    assert (change.contact_force == run.contact_force).all()
    assert change.attrs["input"] == run.attrs["input"]
    assert change.amplitude_ratio.values == pytest.approx(
        [float(hl.amplitude_ratio(run, n)) for n in (6, 8)], rel=1e-12
    )
    step = 1e-3 * MODULUS
    ends = [build(modulus=MODULUS + sign * step).run(until=7e-4, sensors=[8]) for sign in (1.0, -1.0)]
    slope = (float(hl.time_of_flight(ends[0], 8)) - float(hl.time_of_flight(ends[1], 8))) / (2.0 * step)
    assert float(change.time_of_flight_derivative.sel(parameter="modulus", sensor=8)) == pytest.approx(slope, rel=1e-3)


def test_a_measure_of_the_users_own_and_its_units():
    change = hl.sensitivities(
        build,
        7e-4,
        [6],
        measure=lambda runs: runs.contact_force.max(("time", "contact"), keep_attrs=True).rename("peak"),
        modulus=MODULUS,
    )
    assert change.peak_derivative.attrs["units"] == "N per unit of the parameter"
    assert change.contact_force_derivative.attrs["units"] == "N per unit of the parameter"
    assert change.peak_derivative.dims == ("parameter",)
    unnamed = hl.uncertainty(
        build, 7e-4, 6, measure=lambda runs: runs.contact_force.max(("time", "contact")), modulus="1 %"
    )
    assert list(unnamed.value) == ["measure"]


KINKS = {
    "a kink": lambda modulus: build(modulus + 0.5 * abs(modulus - MODULUS)),
    "an even kink": lambda modulus: build(MODULUS + abs(modulus - MODULUS)),
    "a jump": lambda modulus: build(modulus * (1.0 if modulus <= MODULUS else 1.001)),
    "chance": lambda modulus: build(modulus * (1.0 + 1e-3 * CHANCE.random())),
}
CHANCE = np.random.default_rng(5)


@pytest.mark.parametrize("name", KINKS)
def test_a_function_without_a_derivative_is_named(name):
    with pytest.warns(HertzlinkWarning, match="modulus: has no derivative here"):
        hl.sensitivities(KINKS[name], 5e-4, [11], modulus=MODULUS)


def test_a_parameter_without_effect_is_named():
    with pytest.warns(HertzlinkWarning, match="unused: changes nothing in this run"):
        hl.sensitivities(lambda unused, modulus: build(modulus), 3e-4, [6], unused=1.0, modulus=MODULUS)


def clamped_at_left(y=0.1, depth=3e-3):
    """Return a chain at half the width, on the line of symmetry of the plate of docs/identification.md."""
    plate = hl.kirchhoff_plate(0.2, 0.2, depth, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), cells=(28, 28))
    return hl.CoSimulation(hl.Chain([BEAD] * 8, BEAD, SPEED), hl.reduce(plate.at(0.05, y), until=1e-3))


def test_a_derivative_that_vanishes_by_symmetry_is_no_doubt():
    """AR(y) is even about half the width."""
    with collected() as said:
        change = hl.sensitivities(clamped_at_left, 4e-4, [5], y=0.1)
    assert not [finding for finding in said if finding.startswith("y: ")]
    assert abs(change.contact_force_derivative * 0.1).max() < 1e-5 * change.contact_force.max()


WRONG = [
    ({}, "parameters: name at least one argument of build"),
    ({"thickness": 1.0}, "takes modulus, impact_speed, but the parameters are thickness"),
    ({"modulus": 0.0}, "modulus = 0: must not be zero"),
    ({"modulus": float("nan")}, "modulus = nan"),
    ({"modulus": "3 GPa"}, "modulus"),
    ({"modulus": MODULUS, "until": -1.0}, "until = -1.0"),
    ({"modulus": MODULUS, "sensors": [40]}, r"sensors = \[40\]: must be beads from 1 to 12"),
    ({"modulus": MODULUS, "sensors": [True]}, "sensors = True: must be a whole number, 1 or more"),
    ({"modulus": MODULUS, "measure": 3}, "measure"),
    ({"modulus": MODULUS, "measure": lambda runs: runs}, "a name that a run does not use"),
    ({"modulus": MODULUS, "measure": lambda runs: runs.contact_force.max()}, r"measure\(runs\): has the dimensions"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG)
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        hl.sensitivities(build, **({"until": 2e-4, "sensors": [6]} | arguments))


class Wall:
    """A participant of the user's own."""

    surface = hl.Surface(hl.PTFE)

    def start(self):
        return 0.0

    def advance(self, state, force, window):
        return state, 0.0


def with_more_beads(speed):
    return hl.CoSimulation(hl.Chain([BEAD] * (12 if speed > SPEED else 11), BEAD, speed), hl.half_space(hl.PTFE))


NONE = [
    (lambda speed: build(impact_speed=speed).replace(window=hl.Adaptive(1e-4)), "it needs Condensed"),
    (lambda speed: build(impact_speed=speed).replace(structure=Wall(), scheme=hl.Aitken()), "has no derivatives"),
    (lambda speed: build, "must be a CoSimulation"),
    (with_more_beads, "speed: build fails at .*has another number of beads than"),
    (
        lambda speed: build() if speed == SPEED else 1 / 0,
        r"speed: build fails at 0\.3 ± 0\.0001 %, where a difference needs it: .*division by zero",
    ),
]


@pytest.mark.parametrize(("make", "message"), NONE)
def test_runs_without_derivatives_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        hl.sensitivities(make, 2e-4, [6], speed=SPEED)


def test_a_budget_adds_squares_and_agrees_with_sampling():
    budget = hl.uncertainty(build, 7e-4, 6, draws=200, modulus="5 %", impact_speed="10 mm/s")
    # TOF ∝ v^(−1/5): by the speed alone its uncertainty is a fifth of the speed's, relative.
    by_speed = budget.value["time_of_flight"] * 0.01 / SPEED / 5.0
    share = budget.shares["impact_speed"]["time_of_flight"]
    assert share * budget.standard["time_of_flight"] ** 2 == pytest.approx(by_speed**2, rel=1e-3)
    assert sum(shares["time_of_flight"] for shares in budget.shares.values()) == pytest.approx(1.0)
    # The standard deviation of 200 draws has a standard error of 5 %.
    assert budget.sampled["time_of_flight"][1] == pytest.approx(budget.standard["time_of_flight"], rel=0.15)
    times = budget.samples["time_of_flight"]
    assert times.shape == (200,)
    assert budget.sampled["time_of_flight"] == (times.mean(), times.std(ddof=1))
    assert "time_of_flight = " in str(budget)
    assert max(map(len, str(budget).splitlines())) <= 80


@pytest.mark.parametrize("draws", [0, 3])
def test_a_budget_says_once_what_the_user_must_know(draws):
    """A fast striker makes contacts yield; bead 11 of 12 is too near the wall."""
    with collected() as said:
        budget = hl.uncertainty(lambda speed=1.5: build(MODULUS, speed), 4e-4, 11, draws=draws, speed="10 %")
    assert [finding.split(":")[0] for finding in said].count("yield") == 1
    assert [kind(finding) for finding in said] == [*dict.fromkeys(map(kind, said))]
    assert set(said) == set(budget.warnings)
    assert len(said) == len(budget.warnings)


SPREADS = [
    ({}, "parameters: name at least one argument of build"),
    ({"thickness": "1 %"}, "takes modulus, impact_speed, but the parameters are thickness"),
    ({"modulus": "-1 %"}, "modulus = '-1 %': must be a standard uncertainty"),
    ({"modulus": "much"}, "modulus = 'much': must be a standard uncertainty"),
    ({"modulus": 0.0}, "modulus = 0.0"),
    ({"modulus": "1 degC"}, "modulus = '1 degC'"),
    ({"modulus": "1 %", "draws": -1}, "draws = -1"),
    ({"modulus": "1 %", "draws": 1}, "draws = 1"),
    ({"modulus": "1 %", "seed": -1}, "seed = -1"),
    ({"modulus": "1 %", "seed": "x"}, "seed = 'x': must be a whole number, 0 or more"),
    ({"modulus": "1 %", "draws": "10"}, "draws = '10': must be a whole number, 0 or more"),
    ({"modulus": "1 %", "sensor": [4]}, r"sensor = \[4\]: must be a whole number, 1 or more"),
    ({"modulus": "1 %", "sensor": 1e200}, "sensor = 1e[+]200: must be a whole number, 1 or more"),
]


@pytest.mark.parametrize(("arguments", "message"), SPREADS)
def test_wrong_uncertainties_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        hl.uncertainty(build, 2e-4, **({"sensor": 6} | arguments))


NOT_LINEAR = [
    (3e-4, "20 %", 20, lambda runs: runs.contact_force.isel(contact=0).argmax("time").rename("latest")),
    (3e-4, "20 %", 200, lambda runs: ((runs.contact_force.max(("time", "contact")) / 40.0) ** 5).rename("steep")),
    (7e-4, "2 %", 0, lambda runs: runs.contact_force.isel(contact=0, drop=True).idxmax("time").rename("peak")),
]


@pytest.mark.parametrize(("until", "spread", "draws", "measure"), NOT_LINEAR)
def test_a_measure_that_is_not_linear_is_named(until, spread, draws, measure):
    """A measure in steps has the derivative zero."""
    with pytest.warns(HertzlinkWarning, match="is not linear over these uncertainties, or moves in steps; runs over"):
        hl.uncertainty(build, until, 6, measure=measure, draws=draws, impact_speed=spread)


def test_a_budget_at_an_extremum_is_of_second_order():
    """F ∝ v^(6/5): 10 % of v makes (F/F₀ − 1)² = 0.0144 z², whose standard deviation is √2 times 0.0144."""
    greatest = float(build().run(3e-4, sensors=[6]).contact_force.max())

    def least(runs):
        return (1.0 + (runs.contact_force.max(("time", "contact")) / greatest - 1.0) ** 2).rename("least")

    with pytest.warns(HertzlinkWarning, match="least: is not linear .* standard uncertainty 0.02 N, and"):
        hl.uncertainty(build, 3e-4, 6, measure=least, impact_speed="10 %")


def test_an_uncertainty_beyond_what_can_be_run_is_named():
    with pytest.warns(HertzlinkWarning, match="amplitude_ratio: 1 of 2 runs at the ends of the uncertainties failed"):
        hl.uncertainty(build, 7e-4, 6, modulus="200 %")


@pytest.mark.thorough
def test_derivatives_follow_the_times_at_which_dashpots_begin():
    """AR depends on c v^(−1/5) m^(−3/5) k^(−2/5) alone, with m ∝ R³ and k ∝ √R, though forces jump."""

    def build(coefficient, speed, radius):
        bead = hl.Sphere(radius, hl.STEEL_440C)
        chain = hl.Chain([bead] * 12, bead, speed, dissipation=hl.LinearDashpot(coefficient))
        return hl.CoSimulation(chain, hl.half_space(hl.PTFE))

    values = {"coefficient": 5.0, "speed": 0.3, "radius": 4.76e-3}
    slopes = hl.sensitivities(build, 9e-4, [6], **values).amplitude_ratio_derivative
    relative = {name: float(slopes.sel(parameter=name).squeeze()) * value for name, value in values.items()}
    assert relative["coefficient"] < -0.2
    assert relative["speed"] == pytest.approx(-relative["coefficient"] / 5.0, rel=0.03)
    assert relative["radius"] == pytest.approx(-2.0 * relative["coefficient"], rel=0.03)


def test_a_drag_does_not_jump():
    chain = hl.Chain([BEAD] * 12, BEAD, SPEED, dissipation=hl.MassProportional(100.0))
    change = hl.sensitivities(lambda dt: hl.CoSimulation(chain, None, dt=dt), 1e-4, [6], dt=1e-8)
    assert "dissipation: " not in change.attrs["warnings"]


def nothing_behind(impact_speed=SPEED):
    return hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, impact_speed), None)


@pytest.mark.parametrize(
    ("make", "until", "reason"),
    [
        (build, 2e-4, "there is no primary wave: the record ends at 200 µs, .* until = .* would hold it"),
        (nothing_behind, 7e-4, "there is no primary wave: there is no structure, or nothing pushes it within the"),
        (build, 1e-5, "there is no incident wave: no wave runs over bead 6"),
    ],
)
def test_a_budget_without_a_wave_says_why(make, until, reason):
    """A chain with a free end sends nothing back: its last bead flies off with the pulse."""
    with pytest.warns(HertzlinkWarning, match=f"^amplitude_ratio, time_of_flight: no value; {reason}"):
        budget = hl.uncertainty(make, until, 6, impact_speed="2 %")
    assert str(budget).startswith("amplitude_ratio = no value\ntime_of_flight = no value\nnote: ")
    assert "nan" not in str(budget)
