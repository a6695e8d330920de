"""Files of results as Datasets, or in one line why a file is none."""

from pathlib import Path

import xarray as xr


def read_netcdf(file: Path) -> xr.Dataset:
    """The Dataset of a netCDF file, in memory; a ValueError that names the file for any other."""
    try:
        with xr.open_dataset(file, engine="h5netcdf") as opened:
            return opened.load()
    except FileNotFoundError:
        raise ValueError(f"{file}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{file}: cannot be read as netCDF ({error})") from error
