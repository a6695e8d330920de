"""Pictures and animations of a `motion`, drawn off-screen by pyvista, and ParaView's files."""

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.plots.canvas import COLOURS
from coupling.plots.motion import known_motion
from coupling.results.reading import Reading
from structures.checks import finite, not_negative, one_of, positive
from structures.units import handy

# What can be shown: its name, unit and colours; those of the deflection, which has a sign, are white at zero.
QUANTITIES = {
    "von_mises": ("von Mises stress", "Pa", "viridis"),
    "displacement": ("displacement", "m", "viridis"),
    "deflection": ("deflection", "m", "RdBu_r"),
}

# The colours cover this part of the body, over all times. The stress at the contact is a hundred times that of the
# waves, which a scale up to it would hide.
COLOURED = 0.95

CELLS = {"quad9": "BIQUADRATIC_QUAD", "tetra10": "QUADRATIC_TETRA", "hexahedron27": "TRIQUADRATIC_HEXAHEDRON"}  # of VTK
SIGHT = np.array([-0.45, 0.75, -0.48])  # direction of view on 3-D bodies, in a frame whose third axis points up
SUFFIXES = (".png", ".gif", ".svg", ".pdf")
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
    run: xr.Dataset | None = None,
) -> Path:
    """Draw a `motion` at one time, or all of it as an animation.

    Bodies of revolution are cut along their axis; long ones are drawn horizontally, struck from the left. 3-D bodies
    are drawn from outside.

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    path : str or Path
        A .png, .pdf or .svg file of one time, or a .gif of all times. An existing file is replaced.
    time : float, optional
        Time of a picture, s; the nearest time of the motion is drawn. By default that of the largest displacement.
    show : {"von_mises", "displacement", "deflection"}
        The colours: von Mises stress, the magnitude of the displacement, or its component into the struck face.
    factor : float, optional
        Magnification of the displacement. By default a round number that makes it a tenth of the body's shortest side.
    highest : float, optional
        Upper end of the colours, Pa or m; by default a round number that 95 % of the body does not exceed.
    run : xarray.Dataset, optional
        The run of the motion, whose force on the structure is then drawn below.

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
    motion, target = known_motion(motion), Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise ValueError(f"path = {str(path)!r}: must be the name of a file that ends in {', '.join(SUFFIXES)}")
    moments = motion.time.values
    if target.suffix.lower() == ".gif":
        if time is not None:
            raise ValueError(f"time = {time!r}: must be None for an animation, .gif, which shows every time")
        from PIL import Image

        scene = Scene(motion, show, factor, highest, run, dots=110)
        images = [scene.pixels(number) for number in range(moments.size)]
        frames = [Image.fromarray(image) for image in images]
        # Frames share the colours of one palette; otherwise they would flicker.
        sample = Image.fromarray(np.concatenate([image[::2, ::2] for image in images]))
        palette = sample.quantize(256, method=Image.Quantize.MAXCOVERAGE)
        first, *others = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
        with written_whole("path", target) as part:
            first.save(part, save_all=True, append_images=others, duration=FRAME_TIME, loop=0, optimize=False)
        return target

    if time is None:
        number = int(np.linalg.norm(motion.displacement.values, axis=-1).max(axis=1).argmax())
    else:
        spare = 0.5 * float(np.diff(moments).max(initial=0.0)) or 1e-6
        if not moments[0] - spare <= finite("time", time, "s") <= moments[-1] + spare:
            raise ValueError(
                f"time = {time!r}: must lie between {moments[0]:.6g} and {moments[-1]:.6g} s, as the motion"
            )
        number = int(np.argmin(abs(moments - time)))
    scene = Scene(motion.isel(time=[number]), show, factor, highest, run, dots=200)
    with written_whole("path", target) as part:
        scene.draw(0).savefig(part, dpi=scene.dots)
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
    import meshio  # type: ignore[import-untyped]

    motion, target = known_motion(motion), Path(folder)
    if target.exists() and not target.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: is no folder; name another")
    for path in target.iterdir() if target.exists() else ():
        if not re.fullmatch(r"motion(_\d+)?\.(vtu|pvd)", path.name):
            raise ValueError(f"folder = {str(folder)!r}: holds {path.name}; name another")
    with written_whole("folder", target) as part:
        part.mkdir()
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        cells, parts = [(motion.attrs["cell_type"], motion.cells.values)], {"part": [motion.part.values]}
        for number, moment in enumerate(motion.time.values.tolist()):
            fields = {name: motion[name].values[number] for name in ("displacement", "von_mises")}
            for which in motion.stress_component.values if "stress" in motion else ():
                fields[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            meshio.Mesh(motion.position.values, cells, fields, parts).write(part / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(moment), part="0", file=name)
        ElementTree.indent(listing)
        ElementTree.ElementTree(listing).write(part / "motion.pvd", encoding="utf-8", xml_declaration=True)
    return target / "motion.pvd"


@contextmanager
def written_whole(name: str, path: Path) -> Iterator[Path]:
    """Yield a path beside that of a file or folder; what is written there replaces it at the end, whole or not at all.

    name: of the argument.
    """
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
    """A motion in a figure, with the same colours, factor and frame at all times; see `picture`. dots: per inch."""

    def __init__(
        self, motion: xr.Dataset, show: str, factor: float | None, highest: float | None, run: xr.Dataset | None,
        dots: int,
    ) -> None:  # fmt: skip
        self.name, self.unit, self.colours = QUANTITIES[one_of("show", show, QUANTITIES)]
        self.motion, self.dots, self.flat = motion, dots, motion.attrs["shape"] == "revolution"
        self.up = np.array([0.0, 0.0, 1.0] if self.flat else motion.attrs["up"])
        self.up /= np.linalg.norm(self.up)
        self.force: xr.DataArray | None = None
        if run is not None:  # relative to the preload, up to the end of an animation
            reading = Reading(run, "the Dataset of a run")
            reading.check_one_chain("contact_force")
            end = max(float((motion if motion.sizes["time"] > 1 else run).time[-1]), 2.0 * float(run.time[1]))
            self.force = reading.dynamic_force().isel(contact=reading.beads[0]).sel(time=slice(None, end))

        moved = np.asarray(motion.displacement.values, dtype=float)
        size = np.linalg.norm(moved, axis=-1)
        self.values = {"displacement": size, "deflection": -moved @ self.up}.get(show, motion.von_mises.values)
        sides = np.ptp(self.grid().points, axis=0)
        usual = round_number(0.1 * sides[sides > 0.0].min() / size.max()) if size.max() > 0.0 else 1.0
        self.factor = usual if factor is None else not_negative("factor", factor)
        self.high = self.usual_end() if highest is None else positive("highest", highest, self.unit)
        self.low = -self.high if show == "deflection" else 0.0
        self.turn()

    def usual_end(self) -> float:
        """Return a round number that most of the body does not exceed, or the greatest value if that is not far off."""
        sizes = self.grid(halves=1).compute_cell_sizes()
        of_cells = abs(self.values[:, self.motion.cells.values].mean(axis=2))
        order = np.argsort(of_cells, axis=None)
        passed = np.cumsum(np.broadcast_to(abs(sizes["Area"] + sizes["Volume"]), of_cells.shape).ravel()[order])
        usual = float(of_cells.ravel()[order[np.searchsorted(passed, COLOURED * passed[-1])]])
        greatest = float(abs(self.values).max())
        return greatest or 1.0 if usual > 0.5 * greatest or usual == 0.0 else round_number(usual, up=True)

    def turn(self) -> None:
        """Choose the directions of the picture, to the right, up, and towards the viewer, and its corners, m."""
        sight = np.array([0.0, 1.0, 0.0])
        if not self.flat:
            ahead = np.cross(self.up, np.eye(3)[np.argmin(abs(self.up))])
            ahead /= np.linalg.norm(ahead)
            sight = SIGHT / np.linalg.norm(SIGHT) @ np.array([np.cross(ahead, self.up), ahead, self.up])
        right = np.cross(sight, self.up)
        right /= np.linalg.norm(right)
        frame = np.array([right, np.cross(right, sight), -sight])
        width, height, _ = np.ptp(self.grid().points @ frame.T, axis=0)
        self.lying = bool(height > 2.5 * width)
        self.frame = np.array([-frame[1], frame[0], frame[2]]) if self.lying else frame
        moments = [None, *range(self.motion.sizes["time"])]
        places = np.concatenate([self.grid(moment).points for moment in moments]) @ self.frame[:2].T
        margin = 0.03 * np.ptp(places, axis=0).max()
        self.corners = places.min(axis=0) - margin, places.max(axis=0) + margin
        self.size = self.corners[1] - self.corners[0]

    def grid(self, number: int | None = None, part: int | None = None, halves: int = 2) -> Any:
        """Return the body at rest, or as it is drawn at a time; all of it, or a part."""
        import pyvista

        motion, places = self.motion, self.motion.position.values.astype(float)
        cells = motion.cells.values if part is None else motion.cells.values[motion.part.values == part]
        if number is not None:
            places = places + self.factor * motion.displacement.values[number]
        kind = getattr(pyvista.CellType, CELLS[motion.attrs["cell_type"]])
        grid: Any = pyvista.UnstructuredGrid({kind: cells}, places)
        if number is not None:
            grid["value"] = self.values[number]
        return grid.merge(grid.reflect((1.0, 0.0, 0.0))) if self.flat and halves == 2 else grid

    def image(self, number: int, pixels: int) -> NDArray[np.uint8]:
        """Return height × width × 3: the body at the time of this number, of a section also its outline at rest."""
        import pyvista

        window, far = [pixels, max(2, round(pixels * self.size[1] / self.size[0]))], 10.0 * float(self.size.max())
        with quiet():
            light: Any = "none" if self.flat else "light kit"
            plotter: Any = pyvista.Plotter(off_screen=True, window_size=window, lighting=light)
        plotter.set_background("white")
        for part in np.unique(self.motion.part.values).tolist():
            # Outlines at rest lie behind the body, those of the moved body in front of it.
            for moment, colour, lift in ((None, "#a0a0a0", -1e-4), (number, "black", 1e-4)):
                if moment is None and not self.flat:
                    continue
                surface = self.grid(moment, part).extract_surface(nonlinear_subdivision=1, algorithm="dataset_surface")
                if moment is not None:
                    plotter.add_mesh(
                        surface, scalars="value", cmap=self.colours, clim=(self.low, self.high), show_scalar_bar=False,
                        lighting=not self.flat, ambient=0.65, diffuse=0.4,
                    )  # fmt: skip
                edges = surface.extract_feature_edges(30.0, feature_edges=not self.flat, manifold_edges=False)
                edges.points += lift * far * self.frame[2]
                plotter.add_mesh(edges, color=colour, line_width=self.dots / 45.0, lighting=False)
        middle = (self.corners[0] + self.corners[1]) / 2.0 @ self.frame[:2]
        plotter.enable_parallel_projection()
        plotter.camera.position, plotter.camera.focal_point = middle + far * self.frame[2], middle
        plotter.camera.up, plotter.camera.parallel_scale = self.frame[1], float(self.size[1]) / 2.0
        plotter.camera.clipping_range = (0.01 * far, 2.0 * far)
        image = np.array(plotter.screenshot(return_img=True))
        plotter.close()
        return image

    def draw(self, number: int) -> Any:
        """Return the figure at the time of this number: the body with its colours, and the force below."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.figure import Figure

        width = min(4.8, 3.8 * self.size[0] / self.size[1])
        height, wide = width * self.size[1] / self.size[0], self.size[1] < 0.6 * self.size[0]
        heights = [height + 1.0] if self.force is None else [height + 1.0, 1.7]
        figure = Figure((max(3.9, width + (0.9 if wide else 1.9)), sum(heights) + (0.9 if wide else 0.1)), self.dots)
        figure.set_layout_engine("constrained")
        body, *others = figure.subplots(len(heights), height_ratios=heights, squeeze=False)[:, 0]
        (left, bottom), (right, top) = (1e3 * corner for corner in self.corners)
        upright = self.flat and not self.lying  # its depth is −z
        extent = (left, right, -bottom, -top) if upright else (left, right, bottom, top)
        body.imshow(self.image(number, round(2.0 * self.dots * width)), extent=extent, interpolation="antialiased")
        moment = 1e6 * float(self.motion.time[number])
        times = f"{self.factor:,.0f}".replace(",", "\N{THIN SPACE}") if self.factor >= 1e3 else f"{self.factor:g}"
        body.set_title(f"t = {moment:.1f} µs" + f",  displacement × {times}" * (self.factor > 0.0), fontsize=9.0)
        factor, unit = handy([5.0 * self.high], self.unit)  # in which the highest value is 0.2 or more
        over, under = self.values.max() > self.high * (1.0 + 1e-9), self.values.min() < self.low * (1.0 + 1e-9)
        figure.colorbar(
            ScalarMappable(Normalize(self.low * factor, self.high * factor), self.colours), ax=body,
            label=f"{self.name} ({unit})", location="bottom" if wide else "right", aspect=30.0,
            extend=("neither", "max", "min", "both")[int(over) + 2 * int(under)],
        )  # fmt: skip
        if self.flat:
            depth = f"{self.motion.attrs.get('depth', 'depth')} (mm)"
            body.set(xlabel=depth if self.lying else "r (mm)", ylabel="r (mm)" if self.lying else depth)
            across = body.yaxis if self.lying else body.xaxis
            across.set_major_formatter(lambda value, _: f"{abs(value):g}")
            body.locator_params(axis="y" if self.lying else "x", nbins=4)
        else:  # a bar of a round length in place of axes
            body.set_axis_off()
            length, middle = round_number(0.3 * (right - left)), (left + right) / 2.0
            ends = [middle - 0.5 * length, middle + 0.5 * length]
            body.plot(ends, [bottom, bottom], color="black", linewidth=2.0, clip_on=False, solid_capstyle="butt")
            body.annotate(
                f"{length:g} mm", (middle, bottom), (0.0, -4.0), textcoords="offset points", ha="center", va="top",
                fontsize=9.0, annotation_clip=False,
            )  # fmt: skip
        for axes in others:
            axes.plot(1e6 * self.force.time, self.force, color=COLOURS[0], linewidth=0.8)  # type: ignore[union-attr]
            axes.axvline(moment, color=COLOURS[1], linewidth=0.8)
            axes.set(xlabel="time (µs)", ylabel="force on the\nstructure (N)")
            axes.margins(x=0.0)
        return figure

    def pixels(self, number: int) -> NDArray[np.uint8]:
        """Return the figure at the time of this number, height × width × 3."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas: Any = FigureCanvasAgg(self.draw(number))
        canvas.draw()
        return np.array(canvas.buffer_rgba())[..., :3]


def round_number(value: float, up: bool = False) -> float:
    """Return the next number of 1, 2, 5, 10, ... below a positive one, or above it."""
    steps = np.outer(10.0 ** np.arange(np.floor(np.log10(value)) - 1.0, np.log10(value) + 2.0), (1.0, 2.0, 5.0)).ravel()
    return float(steps[steps >= value].min() if up else steps[steps <= value].max())


@contextmanager
def quiet() -> Iterator[None]:
    """Silence VTK where it tries windows that it cannot create; raise OSError where none is left: VTK ends Python."""
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
