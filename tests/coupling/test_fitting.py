"""Fitted losses: known values come back from noisy signals, intervals cover them, and what cannot be identified
is reported.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from particles.dissipation import Dissipation

BEAD = hl.Sphere(2.38e-3, hl.STEEL_316)
SENSORS = [9, 16, 24, 31, 40, 50, 56, 63]
CHAIN = hl.Chain([BEAD] * 70, BEAD, 1.77)
SHORTER, NEARER, EARLIER = hl.Chain([BEAD] * 50, BEAD, 1.77), [9, 16, 24, 31, 40, 46], 4.4e-4
"""A chain in which a wave decays enough to tell a coefficient from an exponent; sensors, and the length of runs, s."""


def run_of(loss: Dissipation, chain: hl.Chain = CHAIN, until: float = 6e-4) -> xr.Dataset:
    lossy = hl.Chain(chain.beads, chain.striker, chain.impact_speed, dissipation=loss)
    return hl.CoSimulation(lossy, None).run(until, save_every=2e-7)


def noisy(run: xr.Dataset, seed: int, noise: float = 0.02, sensors: list[int] = SENSORS) -> xr.Dataset:
    """Signals with white noise of a part of the greatest peak."""
    forces = {n: hl.sensor_force(run, n).values for n in sensors}
    spread = noise * max(force.max() for force in forces.values())
    random = np.random.default_rng(seed)
    return hl.as_signal(run.time.values, {n: f + spread * random.standard_normal(f.size) for n, f in forces.items()})


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("loss", "form"),
    [
        (hl.PowerDashpot(6.0, 1.8), "pairwise"),
        pytest.param(hl.PowerDashpot(5.58, 1.81, "thesis"), "thesis", marks=pytest.mark.thorough),
    ],
)
def test_coefficient_and_exponent_come_back(loss: hl.PowerDashpot, form: str) -> None:
    """Exactly from a clean run, to the noise from noisy signals; 95 % intervals hold the truth in most draws."""
    run = run_of(loss, SHORTER, EARLIER)
    clean = hl.fit_dissipation(run, SHORTER, form=form, sensors=NEARER)
    assert isinstance(clean.loss, hl.PowerDashpot)
    assert (clean.loss.coefficient, clean.loss.exponent) == pytest.approx((loss.coefficient, loss.exponent), rel=1e-3)
    assert clean.amplitude_difference < 1e-3
    covered = 0
    for seed in range(2):
        fit = hl.fit_dissipation(noisy(run, seed, sensors=NEARER), SHORTER, form=form)
        assert isinstance(fit.loss, hl.PowerDashpot)
        assert (fit.loss.coefficient, fit.loss.exponent) == pytest.approx((loss.coefficient, loss.exponent), rel=0.08)
        assert fit.identifiable
        assert set(fit.waveform_difference) == set(NEARER)
        pairs = {"coefficient": loss.coefficient, "exponent": loss.exponent}
        covered += sum(low < pairs[name] < high for name, (low, high) in fit.intervals.items())
    assert covered >= 3


@pytest.mark.parametrize("compare", ["pulses", "peaks"])
@pytest.mark.parametrize(
    "loss",
    [hl.LinearDashpot(2.0), hl.MassProportional(6900.0), hl.KuwabaraKono(5e-7), hl.Tsuji(0.1)],
    ids=lambda loss: type(loss).__name__,
)
def test_a_single_parameter_comes_back(loss: Dissipation, compare: str) -> None:
    fit = hl.fit_dissipation(noisy(run_of(loss), 3), CHAIN, type(loss), compare=compare)
    ((name, (low, high)),) = fit.intervals.items()
    truth = getattr(loss, name)
    assert getattr(fit.loss, name) == pytest.approx(truth, rel=0.02)
    # The interval is about as wide as the error: twice it holds the truth, and it is no wider than 10 %.
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    assert abs(middle - truth) < 2.0 * half
    assert half < 0.1 * truth


@hl.described
class Relaxing(hl.Dissipation):
    """A loss of one's own, with a single number."""

    time: Annotated[float, hl.quantities.Quantity("s", "a time", or_zero=True)]
    piece = "tangent"

    def coefficients(self, mass: np.ndarray) -> np.ndarray:
        return np.full_like(mass, self.time)


def test_the_number_of_a_loss_of_ones_own_comes_back() -> None:
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    fit = hl.fit_dissipation(run_of(Relaxing(5e-7), chain, 3e-4), chain, Relaxing, sensors=[7, 12])
    assert isinstance(fit.loss, Relaxing)
    assert fit.loss.time == pytest.approx(5e-7, rel=1e-3)
    assert list(fit.intervals) == ["time"]


def test_a_search_warns_once_at_the_users_line() -> None:
    """Of the run with the loss that was found; each of the search's runs yields too."""
    soft = hl.Sphere(4.76e-3, hl.STEEL_316)
    chain = hl.Chain([soft] * 12, soft, 0.3)
    run = run_of(hl.LinearDashpot(2.0), chain, 3e-4)
    with pytest.warns(hl.HertzlinkWarning, match="yield: ") as caught:
        hl.fit_dissipation(run, chain, hl.LinearDashpot, sensors=[4, 8])
    assert [one.filename for one in caught if "yield: " in str(one.message)] == [__file__]


def test_waves_that_come_back_are_not_missed(recwarn: pytest.WarningsRecorder) -> None:
    """The record ends before; the fit needs the incident waves alone."""
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    signal = run_of(hl.LinearDashpot(0.3), chain, 1.5e-4)
    recwarn.clear()
    hl.fit_dissipation(signal, chain, hl.LinearDashpot, sensors=[7, 12])
    assert not [str(one.message) for one in recwarn if "record" in str(one.message)]


def test_a_short_weak_chain_does_not_tell_coefficient_from_exponent() -> None:
    """Two sensors near each other and little loss: the wave hardly decays, and the fit says so."""
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    run = run_of(hl.PowerDashpot(1.0, 1.5), chain, 3e-4)
    fit = hl.fit_dissipation(noisy(run, 1, 0.02, [8, 13]), chain)
    assert not fit.identifiable
    assert "cannot be separated" in fit.note
    low, high = fit.intervals["exponent"]
    assert high - low > 0.5


@pytest.mark.thorough
def test_a_loss_of_another_kind_leaves_a_greater_difference() -> None:
    signals = noisy(run_of(hl.PowerDashpot(6.0, 1.8), SHORTER, EARLIER), 1, 0.005, NEARER)
    right, wrong = (hl.fit_dissipation(signals, SHORTER, law) for law in (hl.PowerDashpot, hl.MassProportional))
    assert wrong.amplitude_difference > 5.0 * right.amplitude_difference


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"law": hl.Restitution}, "law = .*Restitution.*must be one of PowerDashpot, LinearDashpot"),
        ({"law": hl.Sphere}, "law = .*Sphere.*: must be one of PowerDashpot"),
        ({"law": "LinearDashpot"}, "law = 'LinearDashpot': must be one of PowerDashpot"),
        ({"form": "global"}, "form = 'global'"),
        ({"compare": "all"}, "compare = 'all'"),
        ({"sensors": [7]}, r"sensors = \[7\]: must be two or more"),
        ({"sensors": [7, 12], "compare": "peaks"}, r"sensors = \[7, 12\]: must be more than parameters"),
        ({"sensors": None}, "sensors = None: must be given for a run"),
        ({"sensors": [7, 90]}, "sensor = 90: must be a bead from 1 to 20"),
        ({"chain": BEAD}, "chain = Sphere"),
        ({"chain": hl.DeformableChain([BEAD] * 20, BEAD, 0.5)}, "chain = .*: must be a Chain of point masses"),
        ({"signals": 3}, "signals = 3"),
    ],
)
def test_bad_input(keywords: dict[str, object], message: str) -> None:
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    good = {"signals": run_of(hl.LinearDashpot(1.0), chain, 3e-4), "chain": chain, "sensors": [7, 12]}
    with pytest.raises(ValueError, match=message):
        hl.fit_dissipation(**{**good, **keywords})  # type: ignore[arg-type]


def test_a_sensor_without_a_wave() -> None:
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    run = run_of(hl.LinearDashpot(1.0), chain, 5e-5)
    with pytest.raises(ValueError, match="signals: sensor 15 recorded no wave"):
        hl.fit_dissipation(run, chain, hl.LinearDashpot, sensors=[3, 15])


def test_a_vertical_chain_on_a_half_space() -> None:
    """Gravity and preload are the chain's; the wall is there to bear them."""
    wall = hl.half_space(hl.STEEL_316)
    chain = hl.Chain([BEAD] * 40, BEAD, 1.0, gravity=9.81, preload=0.5)
    lossy = replace(chain, dissipation=hl.LinearDashpot(3.0))
    run = hl.CoSimulation(lossy, wall).run(4e-4, save_every=2e-7)
    fit = hl.fit_dissipation(run, chain, hl.LinearDashpot, sensors=[9, 16, 24], structure=wall)
    assert isinstance(fit.loss, hl.LinearDashpot)
    assert fit.loss.coefficient == pytest.approx(3.0, rel=2e-3)


def test_signals_that_cannot_belong_to_the_chain() -> None:
    """A slip of millivolts for volts makes waves a thousand times what the chain can have."""
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    run = run_of(hl.LinearDashpot(1.0), chain, 3e-4)
    loud = hl.as_signal(run.time.values, {n: 1e3 * hl.sensor_force(run, n).values for n in (7, 12)})
    with pytest.raises(
        ValueError, match=r"signals: sensor 7 recorded .* but the chain without losses has .*calibration"
    ):
        hl.fit_dissipation(loud, chain, hl.LinearDashpot)


def test_hardly_a_loss_is_said() -> None:
    chain = hl.Chain([BEAD] * 20, BEAD, 0.5)
    run = hl.CoSimulation(chain, None).run(3e-4, save_every=2e-7)
    fit = hl.fit_dissipation(noisy(run, 1, 0.02, [7, 12]), chain, hl.KuwabaraKono)
    assert not fit.identifiable
    assert "the signals show hardly any loss" in fit.note
    power = hl.fit_dissipation(noisy(run, 1, 0.02, [7, 12]), chain)
    assert not power.identifiable
    low, high = power.intervals["exponent"]
    assert low >= 1.0
    assert high <= 5.0
