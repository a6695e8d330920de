"""The study of thin plates' centres compared with Zener's theory and with the chain on the exact point impedance."""

import numpy as np
import pytest
import xarray as xr
from printed import check

import hertzlink as hl
from hertzlink.studies import aspect_ratio
from plates.impact import THESIS_IMPACT

THOROUGH_FIXTURES = ("data",)


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return aspect_ratio.run(quick=True)


def by_ratio(data: xr.Dataset) -> list[tuple[float, xr.DataArray]]:
    pairs = [(d, t) for d in data.diameter.values for t in data.thickness.values]
    return [(d / t, data.amplitude_ratio.sel(diameter=d, thickness=t)) for d, t in pairs]


def test_amplitude_ratio_is_that_of_zeners_restitution(data: xr.Dataset) -> None:
    """Within 0.04 of e^(6/5) below D/t = 4, with the striker's speed; negligible above 5 (section 6.2.1)."""
    for ratio, found in by_ratio(data):
        plate = float(found.sel(body="plate").fillna(0.0))
        if ratio < 4.0:
            assert plate == pytest.approx(aspect_ratio.theory(ratio, 0.31)[0], abs=0.04)
        if ratio > 5.0:
            assert plate < 0.02


def test_a_plate_whose_echoes_come_too_late_is_infinite(data: xr.Dataset) -> None:
    """The chain on 8 √(Dρt): within 0.002 on 0.914 m, and the same chain on a half-space keeps far more."""
    for ratio, found in by_ratio(data):
        plate, infinite, thick = (found.sel(body=body).fillna(0.0).item() for body in aspect_ratio.BODIES)
        assert plate == pytest.approx(infinite, abs=0.002)
        assert thick > 0.97
        assert infinite < thick - 0.1 or ratio < 0.9


def test_contact_times_of_the_thesis() -> None:
    """59.1, 87.81, 164.4, 1435.2 µs, each by Zener's τ_c from a λ that rounds to the printed one, at 0.31 m/s."""
    for diameter, thickness, parameter, expected in (
        (9.53e-3, 4.83e-3, 0.29, 59.1),
        (9.53e-3, 2.29e-3, 1.28, 87.81),
        (19.1e-3, 4.83e-3, 1.158, 164.4),
        (19.1e-3, 2.29e-3, 5.1548, 1435.2),
    ):
        bead = hl.Sphere(diameter / 2.0, THESIS_IMPACT.material)
        plate = aspect_ratio.plate(thickness)
        found = hl.theory.PlateImpact(bead, plate, THESIS_IMPACT.striker_speed, parameter).contact_time * 1e6
        assert found == pytest.approx(expected, rel=1e-3)


def test_amplitudes_and_flights_are_compared_with_theory_and_not_with_the_thesis(data: xr.Dataset) -> None:
    """Figures 6.18 and 6.19 have no numbers in the text."""
    rows = [row for row in aspect_ratio.table(data) if row.quantity.startswith(("AR, ", "TOF/D, "))]
    assert len(rows) == 18
    assert all(row.thesis == "" and isinstance(row.theory, float) for row in rows)


def test_table_and_figures(data: xr.Dataset) -> None:
    rows = aspect_ratio.table(data)
    check("aspect-ratio", rows)
    assert any("8000 kg/m³" in row.reason for row in rows)
    figures = aspect_ratio.figures(data)
    assert set(figures) == {"amplitude_ratio", "time_of_flight", "forces"}
    points = [line for line in figures["amplitude_ratio"].axes[0].lines if line.get_linestyle() == "None"]
    crosses = [line for line in points if line.get_marker() == "x"]
    missing = data.amplitude_ratio.sel(body="plate").isnull()
    assert sum(len(line.get_xdata()) for line in crosses) == int(missing.sum())
    assert all(np.isfinite(line.get_xdata()).all() for line in points)
    shown = {float(y) for line in points if line not in crosses for y in line.get_ydata() if np.isfinite(y)}
    assert 0.0 not in shown
