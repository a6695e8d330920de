"""A sketch of a set-up to scale: chain, contact and structure from the side, and a plate seen along the chain.

Lengths are in mm. What is drawn is the description of a run, as its Dataset holds it.
"""

import json
import re
from collections import Counter
from collections.abc import Mapping
from math import cos, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS, INK, PALE, ROW, SMALL, axes_for, legend_below, plain
from coupling.plots.swept import varied, words_of
from coupling.results.provenance import stored
from coupling.results.schema import FIRST, LAST
from structures.checks import count_of, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Described = Mapping[str, Any]

BEAD_COLOURS = ("#c9d6e2", "#e8dcc5", "#d5e3d0", "#e5d0dc", "#c3b8a6", "#b8ccc6")  # of named kinds; others are white
LAYER_COLOURS = ("#9fb4c7", "#f0e2b6", "#c7a58f", "#b5cda3", "#cdb7d6", "#d9d9d9")
SPACE = 26.0  # drawn depth and half-height of what has no ends
LENGTHS = (500.0, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0)  # of the scale

EDGES = {
    "clamped": {"color": INK, "linewidth": 3.0, "linestyle": "-"},
    "simple": {"color": COLOURS[0], "linewidth": 2.0, "linestyle": "--"},
    "soft simple": {"color": COLOURS[5], "linewidth": 2.0, "linestyle": "--"},
    "symmetry": {"color": COLOURS[3], "linewidth": 1.5, "linestyle": "-."},
    "elastic": {"color": COLOURS[2], "linewidth": 2.0, "linestyle": ":"},
    "free": {"color": PALE, "linewidth": 0.9, "linestyle": "-"},
}
"""How an edge of each support is drawn."""


def setup(run: Any, ax: "Axes | None" = None) -> "Axes":
    """Draw the set-up of a run to scale: striker, beads, structure with its layers or its outline, and supports.

    A plate is drawn from its side, and as seen along the chain, with its edges and additions.

    Parameters
    ----------
    run : CoSimulation or Dataset
        Before or after it has run. Of a sweep, its first run is drawn.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Lengths in mm.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])
    >>> axes = hl.plots.setup(hl.CoSimulation(hl.Chain([bead] * 16, bead, impact_speed=0.44), rod))
    >>> print(axes.get_legend().get_texts()[-2].get_text())
    PTFE, 25.4 mm long, radius 9.525 mm
    """
    inputs = described_input(run)
    sketch = Sketch(axes_for(ax, width=7.2))
    for name, values in varied(run).items() if isinstance(run, xr.Dataset) else ():
        sketch.note(f"varied, drawn is the first run: {words_of(run[name])}, {values}")
    chains = inputs.get("chains") or [inputs["chain"]]
    structures = inputs.get("structures") or [inputs.get("structure")]
    contacts = [tuple(map(int, contact)) for contact in inputs.get("contacts", [(0, LAST, 0, 0)])]
    # A row for each chain, whose last bead ends at x = 0; a plate is seen from the front in its first row alone.
    top, fronts = 0.0, set[int]()
    for number, chain in enumerate(chains):
        faced = {end: (place, structures[place]) for of, end, place, _ in contacts if of == number}
        half = max(0.5 * size_of(bead)[1] for bead in chain["beads"])
        half = max(half, *(half_height(structure) for _, structure in faced.values()))
        y = top - half - (9.0 if len(chains) > 1 else 0.0)
        start = draw_chain(sketch, chain, y, FIRST not in faced)
        if len(chains) > 1:
            ends = (f"contact {point} of structure {place}" for of, _, place, point in contacts if of == number)
            sketch.text(start, top - 5.0, ", ".join([f"chain {number}", *ends]))
            sketch.line([start], [top], linestyle="none")
        if FIRST in faced:
            draw_side(sketch, faced[FIRST][1], start, y, -1.0)
        row, top = top, y - half - 6.0
        place, structure = faced.get(LAST, (0, None))
        if structure is None:
            sketch.note("the last bead faces nothing")
            continue
        far = draw_side(sketch, structure, 0.0, y, 1.0)
        if isinstance(structure, Mapping) and "thickness" in structure and place not in fronts:
            fronts.add(place)
            touching = {point: of for of, end, at, point in contacts if (end, at) == (LAST, place)}
            top = min(top, draw_front(sketch, structure, touching, far + 12.0, y, row) - 6.0)

    ax = sketch.ax
    ax.set_aspect("equal", anchor="N")
    ax.set_axis_off()
    ax.autoscale_view()
    left, right = ax.get_xlim()
    length = next((mm for mm in LENGTHS if mm < 0.25 * (right - left)), 1.0)
    sketch.line([left, left + length], [top, top], color=INK, linewidth=2.0, solid_capstyle="butt")
    sketch.text(left + length, top, f" {length:g} mm")
    ax.margins(0.02)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    width = float(ax.get_figure(root=True).get_figwidth())  # type: ignore[union-attr]
    legend_below(ax, "", sketch.entries, 3.0 * ROW + width * (high - low) / (right - left), 0.5 * ROW)
    return ax


def described_input(run: Any, name: str = "run") -> dict[str, Any]:
    """Return the input of a run as plain data; a ValueError where it is not known. name: of the argument."""
    if not isinstance(run, xr.Dataset | type) and callable(getattr(run, "describe", None)) and hasattr(run, "scheme"):
        # By JSON, so that what is drawn is the same before and after a run.
        return dict(json.loads(json.dumps(run.describe(), default=repr)))
    if not isinstance(run, xr.Dataset):
        raise ValueError(f"{name} = {short(run)}: must be a CoSimulation, or the Dataset of its run")
    inputs = stored(run.attrs.get("input", ""))
    for known in (inputs, stored(inputs.get("first_run", ""))):
        chains = known.get("chains", [known.get("chain")])
        if chains and all(isinstance(chain, Mapping) and chain.get("beads") for chain in chains):
            return known
    raise ValueError(f"{name}: does not hold the input of a run; must be a CoSimulation, or the Dataset of its run")


class Sketch:
    """The axes of a sketch, and the entries of its legend: handles by their words, each once."""

    def __init__(self, ax: "Axes") -> None:
        self.ax = ax
        self.entries: dict[str, Any] = {}

    def patch(self, patch: Any, words: str = "", **look: Any) -> None:
        patch.set(**{"facecolor": "white", "edgecolor": INK, "linewidth": 0.6, **look})
        self.ax.add_patch(patch)
        if words:
            self.entries.setdefault(words, patch)

    def block(self, x: float, ends: tuple[float, float], width: float, words: str, **look: Any) -> float:
        """Draw a rectangle from x on, between two heights; return the x of its far side."""
        from matplotlib.patches import Rectangle

        self.patch(Rectangle((min(x, x + width), ends[0]), abs(width), ends[1] - ends[0]), words, **look)
        return x + width

    def line(self, x: Any, y: Any, words: str = "", **look: Any) -> None:
        (line,) = self.ax.plot(x, y, **look)
        if words:
            self.entries.setdefault(words, line)

    def edge(self, x: Any, y: Any, kind: str, words: str) -> None:
        self.line(x, y, words, solid_capstyle="butt", **EDGES.get(kind, EDGES["elastic"]))

    def note(self, words: str) -> None:
        self.line([], [], words, linestyle="none")

    def text(self, x: float, y: float, words: str) -> None:
        self.ax.text(x, y, plain(words), fontsize=SMALL, color=INK, ha="left", va="center")

    def arrow(self, start: float, end: float, y: float, words: str = "") -> None:
        """Draw an arrow, which shows where something moves."""
        look = {"arrowstyle": "-|>", "color": COLOURS[1], "linewidth": 1.2}
        self.ax.annotate("", (end, y), (start, y), arrowprops=look)
        # An annotation does not count where limits are chosen.
        self.line([start, end], [y, y], linestyle="none")
        self.line([], [], words, color=COLOURS[1], marker=">", linestyle="none")


def draw_chain(sketch: Sketch, chain: Described, y: float, is_free: bool) -> float:
    """Draw a chain, which ends at x = 0, and what strikes it where it is free; return the x of its struck end."""
    from matplotlib.patches import Circle, Ellipse, Rectangle

    beads = chain["beads"]
    kinds = Counter(map(bead_in_words, beads))
    named = {words: f"{count} × {words}" for words, count in list(kinds.items())[: len(BEAD_COLOURS)]}
    faces = dict(zip(named, BEAD_COLOURS, strict=False))
    others = count_of(len(kinds) - len(named), "other kind of bead", "other kinds of beads")
    x = start = -sum(size_of(bead)[0] for bead in beads)
    for bead in beads:
        (width, height), words = size_of(bead), bead_in_words(bead)
        shape: Any = Ellipse((x + 0.5 * width, y), width, height)
        if bead.get("class") == "Cylinder" and abs(cos(bead.get("angle") or 0.0)) > 0.5:  # its side is seen
            shape = Rectangle((x, y - 0.5 * height), width, height)
        sketch.patch(shape, named.get(words, others), facecolor=faces.get(words, "white"))
        if bead.get("inner_radius"):
            sketch.patch(Circle((x + 0.5 * width, y), 1e3 * bead["inner_radius"]), linewidth=0.4)
        x += width

    # An arrow shows what strikes the first bead.
    striker, speed, gap = chain.get("striker"), chain.get("impact_speed"), 0.6 * size_of(beads[0])[0]
    moves = f", {float(speed):.3g} m/s" if speed else ""
    body = striker.get("striker", striker) if isinstance(striker, Mapping) else None
    if is_free and isinstance(body, Mapping) and ("radius" in body or "size" in body):
        width, height = size_of(body)
        shape = Ellipse((start - gap - 0.5 * width, y), width, height)
        sketch.patch(shape, f"striker: {bead_in_words(body)}{moves}", facecolor="#f2b38a")
        sketch.arrow(start - gap - width, start, y + 0.5 * height + 2.0)
    elif is_free:
        words = f"first bead starts{moves}" if striker is None else "pushed: a force or a place over time"
        sketch.arrow(start - 2.0 * gap, start, y, words)
    return start


def half_height(structure: Any) -> float:
    """Return how far a structure is drawn to either side of the chain."""
    data = structure if isinstance(structure, Mapping) else {}
    if data.get("layers"):
        return 1.2e3 * max(float(layer["radius"]) for layer in data["layers"])
    if data.get("kind") == "beam":
        return 1e3 * max(float(data["at"]), float(data["length"]) - float(data["at"]))
    return 0.0 if structure is None else SPACE


def draw_side(sketch: Sketch, structure: Any, x: float, y: float, sign: float) -> float:
    """Draw a structure from the side, whose face is at x, to the right or to the left; return its far end."""
    data: Described = structure if isinstance(structure, Mapping) else {"kind": str(structure)}
    kind, half = str(data.get("kind", "structure")), half_height(structure)
    ends = y - half, y + half
    of = f" of {material_of(data)}" if data.get("material") else ""
    if "thickness" in data:
        thick = 1e3 * float(data["thickness"])
        return sketch.block(x, ends, sign * thick, f"{kind}, {thick:.4g} mm{of}", facecolor=LAYER_COLOURS[0])
    if kind == "beam":
        # As thick as a rectangular section of its stiffness and mass.
        length, away, material = 1e3 * data["length"], 1e3 * data["at"], data["material"]
        area = data["mass_per_length"] / material["density"]
        thick = 1e3 * sqrt(12.0 * data["bending_stiffness"] / (material["youngs_modulus"] * area))
        words = f"beam{of}, {length:.4g} mm long, struck at {away:.4g} mm; thickness of a rectangular section"
        ends = y + away - length, y + away
        far = sketch.block(x, ends, sign * thick, words, facecolor=LAYER_COLOURS[0])
        for support, end in zip(data.get("supports") or (), ends[::-1], strict=False):
            sketch.edge([x, far], [end, end], str(support), f"end: {support}")
        return far
    if not data.get("layers"):
        words, hatch = (f"{kind}{of}", "//") if kind == "half-space" else (f"{kind}{of}, whose size is not known", "..")
        return sketch.block(x, ends, sign * SPACE, words, facecolor="#e6e6e6", edgecolor=PALE, hatch=hatch)

    lengths = dict[str, list[float]]()
    for layer in data["layers"]:
        lengths.setdefault(material_of(layer), []).append(1e3 * float(layer["length"]))
    for layer in data["layers"]:
        name, radius = material_of(layer), 1e3 * float(layer["radius"])
        words = f"{name}, {lengths[name][0]:.4g} mm long, radius {radius:.4g} mm"
        if len(lengths[name]) > 1:
            words = f"{name}, {len(lengths[name])} layers, together {sum(lengths[name]):.4g} mm long"
        face = LAYER_COLOURS[list(lengths).index(name) % len(LAYER_COLOURS)]
        x = sketch.block(x, (y - radius, y + radius), sign * 1e3 * float(layer["length"]), words, facecolor=face)
    base = str(data.get("base"))
    if base not in ("free", "contact", "None"):
        hatch = {"fixed": "////", "absorbing": "...."}.get(base, "++")
        sketch.block(x, ends, sign * 0.3 * half, f"base: {base}", hatch=hatch, linewidth=0.0)
    return x + sign * 0.3 * half


def draw_front(sketch: Sketch, plate: Described, touching: Mapping[int, int], x: float, y: float, top: float) -> float:
    """Draw a plate as seen along the chain, right of x, below `top`; return its lowest y.

    touching: the chain that touches each of its contact points.
    """
    contact: dict[str, Any] = {"color": COLOURS[1], "marker": "o", "linestyle": "none", "zorder": 4.0}
    # The outline and its holes, with the names of their edges.
    rings = list[tuple[Any, list[str]]]()
    if "corners" in plate:
        rings.append((plate["corners"], list(plate.get("edges") or ["edge"] * len(plate["corners"]))))
        rings += [(hole, [f"hole {k}"] * len(hole)) for k, hole in enumerate(plate.get("holes") or [], 1)]
    elif "length" in plate and "width" in plate:
        a, b = float(plate["length"]), float(plate["width"])
        rings.append(([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)], ["bottom", "right", "top", "left"]))
    else:
        away = 1e3 * float(plate.get("distance") or 0.0)
        sketch.block(x, (y - SPACE, y + SPACE), away + SPACE, "", facecolor="#eef1f4", linewidth=0.0)
        if away:
            kind = str(plate.get("edge", "free"))
            sketch.edge([x, x], [y - SPACE, y + SPACE], kind, f"edge: {kind}, {away:.4g} mm from the contact")
        beyond = f"the outline is in {plate['mesh']}" if "mesh" in plate else "the plate continues beyond the picture"
        sketch.line([x + (away or 0.5 * SPACE)], [y], f"contact; {beyond}", **contact)
        return y - SPACE

    corners = np.concatenate([ring for ring, _ in rings])
    low, (width, height) = corners.min(axis=0), 1e3 * np.ptp(corners, axis=0)
    factor = min(1.0, max(abs(sketch.ax.dataLim.x0), 100.0) / max(width, height))
    half = 0.5 * factor * height
    corner = np.array([x, min(y, top - half) - half])

    def at(*places: Any) -> tuple[Any, Any]:
        """Return x and y of places on the plate, m."""
        x, y = (corner + factor * 1e3 * (np.array(places) - low)).T
        return x, y

    for ring, names in rings:
        for name, start, end in zip(names, ring, [*ring[1:], ring[0]], strict=True):
            kind = (plate.get("supports") or {}).get(name, "free")
            kind = "elastic" if isinstance(kind, Mapping) else str(kind)
            sketch.edge(*at(start, end), kind, f"edge: {kind}")
    for addition in plate.get("additions") or []:
        if "region" in addition:
            left, right, bottom, upper = addition["region"]
            box = [(left, bottom), (right, bottom), (right, upper), (left, upper), (left, bottom)]
            sketch.line(*at(*box), "weakened region", color=COLOURS[3], linewidth=1.2, linestyle="--")
        elif "mass" in addition and "x" in addition:
            place = addition["x"], addition["y"]
            sketch.line(*at(place), "point mass", color=INK, marker="s", markersize=5.0, linestyle="none")
        elif "start" in addition and "end" in addition:
            sketch.line(*at(addition["start"], addition["end"]), "stiffener", color=COLOURS[3], linewidth=2.5)
    for point, place in enumerate(np.reshape(plate.get("at") or [], (2, -1)).T):
        of = f" of chain {touching[point]}" if point in touching and len(touching) > 1 else ""
        words = f"contact{of} at ({1e3 * place[0]:.4g}, {1e3 * place[1]:.4g}) mm"
        face = COLOURS[1] if point in touching else "white"
        sketch.line(*at(place), words if point in touching else "other contacts", **contact, markerfacecolor=face)
    scale = "" if factor == 1.0 else f", drawn × {factor:.2g}"
    sketch.note(f"right: seen along the chain, {width:.4g} × {height:.4g} mm{scale}")
    return float(corner[1])


def size_of(bead: Described) -> tuple[float, float]:
    """Return the width of a bead along the chain and its height across it."""
    radius, size = bead.get("radius"), bead.get("size")
    height = 2e3 * float(radius or 0.5 * float(size or 0.01))
    if bead.get("class") not in ("Cylinder", "Ellipsoid"):
        return 1e3 * float(size) if size else height, height
    length = 1e3 * float(bead["length"])
    if bead.get("axis") == "along":
        return length, height
    return height, max(height, length * abs(cos(bead.get("angle") or 0.0)))


def bead_in_words(bead: Described) -> str:
    """Return a bead in words: kind, size and material."""
    kind = str(bead.get("class", "bead")).rpartition(".")[2]
    words = [re.sub(r"(?<!^)([A-Z])", r" \1", kind).lower()]
    if "size" in bead or "radius" in bead:
        words.append(f"{1e3 * float(bead.get('size') or 2.0 * bead['radius']):.4g} mm")
    if kind in ("Cylinder", "Ellipsoid"):
        words[-1] += f" × {1e3 * bead['length']:.4g} mm" + " along the chain" * (bead.get("axis") == "along")
    if kind == "HollowSphere":
        words.append(f"wall {1e3 * (bead['radius'] - bead['inner_radius']):.3g} mm")
    return ", ".join([*words, material_of(bead)] if isinstance(bead.get("material"), Mapping) else words)


def material_of(data: Described) -> str:
    """Return the name of a material, or its modulus where it has none."""
    material = data.get("material")
    if not isinstance(material, Mapping):
        return "several plies" if material is None else "a material"
    if material.get("plies"):
        return ", ".join(dict.fromkeys(map(material_of, material["plies"])))
    if not material.get("name") and "youngs_modulus" in material:
        return f"E = {1e-9 * float(material['youngs_modulus']):.4g} GPa"
    return str(material.get("name") or "a material")
