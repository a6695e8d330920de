"""Files that were made to do harm: each is refused by a message, nothing runs, and nothing is written elsewhere."""

import os
import pickle
import re
from pathlib import Path
from typing import Any

import h5py  # type: ignore[import-untyped]
import numpy as np
import pytest

import hertzlink as hl
from coupling.results.hdf5 import read_netcdf


class Evil:
    """A pickle that makes a file when it is opened."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.marker),)


@pytest.fixture
def marker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file that exists once code from another file has run."""
    return tmp_path_factory.mktemp("elsewhere") / "marker"


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


@pytest.mark.parametrize("message", LEADS_OUT)
def test_a_result_does_not_lead_out_of_its_file(tmp_path: Path, secret: Path, message: str) -> None:
    path = tmp_path / "results.nc"
    with h5py.File(path, "w") as file:
        LEADS_OUT[message](file, secret)
    with pytest.raises(ValueError, match=rf"results\.nc: /stolen {re.escape(message)}.*it was not read"):
        read_netcdf(path)


def test_a_signal_is_text(tmp_path: Path, marker: Path) -> None:
    """A pickle, an array of objects and code instead of numbers are not lines of numbers."""
    path = tmp_path / "scope.csv"
    np.save(tmp_path / "objects.npy", np.array([Evil(marker)], dtype=object), allow_pickle=True)
    contents = [pickle.dumps(Evil(marker)), (tmp_path / "objects.npy").read_bytes()]
    contents += [b"".join(b"%d, __import__('os').mkdir('x')\n" % i for i in range(100))]
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"scope\.csv: (is a binary file|must hold a line for each)"):
            hl.read_signal(path, sensors={7: 1}, calibration=1.0)
    assert not marker.exists()


def test_deep_input_and_what_is_not_there(tmp_path: Any) -> None:
    """A result with an input of unknown form is reported without it; measures name the variable that they lack."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.3), hl.half_space(hl.STEEL_440C)).run(5e-4)
    deep = run.assign_attrs(input="[" * 100_000 + "]" * 100_000)
    assert hl.plots.report(deep, tmp_path / "deep.html").exists()
    with pytest.raises(ValueError, match="run: holds no velocity"):
        hl.reflections(run.drop_vars("velocity"), 6)
