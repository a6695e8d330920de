"""Files that a user names: results as Datasets, and text, or in one line why they are none."""

import errno
import os
import stat
from pathlib import Path

import h5py  # type: ignore[import-untyped]
import xarray as xr

from structures.meshes.hdf5 import check_hdf5

NOT_TO_READ = ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError
"""What readers of netCDF raise for files that hold something else."""


def read_netcdf(file: Path) -> xr.Dataset:
    """Return the Dataset of a netCDF file, in memory; raise a ValueError that names the file for any other.

    What leads out of the file, or claims more than it can hold, is refused before it is read.
    """
    if not file.exists():
        raise ValueError(f"{file}: there is no such file")
    if not file.is_file():
        raise ValueError(f"{file}: is no file; give a netCDF file such as results.nc")
    if not h5py.is_hdf5(file):
        raise ValueError(f"{file}: cannot be read as netCDF; it is no file of HDF5, on which netCDF 4 is built")
    check_hdf5(file, str(file))
    try:
        with xr.open_dataset(file, engine="h5netcdf") as opened:
            return opened.load()
    except NOT_TO_READ as error:
        raise ValueError(f"{file}: cannot be read as netCDF ({error})") from error


def read_text(path: str | Path, most: int) -> str | None:
    """Return the text of a file, or of a pipe; None where it has more than `most` bytes. Raises OSError,
    UnicodeDecodeError.

    A device that has nothing to give is not awaited.
    """
    pipe = stat.S_ISFIFO(os.stat(path).st_mode)
    handle = os.open(path, os.O_RDONLY | (0 if pipe else getattr(os, "O_NONBLOCK", 0)))
    with os.fdopen(handle, "rb") as file:
        data = file.read(most + 1)
    if data is None:
        raise BlockingIOError(errno.EAGAIN, "it has nothing to give")
    return None if len(data) > most else data.decode("utf-8-sig")
