"""Pictures, animations and ParaView files: complete or absent, with the computed numbers, at the requested times."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import xarray as xr
from PIL import Image

import hertzlink as hl
from coupling.plots import view
from structures.field import von_mises
from structures.structure import known_field

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 3, BEAD, hl.drop_speed(0.01))
RADIUS, STEEL, BELOW = 9.53e-3, 6e-3, 12e-3
SOLID = Path(__file__).parent.parent / "structures" / "data" / "cylinder.msh"
UNTIL = 2e-4


@pytest.fixture(scope="module")
def body() -> hl.Structure:
    """Steel on PTFE."""
    layers = [hl.Layer(hl.STEEL_440C, STEEL, RADIUS), hl.Layer(hl.PTFE, BELOW, RADIUS)]
    return hl.reduce(hl.layered_cylinder(layers), until=UNTIL, keep_field=True)


@pytest.fixture(scope="module")
def run(body: hl.Structure) -> xr.Dataset:
    return hl.CoSimulation(CHAIN, body).run(UNTIL)


@pytest.fixture(scope="module")
def motion(run: xr.Dataset, body: hl.Structure) -> xr.Dataset:
    """Steel on PTFE, while it is struck."""
    return hl.plots.motion(run, body, np.linspace(6e-5, UNTIL, 4))


@pytest.fixture(scope="module")
def solid_motion() -> xr.Dataset:
    """A 3-D body whose displacements are of any kind: no run is needed to draw it."""
    body = hl.solid(SOLID, hl.STEEL_440C, (0.0, 0.0, 50.8e-3), fixed="base")
    field, u = known_field(body), 1e-6 * body.contact
    grid = field.grid
    return xr.Dataset(
        {
            "displacement": (("time", "point", "component"), field.displacement(u)[None]),
            "von_mises": (("time", "point"), von_mises(field.stress(u))[None]),
            "cells": (("cell", "corner"), grid.cells),
            "part": (("cell",), grid.part),
        },
        {"time": [1e-4], "position": (("point", "component"), grid.points)},
        {"cell_type": grid.kind, "shape": "solid", "up": [0.0, 0.0, 1.0]},
    )


@pytest.fixture
def screen() -> None:
    """Skips where the machine cannot draw."""
    try:
        with view.quiet():
            pass
    except OSError as error:
        pytest.skip(str(error))


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), dtype=int)


@pytest.mark.thorough
@pytest.mark.usefixtures("screen")
def test_pictures_differ_between_times_and_fields(motion: xr.Dataset, tmp_path: Path) -> None:
    moments = motion.time.values
    kinds = [(moments[1], "von_mises"), (moments[2], "von_mises"), (moments[1], "displacement")]
    drawn = []
    for i, (time, show) in enumerate(kinds):
        path = tmp_path / f"{i}.png"
        assert (
            hl.plots.picture(motion, path, time=time, show=show, factor=500.0, highest=1e6 if i < 2 else 1e-6) == path
        )
        drawn.append(pixels(path))
    assert drawn[0].shape == drawn[2].shape
    for one, other in ((0, 2), (0, 1)):
        height, width = (min(drawn[one].shape[k], drawn[other].shape[k]) for k in (0, 1))
        assert (abs(drawn[one][:height, :width] - drawn[other][:height, :width]).max(axis=2) > 50).mean() > 0.02
    assert (drawn[0][0] == 255).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.png", "1.png", "2.png"]


@pytest.mark.thorough
@pytest.mark.usefixtures("screen")
def test_a_section_is_mirrored_and_to_scale(motion: xr.Dataset) -> None:
    """Struck from the left. The usual factor makes a tenth of the shortest side."""
    scene = view.Scene(motion, "von_mises", 0.0, 1e6)
    body = scene.image(1).astype(int)[view.ABOVE - 20 : -view.BELOW + 20]
    assert (abs(body - body[::-1]).max(axis=2) > 30).mean() < 0.02
    drawn = (body < 200).any(axis=2)
    high, wide = (np.ptp(np.flatnonzero(drawn.any(axis=axis))) + 1 for axis in (1, 0))
    assert wide / high == pytest.approx((STEEL + BELOW) / (2.0 * RADIUS), rel=0.02)
    greatest = float(np.linalg.norm(motion.displacement, axis=-1).max())
    assert 0.04 * (STEEL + BELOW) < view.Scene(motion, "von_mises", None, None).factor * greatest < 0.1 * 2.0 * RADIUS


@pytest.mark.usefixtures("screen")
def test_animations_have_a_frame_for_each_time(motion: xr.Dataset, tmp_path: Path) -> None:
    motion = motion.isel(time=[1, 3])
    path = hl.plots.picture(motion, tmp_path / "wave.gif")
    with Image.open(path) as film:
        frames = []
        for number in range(film.n_frames):
            film.seek(number)
            assert film.info["duration"] == 100
            frames.append(np.asarray(film.convert("RGB"), dtype=int))
    assert len(frames) == motion.sizes["time"]
    assert all((frame[:2, :2] > 240).all() for frame in frames)
    for one, other in zip(frames[1:], frames, strict=False):
        assert (abs(one - other).max(axis=2) > 50).mean() > 0.01
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("kind", ["motion", "solid_motion"])
def test_vtu_holds_what_was_computed(kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    """Read back by meshio, and by VTK, which finds its own order of points: the right area or volume."""
    import pyvista  # with VTK, here, as each process that collects tests would take half a second

    data: xr.Dataset = request.getfixturevalue(kind)
    listing = hl.plots.write_vtu(data, tmp_path / "paraview")
    entries = ElementTree.parse(listing).getroot().findall("Collection/DataSet")
    assert [float(entry.attrib["timestep"]) for entry in entries] == data.time.values.tolist()
    for number, entry in enumerate(entries):
        again = meshio.read(listing.parent / entry.attrib["file"])
        assert (again.points == data.position.values).all()
        assert (again.cells_dict[data.attrs["cell_type"]] == data.cells.values).all()
        for name in ("displacement", "von_mises"):
            assert (again.point_data[name] == data[name].values[number]).all()
        assert (again.cell_data["part"][0] == data.part.values).all()
    grid: Any = pyvista.read(listing.parent / entries[0].attrib["file"])
    sizes = grid.compute_cell_sizes()
    flat = kind == "motion"
    exact = RADIUS * (STEEL + BELOW) if flat else np.pi * RADIUS**2 * 50.8e-3
    assert sizes["Area" if flat else "Volume"].min() > 0.0
    assert sizes["Area" if flat else "Volume"].sum() == pytest.approx(exact, rel=1e-6 if flat else 1e-2)
    reader: Any = pyvista.get_reader(listing)
    assert reader.time_values == pytest.approx(data.time.values)


def test_folders_are_replaced_only_where_they_hold_a_motion(motion: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "paraview"
    hl.plots.write_vtu(motion, folder)
    hl.plots.write_vtu(motion.isel(time=[0]), folder)
    assert sorted(path.name for path in folder.iterdir()) == ["motion.pvd", "motion_0000.vtu"]
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"folder = .*: holds notes\.txt; name another"):
        hl.plots.write_vtu(motion, folder)
    with pytest.raises(ValueError, match=r"notes\.txt'.*is not a folder"):
        hl.plots.write_vtu(motion, folder / "notes.txt")
    with pytest.raises(ValueError, match="its parent folder does not exist"):
        hl.plots.write_vtu(motion, tmp_path / "no" / "paraview")
    assert [path.name for path in tmp_path.iterdir()] == ["paraview"]


@pytest.mark.usefixtures("screen")
def test_nothing_half_written_stays(motion: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pyvista

    def fail(*_: object) -> None:
        raise RuntimeError("stopped")

    (tmp_path / "a.png").write_text("before")
    monkeypatch.setattr(view.Scene, "image", fail)
    with pytest.raises(RuntimeError, match="stopped"):
        hl.plots.picture(motion, tmp_path / "a.png")
    with pytest.raises(RuntimeError, match="stopped"):
        hl.plots.picture(motion, tmp_path / "a.gif")
    monkeypatch.setattr(pyvista.UnstructuredGrid, "save", fail)
    with pytest.raises(RuntimeError, match="stopped"):
        hl.plots.write_vtu(motion, tmp_path / "paraview")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    assert (tmp_path / "a.png").read_text() == "before"


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"path": "a.jpg"}, r"path = .*a\.jpg'.*: must be the name of a file that ends in \.png, or in \.gif"),
        ({"path": "a.gif", "time": 1e-4}, r"time = 0\.0001: must be None for an animation, \.gif"),
        ({"path": "no/a.png"}, "its parent folder does not exist"),
        ({"time": 1.0}, r"time = 1\.0: must lie in the motion, between 6.*e-05 and 0\.0002 s"),
        ({"show": "stress"}, r"show = 'stress': must be one of 'von_mises', 'displacement'"),
        ({"factor": -1.0}, r"factor = -1\.0: must be zero or a positive number"),
    ],
)
def test_pictures_that_cannot_be_drawn(
    motion: xr.Dataset, tmp_path: Path, keywords: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        hl.plots.picture(motion, **{**keywords, "path": tmp_path / keywords.get("path", "a.png")})
    assert not list(tmp_path.iterdir())


def test_what_is_no_motion(motion: xr.Dataset, tmp_path: Path) -> None:
    for wrong, message in (
        ("motion", "motion = 'motion': must be the Dataset of plots.motion"),
        (motion.drop_vars("part"), "motion: lacks part; must be the Dataset of plots.motion"),
        (motion.isel(time=0), r"motion: lacks a time, or the dimension time \(take times by isel"),
    ):
        for draw, name in ((hl.plots.picture, "a.png"), (hl.plots.write_vtu, "a")):
            with pytest.raises(ValueError, match=message):
                draw(wrong, tmp_path / name)  # type: ignore[arg-type]
