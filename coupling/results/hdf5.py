"""Checks of HDF5 files. HDF5 lets a file read other files, and load programs to decode it; such files are refused."""

from io import BytesIO
from pathlib import Path
from typing import Any

import xarray as xr

from structures.checks import existing

# Largest size of the numbers over that of their file, as no filter of HDF5 packs more densely; and a size, in bytes,
# that is always allowed.
LARGEST_RATIO, SMALL = 1100, 10_000_000

# The filters of HDF5 and h5py. For any other one HDF5 would load a program from a folder of plugins.
OWN_FILTERS = {1, 2, 3, 4, 5, 6, 32000}


def check_hdf5(source: str | Path | BytesIO, name: str) -> None:
    """Raise a ValueError, which begins with `name`, for a file that reads other files or claims too many numbers."""
    import h5py  # type: ignore[import-untyped]  # here, because most runs do not read a file

    def fault_of(place: str, link: Any) -> str | None:
        if isinstance(link, h5py.ExternalLink):
            return f"/{place} links to another file, {link.filename}"
        item = file[place] if isinstance(link, h5py.HardLink) else None
        if not isinstance(item, h5py.Dataset):
            return None
        plist = item.id.get_create_plist()
        strange = {plist.get_filter(i)[0] for i in range(plist.get_nfilters())} - OWN_FILTERS
        if item.external:
            return f"/{place} keeps its numbers in another file, {item.external[0][0]}"
        if item.is_virtual:
            return f"/{place} consists of parts of other files"
        if strange:
            return f"/{place} needs a plugin to be read, filter {min(strange)}"
        if item.size is not None and item.size * item.dtype.itemsize > max(SMALL, LARGEST_RATIO * size):
            return f"/{place} claims {item.size * item.dtype.itemsize:.3g} bytes, more than its file can hold"
        return None

    size = source.getbuffer().nbytes if isinstance(source, BytesIO) else Path(source).stat().st_size
    try:
        with h5py.File(source, "r") as file:
            fault = file.visititems_links(fault_of)
    except (OSError, RuntimeError, KeyError, TypeError, UnicodeDecodeError) as error:
        raise ValueError(f"{name}: is not an HDF5 file that can be read ({error})") from error
    if fault:
        raise ValueError(f"{name}: {fault}; it was not read")


def read_netcdf(file: Path) -> xr.Dataset:
    """Return the Dataset of a netCDF file, in memory; raise a ValueError that names the file if it cannot be read. A
    file that reads other files, or claims more than it can hold, is refused before it is read."""
    check_hdf5(existing(str(file), file), str(file))
    try:
        return xr.load_dataset(file, engine="h5netcdf")
    except (AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError) as error:
        raise ValueError(f"{file}: cannot be read as netCDF ({error})") from error
