"""What studies compute over axes."""

import numpy as np
import pytest
import xarray as xr

from hertzlink.studies.results import each, named, over, scalars


def powers(base: float, exponent: int) -> xr.Dataset:
    return scalars(power=(base**exponent, "m", "a power"))


def test_over_axes_holds_each_combination_in_its_place() -> None:
    """Powers; and what one value of an axis lacks is NaN."""
    data = over(powers, base=[2.0, 3.0, 5.0], exponent=[1, 2])
    assert data.power.dims == ("base", "exponent")
    assert data.power.values.tolist() == [[2.0, 4.0], [3.0, 9.0], [5.0, 25.0]]
    assert data.power.sel(base=3.0, exponent=2).item() == 9.0
    assert data.power.attrs == {"units": "m", "long_name": "a power"}
    lengths = over(lambda count: xr.Dataset({"part": ("place", np.ones(count))}, {"place": range(count)}), count=[1, 2])
    assert np.isnan(lengths.part.sel(count=1, place=1))
    assert set(named(data, "of").data_vars) == {"of_power"}


def test_each_refuses_no_processes() -> None:
    with pytest.raises(ValueError, match="jobs = 0"):
        each(powers, [{"base": 2.0, "exponent": 1}], 0)
