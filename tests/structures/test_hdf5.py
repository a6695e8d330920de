"""HDF5 files that are complete in themselves: how many numbers a file of some size may hold."""

from collections.abc import Callable
from io import BytesIO
from typing import Any

import h5py
import numpy as np
import pytest

from structures.meshes.hdf5 import check_hdf5

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


def _never_written(file: Any) -> None:
    for number in range(5):
        file.create_dataset(f"zeros{number}", (MANY // 4,), "i1", chunks=(1000,))


def _linked_often(link: Callable[[Any], Any]) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        zeros = file.create_dataset("zeros", (MANY // 4,), "i1", chunks=(1000,))
        for number in range(5):
            file[f"again{number}"] = link(zeros)

    return fill


def _texts(file: Any) -> Any:
    """6 000 texts of 64 000 letters, each of which refers to the same place in the file."""
    data = file.create_dataset("texts", (6000,), h5py.string_dtype(), chunks=(6000,))
    data[0] = "x" * 64_000
    data[1:] = ""
    return data


SHARED = {
    "never written": _never_written,
    "one dataset of six names": _linked_often(lambda zeros: zeros),
    "five soft links to one": _linked_often(lambda zeros: h5py.SoftLink(zeros.name)),
}


@pytest.mark.parametrize("fill", SHARED.values(), ids=SHARED)
def test_the_sum_is_limited(fill: Callable[[Any], None]) -> None:
    """A reader takes 15 MB, of which each part is small."""
    content = BytesIO()
    with h5py.File(content, "w") as file:
        fill(file)
    with pytest.raises(ValueError, match=r"claims 3e\+06 bytes, more than its file can hold in all; it was not read"):
        check_hdf5(content, "file")


def test_texts_that_share_their_bytes_count_each() -> None:
    content = BytesIO()
    with h5py.File(content, "w") as file:
        chunk = _texts(file).id.get_chunk_info(0)
    check_hdf5(content, "file")
    raw = bytearray(content.getvalue())
    entry = raw[chunk.byte_offset : chunk.byte_offset + 16]  # length, address of the heap, number in it
    raw[chunk.byte_offset : chunk.byte_offset + chunk.size] = entry * 6000
    with pytest.raises(ValueError, match=r"/texts claims .* bytes, more than its file can hold"):
        check_hdf5(BytesIO(bytes(raw)), "file")


def test_an_attribute_of_texts_that_share_their_bytes_counts_each() -> None:
    content = BytesIO()
    with h5py.File(content, "w") as file:
        file["texts"] = np.zeros(1)
        file["texts"].attrs.create("all", ["x" * 30_000, *[""] * 2999], dtype=h5py.string_dtype())
    with pytest.raises(ValueError, match=r"/texts claims .* bytes, more than its file can hold"):
        check_hdf5(content, "file")


def test_many_texts_of_little_files_are_read() -> None:
    """1 500 attributes of one text each, as results of hundreds of variables have."""
    content = BytesIO()
    with h5py.File(content, "w") as file:
        file.create_dataset("names", data=[f"name {i}" for i in range(2000)], dtype=h5py.string_dtype())
        for number in range(500):
            data = file.create_dataset(f"data{number}", data=np.zeros(3))
            data.attrs.update({"units": "N", "long_name": "force between beads", "note": "x" * 50})
    check_hdf5(content, "file")
