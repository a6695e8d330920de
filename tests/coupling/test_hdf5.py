"""HDF5 files that are complete in themselves: how many numbers a file of some size may hold."""

from io import BytesIO

import h5py
import numpy as np
import pytest

from coupling.results.hdf5 import check_hdf5

MANY = 12_000_000


def file_with(chunks: bool, count: int) -> BytesIO:
    """A dataset of bytes that are zero: packed, or claimed and never written."""
    content = BytesIO()
    with h5py.File(content, "w") as file:
        packed = file.create_dataset("zeros", (count,), "i1", chunks=(1_000_000,), compression="gzip")
        if chunks:
            packed[:] = 0
    return content


def test_what_is_packed_densely_is_read() -> None:
    content = file_with(True, MANY)
    assert content.getbuffer().nbytes < MANY / 300
    check_hdf5(content, "file")


def test_more_than_a_file_can_hold_is_refused() -> None:
    with pytest.raises(ValueError, match=r"file: /zeros claims 1\.2e\+07 bytes, more than its file can hold"):
        check_hdf5(file_with(False, MANY), "file")


def test_many_texts_of_little_files_are_read() -> None:
    """1 500 attributes of one text each, as results of hundreds of variables have."""
    content = BytesIO()
    with h5py.File(content, "w") as file:
        file.create_dataset("names", data=[f"name {i}" for i in range(2000)], dtype=h5py.string_dtype())
        for number in range(500):
            data = file.create_dataset(f"data{number}", data=np.zeros(3))
            data.attrs.update({"units": "N", "long_name": "force between beads", "note": "x" * 50})
    check_hdf5(content, "file")
