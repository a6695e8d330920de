"""Whether an HDF5 file is complete in itself: HDF5 can make a file read others, and load programs to decode it."""

from collections.abc import Iterator
from io import BytesIO
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

LARGEST_RATIO = 1100
"""Numbers over the size of their file: no filter of HDF5 itself packs more densely than this."""

SMALL = 10_000_000
"""Size, bytes, below which no dataset is too large for its file."""

OWN_FILTERS = {1, 2, 3, 4, 5, 6, 32000}
"""Filters that HDF5 and h5py bring along; it loads the program of any other from a folder of plugins."""


def check_hdf5(source: str | Path | BytesIO, name: str) -> None:
    """Raises ValueError, which begins with `name`, for a file that leads out of itself or claims too many numbers.

    External links, external storage, virtual datasets and filters from plugins are refused before anything is read.
    What several names share counts for each of them, as a reader takes it as often.
    """
    import h5py  # type: ignore[import-untyped]

    size = source.getbuffer().nbytes if isinstance(source, BytesIO) else Path(source).stat().st_size
    try:
        with h5py.File(source, "r") as file:
            limit = left = float(max(SMALL, LARGEST_RATIO * size))
            for path, member in _members(h5py, file, name):
                fault = _fault_of_dataset(member) if isinstance(member, h5py.Dataset) else ""
                claimed = 0.0 if fault else _claimed(h5py, member, size, left)
                left -= claimed
                if left < 0.0:
                    fault = f"claims {claimed:.3g} bytes, more than its file can hold{' in all' * (claimed < limit)}"
                if fault:
                    raise ValueError(f"{name}: {path} {fault}; it was not read")
    except (OSError, RuntimeError, KeyError, TypeError, UnicodeDecodeError) as error:
        raise ValueError(f"{name}: is no HDF5 file that can be read ({error})") from error


def _members(h5py: Any, file: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yield all groups and datasets with their paths, those behind soft links last: these may lead through others."""
    seen: set[Any] = set()
    groups, soft = [("", file)], []
    yield "/", file
    while groups:
        path, group = groups.pop()
        for key in group:
            link, place = group.get(key, getlink=True), f"{path}/{key}"
            if isinstance(link, h5py.SoftLink):
                soft.append((place, group, key))
                continue
            if not isinstance(link, h5py.HardLink):
                where = f"another file, {link.filename}" if isinstance(link, h5py.ExternalLink) else "another place"
                raise ValueError(f"{name}: {place} links to {where}; it was not read")
            member = group[key]
            address = h5py.h5o.get_info(member.id).addr
            if isinstance(member, h5py.Group) and address not in seen:
                groups.append((place, member))
            if isinstance(member, h5py.Dataset) or address not in seen:
                yield place, member
            seen.add(address)
    for place, group, key in soft:
        member = group.get(key)
        if isinstance(member, h5py.Dataset):
            yield place, member


def _fault_of_dataset(dataset: Any) -> str:
    if dataset.external:
        return f"keeps its numbers in another file, {dataset.external[0][0]}"
    if dataset.is_virtual:
        return "consists of parts of other files"
    plist = dataset.id.get_create_plist()
    filters = {plist.get_filter(i)[0] for i in range(plist.get_nfilters())}
    if not filters <= OWN_FILTERS:
        return f"needs a plugin to be read, filter {min(filters - OWN_FILTERS)}"
    return ""


def _claimed(h5py: Any, item: Any, size: int, left: float) -> float:
    """Return the bytes that a dataset or a group takes in memory with its attributes. size: of the file; left: where it
    matters.

    Entries of texts and ragged arrays may share their bytes in the file, and each gets a copy of them.
    """
    claimed = 0.0
    for name in item.attrs:
        attribute = item.attrs.get_id(name)
        if attribute.dtype.hasobject:
            most = prod(attribute.shape or ()) * size
            claimed += most if most > left else _bytes(item.attrs[name])
    if not isinstance(item, h5py.Dataset) or item.shape is None:
        return claimed
    claimed += item.size * item.dtype.itemsize
    if item.dtype.hasobject and claimed <= left:
        rows = item.shape[0] if item.ndim else 1
        many = max(1, SMALL * rows // max(1, item.size * size))
        for begin in range(0, rows, many):
            claimed += _bytes(item[begin : begin + many] if item.ndim else item[()])
            if claimed > left:
                break
    return float(claimed)


def _bytes(value: Any) -> float:
    """Return the bytes of a text, or of an array of texts, of ragged rows or of numbers."""
    if isinstance(value, np.ndarray):
        return float(sum(map(_bytes, value.flat)) if value.dtype.hasobject else value.nbytes)
    return len(value) if isinstance(value, str | bytes) else 0
