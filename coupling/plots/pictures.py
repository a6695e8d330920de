"""Files of a `motion`: pictures and animations, drawn off-screen, and ParaView's."""

import re
from base64 import b64encode
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.files.loading import file_to_write
from coupling.files.writing import whole_file_by_name, whole_folder
from coupling.plots.motion import known_motion
from structures.checks import finite, positive

Images = Iterable[NDArray[np.uint8]]

PICTURE_DPI, ANIMATION_DPI = 200, 110
"""Dots per inch of pictures and of animations."""

PALETTE, PAPER, INK, NEAR = 256, (255, 255, 255), (0, 0, 0), 8
"""Colours of a GIF: their number, with pure white and black among them, and no other colour close to these two, which
would replace them.
"""

LISTING = "motion.pvd"
OWN_FILES = re.compile(r"motion(_\d+)?\.(vtu|pvd)")

KINDS = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml"}
"""Media types by suffix."""

if TYPE_CHECKING:
    System = Path
else:
    # Before Python 3.12 only the path of the system can have subclasses.
    System = type(Path())


class NotebookPath(System):
    """A path that shows its file where it is the last line of a notebook's cell."""

    def _repr_html_(self) -> str | None:
        kind = KINDS.get(self.suffix.lower())
        if kind is None or not self.is_file():
            return None
        source = f"data:{kind};base64,{b64encode(self.read_bytes()).decode()}"
        return f'<img style="max-width:100%" alt="{self.stem}" src="{source}">'


def picture(
    motion: xr.Dataset,
    path: str | Path,
    time: float | None = None,
    show: str = "von_mises",
    factor: float | None = None,
    highest: float | None = None,
    run: xr.Dataset | None = None,
    frame_rate: float = 10.0,
) -> Path:
    """Draw a `motion` at one time, or all of it as an animation.

    Bodies of revolution are cut along their axis; long ones are drawn horizontally, struck from the left. 3-D bodies
    are drawn to scale, from outside. Grey lines: the section at rest. Black lines: edges, and interfaces of materials.
    An existing file of the name is replaced, completely or not at all.

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    path : str or Path
        A .png, .pdf or .svg file of one time; or a .gif, an animation of all times.
    time : float, optional
        Time of a picture, s; the nearest time of the motion is drawn. By default that of the largest displacement.
    show : {"von_mises", "displacement", "deflection"}
        The colours: von Mises stress, the magnitude of the displacement, or its signed component into the struck face.
    factor : float, optional
        Magnification of the displacement. By default a round number that makes it a tenth of the shortest side of the
        body. With 0, beads in contact do not overlap.
    highest : float, optional
        Upper end of the colour scale, Pa or m. By default a round number that 95 % of the body does not exceed, at all
        times that are drawn. Give `factor` and `highest` to compare pictures.
    run : xarray.Dataset, optional
        The run of the motion. The force of its last bead on the structure, or the forces through the drawn beads, are
        then drawn below, in an animation with a moving line at the time of the picture.
    frame_rate : float
        Pictures of an animation per second.

    Returns
    -------
    Path
        The path of the file. A notebook shows what it holds.

    Raises
    ------
    ValueError
        For a time outside the motion, a wrong name, or a time for an animation.
    OSError
        If the machine has no OpenGL for drawing.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[4e-6, 5e-6], beads=[1])
    >>> float(motion.von_mises.max()) > 1e6
    True
    >>> hl.plots.picture(motion, "body.png", time=5e-6)  # doctest: +SKIP
    NotebookPath('body.png')
    >>> hl.plots.picture(motion, "body.gif", frame_rate=5.0)  # doctest: +SKIP
    NotebookPath('body.gif')
    """
    known_motion(motion)
    target, rate = file_to_write("path", path, SUFFIXES), positive("frame_rate", frame_rate, "1/s")
    animated, dots = target.suffix.lower() == ".gif", ANIMATION_DPI
    if not animated:
        size = np.linalg.norm(motion.displacement.values, axis=-1).max(axis=1)
        number = int(size.argmax()) if time is None else _nearest(motion, time)
        motion, dots = motion.isel(time=[number]), PICTURE_DPI
    elif time is not None:
        raise ValueError(f"time = {time!r}: must be None for an animation, {target.suffix}, which shows all times")
    from coupling.plots.drawing import Drawing

    with Drawing(motion, show, factor, highest, dots, run) as drawing, whole_file_by_name(target) as part:
        if animated:
            _write_gif(part, (drawing.pixels(number) for number in range(motion.sizes["time"])), rate)
        else:
            drawing.draw(0).savefig(part, dpi=dots)
    return NotebookPath(path)


def _write_gif(path: Path, images: Images, rate: float) -> None:
    """Write frames that share the colours of one palette; otherwise they would flicker."""
    from PIL import Image

    frames = [Image.fromarray(image) for image in images]
    sample = Image.fromarray(np.concatenate([np.asarray(frame)[::2, ::2] for frame in frames]))
    levels = sample.quantize(PALETTE - 2, method=Image.Quantize.MEDIANCUT).getpalette() or []
    colours = np.reshape(levels, (-1, 3))
    colours = colours[(colours < 255 - NEAR).any(axis=1) & (colours > NEAR).any(axis=1)]
    palette = Image.new("P", (1, 1))
    palette.putpalette([*PAPER, *INK, *colours.ravel().tolist()])
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    flat[0].save(path, save_all=True, append_images=flat[1:], duration=round(1e3 / rate), loop=0, optimize=False)


SUFFIXES = (".png", ".pdf", ".svg", ".gif")


def _nearest(motion: xr.Dataset, time: float) -> int:
    """Return the number of the time nearest to `time`, which must lie within the motion."""
    moments, wanted = motion.time.values, finite("time", time, "s")
    spare = 0.5 * float(np.diff(moments).max()) if moments.size > 1 else 1e-6
    if not moments[0] - spare <= wanted <= moments[-1] + spare:
        raise ValueError(f"time = {time!r}: must lie between {moments[0]:.6g} and {moments[-1]:.6g} s, as the motion")
    return int(np.argmin(abs(moments - wanted)))


def write_vtu(motion: xr.Dataset, folder: str | Path) -> Path:
    """Write a `motion` for ParaView: motion_0000.vtu, ... and motion.pvd.

    The files hold displacement (m), von Mises stress and, for beads, the stress components (Pa), and for each cell its
    part. Cells stay quadratic. A body of revolution is written as its half-plane (r, 0, −z).

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    folder : str or Path
        The folder to write, completely or not at all. A folder that holds only an earlier motion is replaced.

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
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[4e-6, 5e-6], beads=[1])
    >>> hl.plots.write_vtu(motion, "paraview").name
    'motion.pvd'
    """
    import meshio  # type: ignore[import-untyped]

    known_motion(motion)
    target = _folder(folder)
    with whole_folder(target, lambda path: bool(OWN_FILES.fullmatch(path.name))) as temporary:
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        cells, parts = [(motion.attrs["cell_type"], motion.cells.values)], {"part": [motion.part.values]}
        for number, moment in enumerate(motion.time.values.tolist()):
            fields = {name: motion[name].values[number] for name in ("displacement", "von_mises")}
            for which in motion.stress_component.values if "stress" in motion else ():
                fields[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            meshio.Mesh(motion.position.values, cells, fields, parts).write(temporary / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(moment), part="0", file=name)
        ElementTree.indent(listing)
        ElementTree.ElementTree(listing).write(temporary / LISTING, encoding="utf-8", xml_declaration=True)
    return Path(folder) / LISTING


def _folder(folder: str | Path) -> Path:
    """Return the folder; raise a ValueError if it cannot be written."""
    if not isinstance(folder, str | Path):
        raise ValueError(f"folder = {folder!r}: must be the name of a folder")
    place = Path(folder).resolve()
    if not place.parent.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: its parent folder does not exist")
    if place.exists():
        foreign = (
            [] if not place.is_dir() else [path.name for path in place.iterdir() if not OWN_FILES.fullmatch(path.name)]
        )
        if not place.is_dir() or foreign or place == Path.cwd() or place in Path.cwd().parents:
            held = f"holds {foreign[0]}" if foreign else "is no folder of an earlier motion"
            raise ValueError(f"folder = {str(folder)!r}: {held}; name another")
    return place
