"""Files that were made to do harm: each is refused by a message, nothing runs, and nothing is written elsewhere."""

import os
import pickle
import re
from pathlib import Path
from typing import Any

import h5py  # type: ignore[import-untyped]
import meshio
import numpy as np
import pytest

import hertzlink as hl
from structures.meshes.mesh_files import read_mesh

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


class Evil:
    """A pickle that makes a file when it is opened."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.marker),)


@pytest.fixture
def marker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What exists once code from a file has run."""
    return tmp_path_factory.mktemp("elsewhere") / "marker"


HEADERS = [
    "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (10**12,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
    "{'descr': [('a', '<f8'), ('b', '|O')], 'fortran_order': False, 'shape': (1,)}",
    "{'descr': '<f8', 'fortran_order': False, 'shape': (",
]


def array_with(header: str) -> bytes:
    """Eight bytes behind a header of numpy's format."""
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + bytes(8)


SECRET = np.arange(4.0) + 1234.5


def _external_link(file: Any, secret: Path) -> None:
    file["stolen"] = h5py.ExternalLink(str(secret), "/secret")


def _external_storage(file: Any, secret: Path) -> None:
    file.create_dataset("stolen", (4,), "<f8", external=[(str(secret.with_suffix(".raw")), 0, 32)])


def _virtual(file: Any, secret: Path) -> None:
    layout = h5py.VirtualLayout((4,), "<f8")
    layout[:] = h5py.VirtualSource(str(secret), "secret", (4,))
    file.create_virtual_dataset("stolen", layout)


def _plugin(file: Any, secret: Path) -> None:
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((4,))
    plist.set_filter(32987, h5py.h5z.FLAG_OPTIONAL, (1,))
    space = h5py.h5s.create_simple((4,))
    h5py.h5d.create(file.id, b"stolen", h5py.h5t.IEEE_F64LE, space, plist)


def _bomb(file: Any, secret: Path) -> None:
    file.create_dataset("stolen", (10**12,), "<f8", chunks=(10**6,), compression="gzip")


LEADS_OUT = {
    "links to another file": _external_link,
    "keeps its numbers in another file": _external_storage,
    "consists of parts of other files": _virtual,
    "needs a plugin": _plugin,
    "claims 8e+12 bytes": _bomb,
}


@pytest.fixture
def secret(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file elsewhere that must not be read."""
    path = tmp_path_factory.mktemp("elsewhere") / "secret.h5"
    with h5py.File(path, "w") as file:
        file["secret"] = SECRET
    path.with_suffix(".raw").write_bytes(SECRET.tobytes())
    return path


TETRA = meshio.Mesh([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], [("tetra", [[0, 1, 2, 3]])])


def solid(path: Path) -> Any:
    return hl.solid(path, hl.PTFE, (0.01, 0.01, 0.0))


@pytest.mark.parametrize("message", LEADS_OUT)
def test_a_mesh_does_not_lead_out_of_its_file(tmp_path: Path, secret: Path, message: str) -> None:
    path = tmp_path / "mesh.med"
    TETRA.write(path)
    with h5py.File(path, "r+") as file:
        LEADS_OUT[message](file, secret)
    with pytest.raises(ValueError, match=f"mesh = .*mesh.med': /stolen {re.escape(message)}.*it was not read"):
        solid(path)


MESHES = {
    "hdf.xdmf": '<Xdmf><DataItem Dimensions="4" Format="HDF">{}:/secret</DataItem></Xdmf>',
    "binary.xmf": "<Xdmf><DataItem Format='Binary' Dimensions='4'>\n{}\n</DataItem></Xdmf>",
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("absolute", [True, False])
def test_a_mesh_names_no_file_outside_its_folder(tmp_path: Path, secret: Path, name: str, absolute: bool) -> None:
    other = str(secret) if absolute else os.path.relpath(secret, tmp_path)
    (tmp_path / name).write_text(MESHES[name].format(other))
    with pytest.raises(ValueError, match=rf"mesh = .*{name}.*: names '.*secret\.h5', which lies outside"):
        solid(tmp_path / name)


def test_a_mesh_of_several_files_in_its_folder_is_read(tmp_path: Path) -> None:
    TETRA.write(tmp_path / "mesh.xdmf")
    assert len(read_mesh(tmp_path / "mesh.xdmf").points) == 4


def test_a_signal_is_text(tmp_path: Path, marker: Path) -> None:
    """A pickle, an array of objects and code instead of numbers are no lines of numbers."""
    path = tmp_path / "scope.csv"
    np.save(tmp_path / "objects.npy", np.array([Evil(marker)], dtype=object), allow_pickle=True)
    contents = [pickle.dumps(Evil(marker)), (tmp_path / "objects.npy").read_bytes()]
    contents += [b"".join(b"%d, __import__('os').mkdir('x')\n" % i for i in range(100))]
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"scope\.csv: (is a binary file|must hold a line for each)"):
            hl.read_signal(path, sensors={7: 1}, calibration=1.0)
    assert not marker.exists()
