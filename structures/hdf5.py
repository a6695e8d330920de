"""Whether an HDF5 file is complete in itself: HDF5 can make a file read others, and load programs to decode it."""

from io import BytesIO
from pathlib import Path
from typing import Any

LARGEST_RATIO = 1100
"""Numbers over the size of their file: no filter of HDF5 itself packs more densely than this."""

SMALL = 10_000_000
"""Size, bytes, below which no dataset is too large for its file."""

OWN_FILTERS = {1, 2, 3, 4, 5, 6, 32000}
"""Filters that HDF5 and h5py bring along; it loads the program of any other from a folder of plugins."""


def check_hdf5(source: str | Path | BytesIO, name: str) -> None:
    """Raises ValueError, which begins with `name`, for a file that leads out of itself or claims too many numbers.

    External links, external storage, virtual datasets and filters from plugins are refused before anything is read.
    """
    import h5py  # type: ignore[import-untyped]

    size = source.getbuffer().nbytes if isinstance(source, BytesIO) else Path(source).stat().st_size
    seen: set[Any] = set()
    try:
        with h5py.File(source, "r") as file:
            groups = [file]
            while groups:
                group = groups.pop()
                for key in group:
                    if isinstance(group.get(key, getlink=True), h5py.SoftLink):
                        continue
                    fault = _fault_of_link(h5py, group, key)
                    one: Any = None if fault else group[key]
                    if isinstance(one, h5py.Dataset):
                        fault = _fault_of_dataset(one, size)
                    if fault:
                        raise ValueError(f"{name}: {group.name.rstrip('/')}/{key} {fault}; it was not read")
                    address = h5py.h5o.get_info(one.id).addr
                    if isinstance(one, h5py.Group) and address not in seen:
                        seen.add(address)
                        groups.append(one)
    except (OSError, RuntimeError, KeyError) as error:
        raise ValueError(f"{name}: is no HDF5 file that can be read ({error})") from error


def _fault_of_link(h5py: Any, group: Any, key: str) -> str:
    link = group.get(key, getlink=True)
    if isinstance(link, h5py.ExternalLink):
        return f"links to another file, {link.filename}"
    return "" if isinstance(link, h5py.HardLink) else "links to another place"


def _fault_of_dataset(dataset: Any, size: int) -> str:
    if dataset.external:
        return f"keeps its numbers in another file, {dataset.external[0][0]}"
    if dataset.is_virtual:
        return "consists of parts of other files"
    plist = dataset.id.get_create_plist()
    filters = {plist.get_filter(i)[0] for i in range(plist.get_nfilters())}
    if not filters <= OWN_FILTERS:
        return f"needs a plugin to be read, filter {min(filters - OWN_FILTERS)}"
    claimed = dataset.size * dataset.dtype.itemsize if dataset.shape is not None else 0
    if claimed > max(SMALL, LARGEST_RATIO * size):
        return f"claims {claimed:.3g} bytes, more than its file can hold"
    return ""
