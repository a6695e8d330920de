"""The figure around a rendered body: axes in mm or a scale bar, colour bar, time; imports matplotlib."""

from math import ceil
from types import TracebackType
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from coupling.plots.render import Renderer
from coupling.plots.scene import Scene, round_number
from coupling.results.reading import Reading
from structures.checks import not_negative, one_of, positive
from structures.structure import Vector
from structures.units import handy

QUANTITIES = {
    "von_mises": ("von Mises stress", "Pa", "viridis"),
    "displacement": ("displacement", "m", "viridis"),
    "deflection": ("deflection", "m", "RdBu_r"),
}
"""The quantities that can be shown: name, unit and colours. The colours of the deflection, which has a sign, are white
at zero.
"""

COLOURED_FRACTION = 0.95
"""The colour scale covers this fraction of the body, over all times. The stress at the contact is a hundred times that
of the waves; a scale up to it would make the waves invisible.
"""

COLOUR_ENDS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)

OVERSAMPLING = 2
"""The body is rendered at this multiple of the resolution of the figure."""

LINE, LETTERS = 0.8, 9.0
"""Width of lines and size of letters, points."""

WIDEST, HIGHEST, NARROWEST = 4.8, 3.8, 3.7
"""Inches: largest width and height of the body in a figure, and the least width of a figure, in which its
title fits.
"""

LEFT, RIGHT, ABOVE, BELOW = 0.75, 0.25, 0.42, 0.6
HISTORY_HEIGHT = 1.0
"""Height of the force history below the body, inches."""

ROW, COLUMN = 0.18, 0.85
"""Height and width of an entry of the legend, inches."""

LINE_STYLES = [
    {"color": colour, "linestyle": style}
    for style in ("-", "--", ":", "-.")
    for colour in ("#000000", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
]
"""Line styles in the colours of Okabe and Ito, which colour-blind readers can distinguish."""

BAR_GAP, BAR, BAR_TEXT = 0.2, 0.14, 0.75
"""Margins around the body, and the colour bar next to it or below it, inches."""


class Drawing:
    """A figure of a motion at one of its times, with the same colours, factor and frame at all times.

    show, factor, highest: see `picture`. dots: per inch. A context manager that releases the graphics at its end.
    """

    def __init__(
        self, motion: xr.Dataset, show: str, factor: float | None, highest: float | None, dots: int,
        run: xr.Dataset | None = None,
    ) -> None:  # fmt: skip
        one_of("show", show, QUANTITIES)
        self.history = None if run is None else _history(run, motion)
        self.now: Any = None
        self.motion, self.dots, self.kind = motion, dots, QUANTITIES[show]
        self.values = _values(motion, show)
        self.scene = Scene(motion, None if factor is None else not_negative("factor", factor))
        self.high = self._usual() if highest is None else positive("highest", highest, self.kind[1])
        self.low = -self.high if show == "deflection" else 0.0
        self.width = min(WIDEST, HIGHEST / self.scene.aspect)
        pixels, line = round(OVERSAMPLING * dots * self.width), OVERSAMPLING * LINE * dots / 72.0
        self.renderer = Renderer(self.scene, self.kind[2], (self.low, self.high), pixels, line)
        self.image: Any = None
        self.figure, self.axes = self._laid_out()

    def __enter__(self) -> "Drawing":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.renderer.close()

    def draw(self, number: int) -> Figure:
        """Return the figure at the time of this number."""
        picture = self.renderer.image(number, self.values[number])
        if self.image is None:
            self.image = self.axes.imshow(picture, extent=self._extent(), aspect="auto", interpolation="antialiased")
            self._label()
        self.image.set_data(picture)
        if self.now is not None:
            moment = 1e6 * float(self.motion.time[number])
            self.now.set_xdata([moment, moment])
        factor = self.scene.factor
        times = f"{factor:,.0f}".replace(",", "\N{THIN SPACE}") if factor >= 1e3 else f"{factor:g}"
        warp = f",  displacement × {times}" if factor > 0.0 else ""
        self.figure.texts[0].set_text(f"t = {1e6 * float(self.motion.time[number]):.1f} µs{warp}")
        return self.figure

    def pixels(self, number: int) -> NDArray[np.uint8]:
        """Return the figure at the time of this number, height × width × 3."""
        canvas: Any = FigureCanvasAgg(self.draw(number))
        canvas.draw()
        return np.array(canvas.buffer_rgba())[..., :3]

    def _usual(self) -> float:
        """Return a round number that COLOURED_FRACTION of the body does not exceed, or the largest value if it is close
        to it."""
        of_cells = abs(self.values[:, self.motion.cells.values].mean(axis=2))
        order, size = np.argsort(of_cells, axis=None), np.broadcast_to(self.scene.sizes(), of_cells.shape).ravel()
        passed = np.cumsum(size[order])
        usual = float(of_cells.ravel()[order[np.searchsorted(passed, COLOURED_FRACTION * passed[-1])]])
        greatest = float(abs(self.values).max())
        if not greatest > 0.0:
            return 1.0
        return greatest if usual > 0.5 * greatest else round_number(usual, up=True, ladder=COLOUR_ENDS)

    def _laid_out(self) -> tuple[Figure, Any]:
        """Return the figure, with a colour bar on the right, or below a wide body."""
        height, wide = self.width * self.scene.aspect, self.scene.aspect < 0.6
        names = [] if self.history is None else self.history[3]
        columns = max(1, int(self.width / COLUMN))
        legend = ROW * ceil(len(names) / columns)
        beneath = 0.0 if self.history is None else HISTORY_HEIGHT + BELOW + legend
        left, below = LEFT, BELOW + (BAR + BELOW if wide else 0.0) + beneath
        bar_side = RIGHT if wide else BAR_GAP + BAR + BAR_TEXT
        total = max(NARROWEST, left + self.width + bar_side), below + height + ABOVE
        left += (total[0] - left - self.width - bar_side) / 2.0
        figure = Figure(figsize=total, dpi=self.dots)

        def axes(x: float, y: float, width: float, tall: float) -> Any:
            return figure.add_axes((x / total[0], y / total[1], width / total[0], tall / total[1]))

        place = axes(left, below, self.width, height)
        bar = (
            axes(left, BELOW + beneath, self.width, BAR)
            if wide
            else axes(left + self.width + BAR_GAP, below, BAR, height)
        )
        factor, unit = handy([5.0 * self.high], self.kind[1])  # in which the highest value is 0.2 or more
        above, below_it = self.values.max() > self.high * (1.0 + 1e-9), self.values.min() < self.low * (1.0 + 1e-9)
        ends = {(True, True): "both", (True, False): "max", (False, True): "min"}
        extend = ends.get((bool(above), bool(below_it)), "neither")
        colours = ScalarMappable(Normalize(self.low * factor, self.high * factor), self.kind[2])
        orientation = "horizontal" if wide else "vertical"
        shown = figure.colorbar(colours, cax=bar, extend=extend, extendfrac=0.04, orientation=orientation)
        shown.set_label(f"{self.kind[0]} ({unit})", fontsize=LETTERS)
        shown.ax.tick_params(labelsize=LETTERS - 1.0)
        if self.history is not None:
            self._draw_history(axes(left, BELOW + legend, self.width, HISTORY_HEIGHT), columns, *self.history)
        figure.text(0.5, 1.0 - 0.5 * ABOVE / total[1], "", ha="center", va="center", fontsize=LETTERS)
        return figure, place

    def _draw_history(self, axes: Any, columns: int, time: Vector, force: Vector, name: str, names: list[str]) -> None:
        for number, trace in enumerate(force.reshape(time.size, -1).T):
            label = names[number] if names else None
            axes.plot(time, trace, linewidth=LINE, label=label, **LINE_STYLES[number % len(LINE_STYLES)])
        if names:
            axes.legend(
                ncols=min(columns, len(names)), loc="upper center",
                bbox_to_anchor=(0.5, -0.85 * BELOW / HISTORY_HEIGHT),
                borderaxespad=0.0, borderpad=0.0, labelspacing=0.3, columnspacing=1.0, handlelength=1.5, frameon=False,
                fontsize=LETTERS - 1.0,
            )  # fmt: skip
        self.now = axes.axvline(time[0], color="#D55E00", linewidth=LINE)
        axes.set_xlabel("time (µs)", fontsize=LETTERS)
        axes.set_ylabel(name, fontsize=LETTERS)
        axes.tick_params(labelsize=LETTERS - 1.0)
        axes.margins(x=0.0)

    def _extent(self) -> tuple[float, ...]:
        """Return the left, right, bottom, top of the image, mm; in an upright section the last two are depths."""
        left, right, bottom, top = (1e3 * end for end in self.scene.extent)
        return (left, right, -bottom, -top) if self.scene.flat and not self.scene.lying else (left, right, bottom, top)

    def _label(self) -> None:
        axes, scene = self.axes, self.scene
        if not scene.flat:
            self._scale()
            return
        depth = f"{self.motion.attrs.get('depth', 'depth')} (mm)"
        along, up = (depth, "r (mm)") if scene.lying else ("r (mm)", depth)
        axes.set_xlabel(along, fontsize=LETTERS)
        axes.set_ylabel(up if scene.stretch == 1.0 else f"{up}\ndrawn × {scene.stretch:g}", fontsize=LETTERS)
        axes.tick_params(labelsize=LETTERS - 1.0)
        for name, axis, inches in (("x", axes.xaxis, self.width), ("y", axes.yaxis, self.width * scene.aspect)):
            axes.locator_params(axis=name, nbins=max(2, min(8, int(inches / 0.4))))
            if "r" in axis.get_label_text()[:1]:
                axis.set_major_formatter(lambda value, _: f"{abs(value):g}")

    def _scale(self) -> None:
        """Draw a bar of a round length below a 3-D body, in place of axes."""
        self.axes.set_axis_off()
        left, right, bottom, top = self._extent()
        length, low = round_number(0.3 * (right - left)), bottom - 0.08 / (self.width / (right - left))
        start = (left + right - length) / 2.0
        bar = {"color": "black", "linewidth": 2.0, "clip_on": False, "solid_capstyle": "butt"}
        self.axes.plot([start, start + length], [low, low], **bar)
        self.axes.annotate(
            f"{length:g} mm", ((left + right) / 2.0, low), (0.0, -4.0), textcoords="offset points", ha="center",
            va="top", fontsize=LETTERS, annotation_clip=False,
        )  # fmt: skip
        self.axes.set(xlim=(left, right), ylim=(bottom, top))


def _values(motion: xr.Dataset, show: str) -> Vector:
    """Return the values that are shown, times × points; the deflection is the displacement into the struck face."""
    if show == "von_mises":
        return np.asarray(motion.von_mises.values, dtype=float)
    vectors = np.asarray(motion.displacement.values, dtype=float)
    if show == "deflection":
        return np.asarray(-vectors @ np.array(motion.attrs["up"]))
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _history(run: xr.Dataset, motion: xr.Dataset) -> tuple[Vector, Vector, str, list[str]]:
    """Return the time (µs) and force, from the start of the run to the end of the motion; names of the force and of its
    columns.

    The force, N, of the last bead relative to the preload, or through the beads that are drawn, one column each.
    """
    if "bead" in motion.coords:
        drawn = np.unique(motion.bead)
        if "section_force" not in run or set(run.section_force.dims) != {"time", "bead"} or drawn[-1] >= run.bead.size:
            raise ValueError("run: must be the Dataset of one run, that of the beads' motion")
        names = [f"bead {number}" for number in drawn]
        return *_until(run.section_force.isel(bead=drawn), motion), "force through\nthe beads (N)", names
    reading = Reading(run, "the Dataset of a run")
    forces = reading.dynamic_force()
    reading.check_one_chain("contact_force")
    force = forces.isel(contact=reading.beads[0])
    return *_until(force, motion), "force on the\nstructure (N)", []


def _until(force: xr.DataArray, motion: xr.Dataset) -> tuple[Vector, Vector]:
    """Return the time (µs) and force up to the last time of the motion; the whole run for a motion of one time."""
    shown = force.sel(time=slice(None, max(float(motion.time[-1]), 2.0 * float(force.time[1]))))
    if motion.sizes["time"] == 1:
        shown = force
    return np.asarray(1e6 * shown.time.values), np.asarray(shown.values)
