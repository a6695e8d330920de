"""Pictures and animations of a `structure_motion` or a `bead_motion`, drawn off-screen."""

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.views.motion import known_motion
from structures.checks import finite, positive

Images = Iterable[NDArray[np.uint8]]

DOTS, MOVING_DOTS = 200, 110
"""Dots per inch of pictures and of animations."""

PALETTE, PAPER, INK, NEAR = 256, (255, 255, 255), (0, 0, 0), 8
"""Colours of a GIF: so many, with pure white and black among them and none near to these, which would replace them."""


def picture(
    motion: xr.Dataset,
    path: str | Path,
    time: float | None = None,
    show: str = "von_mises",
    factor: float | None = None,
    highest: float | None = None,
    run: xr.Dataset | None = None,
) -> Path:
    """Draw a `structure_motion` or `bead_motion` at its time nearest to `time` (s) into a .png, .pdf or .svg; its path.

    time: by default that of the greatest displacement. show: "von_mises"; "displacement", the size of the
    vector; or "deflection", its part into the struck face, with its sign.
    factor: how much larger than true the displacement is drawn; by default a round number, for a tenth of the body's
    shortest side; with 0 beads that touch do not overlap. highest: the upper end of the colours, Pa or m; by default a
    round number that 95 % of the body stays below. Give both to compare pictures. run: the Dataset that the motion is
    of; the force of its last bead on the structure, or those through the beads that are drawn, are then drawn beneath.
    Bodies of revolution are cut along their axis; long ones lie down, struck from the left. 3-D bodies are seen from
    outside, to scale. Grey lines: the section at rest; black ones: edges, and where materials meet.
    A file of the name is replaced, whole or not at all. Raises ValueError for a time or a name that is not there, and
    OSError where the machine has no OpenGL to draw with.
    """
    known_motion(motion)
    target = _target(path, (".png", ".pdf", ".svg"))
    number = _strongest(motion) if time is None else _nearest(motion, time)
    from coupling.views.drawing import Drawing

    with Drawing(motion.isel(time=[number]), show, factor, highest, DOTS, run) as drawing, _whole(target) as beside:
        drawing.draw(0).savefig(beside, dpi=DOTS)
    return target


def animation(
    motion: xr.Dataset,
    path: str | Path,
    show: str = "von_mises",
    factor: float | None = None,
    highest: float | None = None,
    frame_rate: float = 10.0,
    run: xr.Dataset | None = None,
) -> Path:
    """Draw all times of a `structure_motion` or `bead_motion` into a .gif, or an .mp4 (pip install "hertzlink[movie]").

    frame_rate: pictures per second. run: the Dataset that the motion is of; its force is then drawn beneath, with a
    line that moves on. Colours, factor and frame are the same in all, and suit them all; for the rest see `picture`.
    """
    known_motion(motion)
    target, rate = _target(path, (".gif", ".mp4")), positive("frame_rate", frame_rate, "1/s")
    write: Callable[[Path, Images, float], None] = _write_gif
    if target.suffix.lower() == ".mp4":
        if find_spec("imageio_ffmpeg") is None:
            raise ValueError(f'path = {str(path)!r}: .mp4 needs pip install "hertzlink[movie]"; .gif needs nothing')
        write = _write_mp4
    from coupling.views.drawing import Drawing

    with Drawing(motion, show, factor, highest, MOVING_DOTS, run) as drawing, _whole(target) as beside:
        write(beside, (drawing.pixels(number) for number in range(motion.sizes["time"])), rate)
    return target


def _write_gif(path: Path, images: Images, rate: float) -> None:
    """All frames in the colours of one palette, or they would flicker."""
    from PIL import Image

    frames = [Image.fromarray(image) for image in images]
    sample = Image.fromarray(np.concatenate([np.asarray(frame)[::2, ::2] for frame in frames]))
    found = sample.quantize(PALETTE - 2, method=Image.Quantize.MEDIANCUT).getpalette() or []
    colours = np.reshape(found, (-1, 3))
    colours = colours[(colours < 255 - NEAR).any(axis=1) & (colours > NEAR).any(axis=1)]
    palette = Image.new("P", (1, 1))
    palette.putpalette([*PAPER, *INK, *colours.ravel().tolist()])
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    flat[0].save(path, save_all=True, append_images=flat[1:], duration=round(1e3 / rate), loop=0, optimize=False)


def _write_mp4(path: Path, images: Images, rate: float) -> None:
    import imageio_ffmpeg  # type: ignore[import-not-found,import-untyped,unused-ignore]

    writer: Any = None
    for image in images:
        even = np.ascontiguousarray(image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2])
        if writer is None:
            size = even.shape[1], even.shape[0]
            writer = imageio_ffmpeg.write_frames(str(path), size, fps=rate, quality=8, macro_block_size=2)
            writer.send(None)
        writer.send(even)
    writer.close()


def _strongest(motion: xr.Dataset) -> int:
    size = np.linalg.norm(motion.displacement.values, axis=-1).max(axis=1)
    return int(np.argmax(size))


def _nearest(motion: xr.Dataset, time: float) -> int:
    """The number of the time nearest to `time`, which must lie among them."""
    moments, wanted = motion.time.values, finite("time", time, "s")
    spare = 0.5 * float(np.diff(moments).max()) if moments.size > 1 else 1e-6
    if not moments[0] - spare <= wanted <= moments[-1] + spare:
        raise ValueError(f"time = {time!r}: must lie between {moments[0]:.6g} and {moments[-1]:.6g} s, as the motion")
    return int(np.argmin(abs(moments - wanted)))


def _target(path: str | Path, suffixes: tuple[str, ...]) -> Path:
    """The path, or a ValueError where no such file can be written there."""
    if not isinstance(path, str | Path):
        raise ValueError(f"path = {path!r}: must be the name of a file")
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise ValueError(f"path = {str(path)!r}: must end in {' or '.join(suffixes)}")
    if not target.parent.is_dir() or target.is_dir():
        raise ValueError(f"path = {str(path)!r}: must be a file in a folder that is there")
    return target


@contextmanager
def _whole(target: Path) -> Iterator[Path]:
    """A file beside the target, which takes its place at the end, and is gone where that is not reached."""
    handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem}-", dir=target.parent)
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        beside.chmod(0o644)
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)
