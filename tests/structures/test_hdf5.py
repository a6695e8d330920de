"""HDF5 files that are complete in themselves: how many numbers a file of some size may hold."""

from io import BytesIO

import h5py
import pytest

from structures.hdf5 import check_hdf5

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
