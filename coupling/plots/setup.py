"""A sketch of a set-up to scale: chain, contact and structure from the side, and a plate seen along the chain."""

import json
import re
from collections.abc import Mapping
from math import cos
from typing import TYPE_CHECKING, Any

import xarray as xr

from coupling.plots.canvas import INK, ROW, SMALL, axes_for, legend_texts, resized, width_of
from coupling.plots.setup_structures import Drawn, front_view, half_height, side_view
from coupling.plots.swept import varied, words_of
from coupling.results.provenance import stored
from coupling.results.schema import END_NAMES
from structures.checks import count_of, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_BEADS, FIRST_BEADS, LAST_BEADS = 30, 6, 12
"""A chain of more beads is drawn without its middle."""

BEAD_COLOURS = ("#c9d6e2", "#e8dcc5", "#d5e3d0", "#e5d0dc")
"""The colours of different beads."""

SKETCH_WIDTH, EDGE = 7.2, 0.12
"""Usual width of a sketch, and that of its margin, inches."""

LAST, FIRST = END_NAMES

LONG = ("Cylinder", "Ellipsoid")
"""Beads with a length."""

CAPITAL = re.compile(r"(?<!^)([A-Z])")
"""Where the name of a class has a new word."""


def setup(run: Any, ax: "Axes | None" = None) -> "Axes":
    """Draw the set-up of a run to scale: striker, beads, structure with its layers or its outline, and supports.

    Parameters
    ----------
    run : CoSimulation or Dataset
        Before or after it has run. Of a sweep, its first run is drawn.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Lengths in mm. Chains of more than 30 beads are drawn without their middle. A plate is drawn from its side, and
        as seen along the chain, with its edges, additions and the points that chains touch.

    Raises
    ------
    ValueError
        For a Dataset that does not hold the input of a run, such as a measured signal.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])
    >>> axes = hl.plots.setup(hl.CoSimulation(chain, rod))
    >>> print(axes.get_legend().get_texts()[-2].get_text())
    PTFE, 25.4 mm long, radius 9.525 mm
    """
    rows = _rows(described_input(run))
    ax = axes_for(ax, SKETCH_WIDTH)
    drawn = Drawn(ax)
    for name, values in varied(run).items() if isinstance(run, xr.Dataset) else ():
        drawn.note(f"varied, drawn is the first run: {words_of(run[name])}, {values}")
    bottom = 0.0
    for row in rows:
        bottom = _draw_row(drawn, row, bottom) - 6.0
    _scale_bar(drawn, bottom)
    ax.set_aspect("equal")
    ax.set_axis_off()
    _laid_out(drawn)
    return ax


def _laid_out(drawn: Drawn) -> None:
    """Put the legend below; a figure of ours becomes as high as sketch and legend."""
    ax, (handles, labels) = drawn.ax, drawn.legend()
    ax.relim(visible_only=True)
    ax.autoscale_view()
    (left, right), (low, top) = ax.get_xlim(), ax.get_ylim()
    width = width_of(ax)
    sketch = (width - 2.0 * EDGE) * (top - low) / (right - left)
    texts, rows = legend_texts(ax, labels)
    under = ROW * rows + EDGE
    total = sketch + under + 3.0 * EDGE
    if resized(ax, total):
        ax.get_figure().set_layout_engine("none")  # type: ignore[union-attr]
        ax.set_position((EDGE / width, (under + EDGE) / total, 1.0 - 2.0 * EDGE / width, sketch / total))
    ax.legend(
        handles, texts, loc="upper left", bbox_to_anchor=(0.0, -EDGE / sketch), frameon=False, fontsize=SMALL,
        borderaxespad=0.0,
    )  # fmt: skip


def described_input(run: Any, name: str = "run") -> dict[str, Any]:
    """Return the input of a run as plain data: chains, structures and contacts; raise a ValueError where it is not
    known.

    name: what an error calls the argument.
    """
    if not isinstance(run, xr.Dataset | type) and callable(getattr(run, "describe", None)) and hasattr(run, "scheme"):
        # By JSON, so that what is drawn is the same before and after a run.
        return dict(json.loads(json.dumps(run.describe(), default=repr)))
    text = run.attrs.get("input", "") if isinstance(run, xr.Dataset) else None
    if text is None:
        raise ValueError(f"{name} = {short(run)}: must be a CoSimulation, or the Dataset of its run")
    inputs = stored(text)
    inputs = inputs if _has_chain(inputs) else stored(inputs.get("first_run", ""))
    if not _has_chain(inputs):
        raise ValueError(f"{name}: does not hold the input of a run; must be a CoSimulation, or the Dataset of its run")
    return inputs


def _has_chain(inputs: Mapping[str, Any]) -> bool:
    chains = inputs.get("chains", [inputs.get("chain")])
    return bool(chains) and all(isinstance(chain, Mapping) and chain.get("beads") for chain in chains)


def _rows(inputs: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return for each chain what it faces: the chain, and the structure and its contact point at either end."""
    if "chain" in inputs:
        return [{"chain": inputs["chain"], LAST: (inputs.get("structure"), 0)}]
    rows: list[dict[str, Any]] = [{"chain": chain, "name": f"chain {i}"} for i, chain in enumerate(inputs["chains"])]
    for chain, end, structure, point in inputs.get("contacts", []):
        row = rows[int(chain)]
        row[LAST if end in (0, LAST) else FIRST] = (inputs["structures"][int(structure)], int(point))
        row["name"] += f", contact {point} of structure {structure}"
    return rows


def _draw_row(drawn: Drawn, row: Mapping[str, Any], top: float) -> float:
    """Draw one chain and what it faces, below `top`; return the lowest y, mm."""
    chain = row["chain"]
    high = 0.5 * max(_size(bead)[1] for bead in chain["beads"])
    last, first = (row.get(end, (None, 0)) for end in (LAST, FIRST))
    high = max([high, *(half_height(structure) for structure, _ in (last, first) if structure is not None)])
    y = top - high
    if row.get("name"):
        y -= 9.0
    x = _draw_beads(drawn, chain["beads"], y)
    if row.get("name"):
        drawn.text(x, top - 1.0, str(row["name"]), ha="left", va="top")
    if first[0] is None:
        _draw_striker(drawn, chain, x, y)
    else:
        side_view(drawn, first[0], x, y, mirrored=True)
    if last[0] is None:
        drawn.note("the last bead faces nothing")
        return y - high
    right = side_view(drawn, last[0], 0.0, y)
    return min(y - high, front_view(drawn, last[0], last[1], right, y, top))


def _draw_beads(drawn: Drawn, beads: list[Any], y: float) -> float:
    """Draw the beads, whose last one ends at x = 0; return the x of the struck end, mm."""
    from matplotlib.patches import Circle, Ellipse, Rectangle

    kinds: dict[str, int] = {}
    for bead in beads:
        kinds[_words(bead)] = kinds.get(_words(bead), 0) + 1
    left_out = len(beads) - FIRST_BEADS - LAST_BEADS if len(beads) > MOST_BEADS else 0
    shown = beads if not left_out else beads[:FIRST_BEADS] + beads[-LAST_BEADS:]
    for words, count in kinds.items():
        drawn.named(f"{count} × {words}")
    x = 0.0
    for place, bead in enumerate(reversed(shown)):
        if left_out and place == LAST_BEADS:
            gap = 2.0 * _size(bead)[0]
            dots = [x - share * gap for share in (0.25, 0.5, 0.75)]
            mark: dict[str, Any] = {"color": INK, "marker": ".", "markersize": 3.0, "linestyle": "none"}
            drawn.line(dots, [y] * 3, count_of(left_out, "bead that is not drawn", "beads that are not drawn"), **mark)
            x -= gap
        width, tall = _size(bead)
        middle = (x - 0.5 * width, y)
        words = _words(bead)
        colour = BEAD_COLOURS[list(kinds).index(words) % len(BEAD_COLOURS)]
        look: dict[str, Any] = {"facecolor": colour, "edgecolor": INK, "linewidth": 0.6}
        if bead.get("class") == "Cylinder" and abs(cos(bead.get("angle") or 0.0)) > 0.5:  # its side is seen
            shape: Any = Rectangle((x - width, y - 0.5 * tall), width, tall, **look)
        else:
            shape = Ellipse(middle, width, tall, **look)
        drawn.add(shape, f"{kinds[words]} × {words}")
        if bead.get("inner_radius"):
            drawn.add(Circle(middle, 1e3 * bead["inner_radius"], facecolor="white", edgecolor=INK, linewidth=0.4))
        x -= width
    return x


def _draw_striker(drawn: Drawn, chain: Mapping[str, Any], x: float, y: float) -> None:
    """Draw the body that strikes the first bead, left of it, with an arrow."""
    from matplotlib.patches import Ellipse

    striker, speed = chain.get("striker"), chain.get("impact_speed")
    moves = "" if not speed else f", {float(speed):.3g} m/s"
    gap = 0.6 * _size(chain["beads"][0])[0]
    body = striker.get("striker", striker) if isinstance(striker, Mapping) else None
    width = tall = 0.0
    if isinstance(body, Mapping) and ("radius" in body or "size" in body):
        width, tall = _size(body)
        middle = (x - gap - 0.5 * width, y)
        shape = Ellipse(middle, width, tall, facecolor="#f2b38a", edgecolor=INK, linewidth=0.6)
        drawn.add(shape, f"striker: {_words(body)}{moves}")
    elif striker is not None:
        drawn.arrow((x - 2.0 * gap, y), (x, y), "pushed: a force or a place over time")
        return
    if striker is None:
        drawn.arrow((x - 2.0 * gap, y), (x, y), f"first bead starts{moves}")
    else:
        above = y + 0.5 * tall + 2.0
        drawn.arrow((x - gap - width, above), (x, above))


def _size(bead: Mapping[str, Any]) -> tuple[float, float]:
    """Return the width along the chain and height across it, mm."""
    size = bead.get("size")
    wide = 2e3 * float(bead.get("radius") or 0.5 * float(size or 0.01))
    if bead.get("class") not in LONG:
        return wide if size is None else 1e3 * float(size), wide
    length, angle = 1e3 * float(bead["length"]), float(bead.get("angle") or 0.0)
    if bead.get("axis") == "along":
        return length, wide
    return wide, max(wide, length * abs(cos(angle)))


def _words(bead: Mapping[str, Any]) -> str:
    """Return a bead in words: kind, size and material."""
    material, kind = bead.get("material"), str(bead.get("class", "bead")).rpartition(".")[2]
    of = material.get("name") if isinstance(material, Mapping) else None
    words = [CAPITAL.sub(r" \1", kind).lower()]
    if "size" in bead or "radius" in bead:
        words.append(f"{1e3 * float(bead.get('size') or 2.0 * bead['radius']):.4g} mm")
    if kind in LONG:
        words[-1] += f" × {1e3 * bead['length']:.4g} mm"
    if kind == "HollowSphere":
        words.append(f"wall {1e3 * (bead['radius'] - bead['inner_radius']):.3g} mm")
    return ", ".join([*words, of] if of else words)


def _scale_bar(drawn: Drawn, y: float) -> None:
    """Draw a bar of a round length below the sketch, left."""
    drawn.ax.autoscale_view()
    left, right = drawn.ax.get_xlim()
    length = next((mm for mm in (500.0, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0) if mm < 0.25 * (right - left)), 1.0)
    drawn.ax.plot([left, left + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt")
    drawn.text(left + length, y, f" {length:g} mm", ha="left", va="center")
