"""Pictures and animations of a `motion`, drawn off-screen by pyvista, and ParaView's files."""

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.plots.canvas import round_number
from coupling.plots.motion import known_motion
from structures.checks import finite, not_negative, one_of, positive
from structures.units import handy

# Quantities that can be shown, with name, unit and colours. The deflection has a sign; its colours are white at zero.
QUANTITIES = {
    "von_mises": ("von Mises stress", "Pa", "viridis"),
    "displacement": ("displacement", "m", "viridis"),
    "deflection": ("deflection", "m", "RdBu_r"),
}

# The colours cover this part of the body, over all times. The stress at the contact is a hundred times that of the
# waves, and a scale up to it would hide the waves.
COLOURED = 0.95

CELLS = {"quad9": "BIQUADRATIC_QUAD", "tetra10": "QUADRATIC_TETRA", "hexahedron27": "TRIQUADRATIC_HEXAHEDRON"}  # of VTK
SIGHT = np.array([-0.45, 0.75, -0.48])  # direction of view on 3-D bodies, in a frame whose third axis points up
WIDTH, HEIGHT, ABOVE, BELOW = 1000, 600, 50, 180  # largest size of the body, and room above and below it, pixels
GAP, BAR = 25, 80  # between body and ruler, and the height of the colour bar with its words, pixels
FRAME_TIME = 100  # of an animation, ms
NO_WINDOW = (
    "pictures are drawn off-screen by OpenGL, which this machine lacks: install EGL or OSMesa (Debian: libegl1 or "
    "libosmesa6), or start Python by xvfb-run"
)


def picture(
    motion: xr.Dataset,
    path: str | Path,
    time: float | None = None,
    show: str = "von_mises",
    factor: float | None = None,
    highest: float | None = None,
) -> Path:
    """Draw a `motion` at one time, or all of it as an animation.

    Bodies of revolution are cut along their axis and drawn horizontally, struck from the left. 3-D bodies are drawn
    from outside.

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    path : str or Path
        A .png file of one time, or a .gif of all times. An existing file is replaced.
    time : float, optional
        Time of a picture, s; the nearest time of the motion is drawn. By default that of the largest displacement.
    show : {"von_mises", "displacement", "deflection"}
        The colours: von Mises stress, the magnitude of the displacement, or its component into the struck face.
    factor : float, optional
        Magnification of the displacement. By default a round number that makes it a tenth of the body's shortest side.
    highest : float, optional
        Upper end of the colours, Pa or m; by default a round number that 95 % of the body does not exceed.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    ValueError
        For a time outside the motion, a wrong name, or a time for an animation.
    OSError
        Where the machine cannot draw off-screen.

    Examples
    --------
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[4e-6, 5e-6], beads=[1])
    >>> hl.plots.picture(motion, "bead.png", factor=0.0).name  # doctest: +SKIP
    'bead.png'
    """
    from PIL import Image

    motion, target = known_motion(motion), Path(path)
    film, moments = target.suffix.lower() == ".gif", motion.time.values
    if not film and target.suffix.lower() != ".png":
        raise ValueError(f"path = {str(path)!r}: must be the name of a file that ends in .png, or in .gif")
    if film and time is not None:
        raise ValueError(f"time = {time!r}: must be None for an animation, .gif, which shows every time")
    number = int(np.linalg.norm(motion.displacement.values, axis=-1).max(axis=1).argmax())
    if time is not None:
        spare = 0.5 * float(np.diff(moments).max(initial=0.0)) or 1e-6
        if not moments[0] - spare <= finite("time", time, "s") <= moments[-1] + spare:
            ends = f"{moments[0]:.6g} and {moments[-1]:.6g} s"
            raise ValueError(f"time = {time!r}: must lie in the motion, between {ends}")
        number = int(np.argmin(abs(moments - time)))

    scene = Scene(motion if film else motion.isel(time=[number]), show, factor, highest)
    with written_whole("path", target) as part:
        images = [Image.fromarray(scene.image(k)) for k in range(scene.motion.sizes["time"])]
        options: dict[str, Any] = {}
        if film:
            # Frames share the colours of one palette; otherwise they would flicker.
            sample = Image.fromarray(np.concatenate([np.asarray(image)[::2, ::2] for image in images]))
            palette = sample.quantize(256, method=Image.Quantize.MAXCOVERAGE)
            images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
            options = {"save_all": True, "append_images": images[1:], "duration": FRAME_TIME, "loop": 0}
        images[0].save(part, **options)
    return target


def write_vtu(motion: xr.Dataset, folder: str | Path) -> Path:
    """Write a `motion` for ParaView: motion_0000.vtu, ... and motion.pvd.

    The files hold displacement (m), von Mises stress and, for beads, the stress components (Pa), and for each cell its
    part. Cells stay quadratic. A body of revolution is written as its half-plane (r, 0, −z).

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    folder : str or Path
        The folder to write. A folder that holds only an earlier motion is replaced.

    Returns
    -------
    Path
        The path of motion.pvd.

    Raises
    ------
    ValueError
        If the folder holds other files, or cannot be written.

    Examples
    --------
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[4e-6, 5e-6], beads=[1])
    >>> hl.plots.write_vtu(motion, "paraview").name
    'motion.pvd'
    """
    motion, target = known_motion(motion), Path(folder)
    if target.exists() and not target.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: is not a folder; name another")
    for path in target.iterdir() if target.exists() else ():
        if not re.fullmatch(r"motion(_\d+)?\.(vtu|pvd)", path.name):
            raise ValueError(f"folder = {str(folder)!r}: holds {path.name}; name another")
    with written_whole("folder", target) as part:
        part.mkdir()
        entries = []
        for number, moment in enumerate(motion.time.values.tolist()):
            grid = grid_of(motion, motion.position.values)
            grid.cell_data["part"] = motion.part.values
            for field in ("displacement", "von_mises"):
                grid.point_data[field] = motion[field].values[number]
            for which in motion.stress_component.values if "stress" in motion else ():
                grid.point_data[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            grid.save(part / name)
            entries.append(f'    <DataSet timestep="{moment!r}" part="0" file="{name}" />\n')
        listing = f"  <Collection>\n{''.join(entries)}  </Collection>\n"
        listing = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n{listing}</VTKFile>\n'
        (part / "motion.pvd").write_text(listing, "utf-8")
    return target / "motion.pvd"


@contextmanager
def written_whole(name: str, path: Path) -> Iterator[Path]:
    """Yield a temporary path. At the end the file or folder there replaces the one at `path`, whole or not at all.
    name: the name of the argument that holds the path."""
    parent = path.absolute().parent
    if not parent.is_dir():
        raise ValueError(f"{name} = {str(path)!r}: its parent folder does not exist")
    with TemporaryDirectory(prefix=".", dir=parent) as folder:
        part = Path(folder, path.name)
        yield part
        if path.is_dir():
            shutil.rmtree(path)
        os.replace(part, path)


class Scene:
    """A motion in one plane of drawing, mm, with the same colours, factor and frame at all times; see `picture`."""

    def __init__(self, motion: xr.Dataset, show: str, factor: float | None, highest: float | None) -> None:
        name, unit, self.colours = QUANTITIES[one_of("show", show, QUANTITIES)]
        self.motion, self.flat = motion, motion.attrs["shape"] == "revolution"

        # Directions of the picture: to the right, up, and towards the viewer.
        up = np.array(motion.attrs["up"]) / np.linalg.norm(motion.attrs["up"])
        self.frame = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        if not self.flat:
            ahead = np.cross(up, np.eye(3)[np.argmin(abs(up))])
            ahead /= np.linalg.norm(ahead)
            sight = SIGHT / np.linalg.norm(SIGHT) @ np.array([np.cross(ahead, up), ahead, up])
            across = np.cross(sight, up) / np.linalg.norm(np.cross(sight, up))
            self.frame = np.array([across, np.cross(across, sight), -sight])

        moved = motion.displacement.values
        size = np.linalg.norm(moved, axis=-1)
        values = {"displacement": size, "deflection": -moved @ up}.get(show, motion.von_mises.values)
        sides = np.ptp(motion.position.values, axis=0) * ([2.0, 1.0, 1.0] if self.flat else 1.0)
        usual = round_number(0.1 * sides[sides > 0.0].min() / size.max()) if size.max() > 0.0 else 1.0
        self.factor = usual if factor is None else not_negative("factor", factor)
        if highest is None:
            # A round number that most of the body does not exceed, or the greatest value if it is near that.
            sizes = grid_of(motion, motion.position.values).compute_cell_sizes()
            of_cells = abs(values[:, motion.cells.values].mean(axis=2))
            order = np.argsort(of_cells, axis=None)
            passed = np.cumsum(np.broadcast_to(abs(sizes["Area"] + sizes["Volume"]), of_cells.shape).ravel()[order])
            most = float(of_cells.ravel()[order[np.searchsorted(passed, COLOURED * passed[-1])]])
            high = float(abs(values).max())
            high = high or 1.0 if most > 0.5 * high or most == 0.0 else round_number(most, up=True)
        else:
            high = positive("highest", highest, unit)
        scale, unit = handy([5.0 * high], unit)  # in which the highest value is 0.2 or more
        self.values, self.ends = scale * values, (-scale * high if show == "deflection" else 0.0, scale * high)
        words, greatest = f"{name} ({unit})", abs(self.values).max()
        if greatest > self.ends[1] * (1.0 + 1e-9):
            words += f", greatest {greatest:.4g}"

        points = np.concatenate([self.body(number).points for number in (None, *range(motion.sizes["time"]))])
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        dots = min(0.92 * WIDTH / size[0], HEIGHT / size[1])  # per mm
        window = [WIDTH, round(dots * size[1]) + ABOVE + BELOW]
        with quiet():
            import pyvista

            light: Any = "none" if self.flat else "light kit"
            plotter: Any = pyvista.Plotter(off_screen=True, window_size=window, lighting=light)
        self.plotter = plotter
        plotter.set_background("white")
        left, right = ([end, low[1] - GAP / dots, 0.0] for end in self.body().bounds[:2])
        plotter.add_ruler(
            pointa=left, pointb=right, title="mm", label_format="%g", label_color="black", tick_color="black"
        )
        camera, self.far = plotter.camera, 10.0 * float(size.max())
        centre = low + 0.5 * size + [0.0, 0.5 * (ABOVE - BELOW) / dots, 0.0]
        camera.parallel_projection, camera.parallel_scale = True, 0.5 * window[1] / dots
        camera.focal_point, camera.position, camera.up = centre, centre + [0.0, 0.0, self.far], (0.0, 1.0, 0.0)
        camera.clipping_range = (0.01 * self.far, 2.0 * self.far)
        self.bar = {
            "title": f"{words}\n", "color": "black", "fmt": "%.3g", "title_font_size": 20, "label_font_size": 18,
            "position_x": 0.2, "position_y": 0.1 * BAR / window[1], "width": 0.6, "height": BAR / window[1],
            "vertical": False,
        }  # fmt: skip

    def body(self, number: int | None = None, part: int | None = None) -> Any:
        """Return the body at rest, or magnified at a time; all of it, or a part."""
        places = self.motion.position.values
        if number is not None:
            places = places + self.factor * self.motion.displacement.values[number]
        grid = grid_of(self.motion, 1e3 * places @ self.frame.T, part)
        if number is not None:
            grid["value"] = self.values[number]
        return grid.merge(grid.reflect((0.0, 1.0, 0.0))) if self.flat else grid

    def image(self, number: int) -> NDArray[np.uint8]:
        """Return the picture at a time, height × width × 3: the body and, for a section, its outline at rest."""
        for part in np.unique(self.motion.part.values).tolist():
            # Outlines at rest lie behind the body, those of the moved body in front of it.
            for moment, colour, lift in ((None, "#a0a0a0", -1e-3), (number, "black", 1e-3)):
                if moment is None and (not self.flat or f"{colour} {part}" in self.plotter.actors):
                    continue  # drawn with an earlier image
                surface = self.body(moment, part).extract_surface(nonlinear_subdivision=1, algorithm="dataset_surface")
                if moment is not None:
                    self.plotter.add_mesh(
                        surface, name=f"body {part}", scalars="value", cmap=self.colours, clim=self.ends,
                        lighting=not self.flat, ambient=0.65, diffuse=0.4, scalar_bar_args=self.bar, reset_camera=False,
                    )  # fmt: skip
                edges = surface.extract_feature_edges(30.0, feature_edges=not self.flat, manifold_edges=False)
                edges.points += [0.0, 0.0, lift * self.far]
                self.plotter.add_mesh(
                    edges, name=f"{colour} {part}", color=colour, line_width=2.0, lighting=False, reset_camera=False
                )
        title = f"t = {1e6 * float(self.motion.time[number]):.1f} µs"
        title += f",  displacement × {self.factor:g}" * (self.factor > 0.0)
        self.plotter.add_text(title, position="upper_edge", font_size=10, color="black", name="title")
        return np.array(self.plotter.screenshot(return_img=True))


def grid_of(motion: xr.Dataset, places: NDArray[np.float64], part: int | None = None) -> Any:
    """Return a motion's cells at these places as a grid of pyvista: all of them, or those of a part."""
    import pyvista

    cells = motion.cells.values if part is None else motion.cells.values[motion.part.values == part]
    return pyvista.UnstructuredGrid({getattr(pyvista.CellType, CELLS[motion.attrs["cell_type"]]): cells}, places)


@contextmanager
def quiet() -> Iterator[None]:
    """Silence VTK while it tries windows that it cannot create; raise an OSError if none is left: VTK would exit."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, as it brings the windows
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        if vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow" and "DISPLAY" not in os.environ:
            raise OSError(NO_WINDOW)
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
