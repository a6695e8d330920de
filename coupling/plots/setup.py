"""A sketch of a set-up to scale: chain, contact and structure from the side, and a plate seen along the chain.

Lengths are in mm. The sketch shows the description of a run that its Dataset holds.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from math import cos, sqrt
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, Rectangle

from coupling.cosimulation import CoSimulation
from coupling.plots.canvas import COLOURS, INK, PALE, ROW, SMALL, axes_for, legend_below, plain, round_number
from coupling.plots.swept import parameter, varied, words_of
from coupling.results.provenance import stored
from coupling.results.schema import FIRST, LAST
from structures.checks import count_of, short

Described = Mapping[str, Any]

BEAD_COLOURS = ("#c9d6e2", "#e8dcc5", "#d5e3d0", "#e5d0dc", "#c3b8a6", "#b8ccc6")  # of named kinds; others are white
LAYER_COLOURS = ("#9fb4c7", "#f0e2b6", "#c7a58f", "#b5cda3", "#cdb7d6", "#d9d9d9")
SPACE = 26.0  # drawn depth and half-height of bodies without ends
BASES = {"fixed": "////", "absorbing": "...."}  # hatches of the base of a rod

EDGES: dict[str, dict[str, Any]] = {
    "clamped": {"color": INK, "linewidth": 3.0, "linestyle": "-"},
    "simple": {"color": COLOURS[0], "linewidth": 2.0, "linestyle": "--"},
    "soft simple": {"color": COLOURS[5], "linewidth": 2.0, "linestyle": "--"},
    "symmetry": {"color": COLOURS[3], "linewidth": 1.5, "linestyle": "-."},
    "elastic": {"color": COLOURS[2], "linewidth": 2.0, "linestyle": ":"},
    "free": {"color": PALE, "linewidth": 0.9, "linestyle": "-"},
}
"""The line for an edge with each kind of support."""


def setup(run: Any, ax: Axes | None = None) -> Axes:
    """Draw the set-up of a run to scale: striker, beads, structure with its layers or its outline, and supports.

    A plate is drawn from its side, and as seen along the chain, with its edges and additions.

    Parameters
    ----------
    run : CoSimulation or Dataset
        A simulation, or the result of a run. For a sweep the first run is drawn.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Lengths in mm.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> axes = hl.plots.setup(hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.PTFE)))
    >>> print(axes.get_legend().get_texts()[-1].get_text())
    half-space of PTFE
    """
    inputs = described_input(run)
    ax = axes_for(ax, width=7.2)
    for name, values in varied(run).items() if isinstance(run, xr.Dataset) else ():
        first, (factor, unit) = run[name].values[0], parameter(run[name])
        first = f"{factor * first:.5g} {unit}".rstrip() if np.isreal(first) else first
        note(ax, f"drawn: {words_of(run[name])} {first}, the first of {values}")
    chains = inputs.get("chains") or [inputs["chain"]]
    structures: list[Any] = inputs.get("structures") or [inputs.get("structure")]
    structures = [{"kind": one} if isinstance(one, str) else one for one in structures]
    contacts = [tuple(map(int, contact)) for contact in inputs.get("contacts", [(0, LAST, 0, 0)])]
    # A row for each chain, whose last bead ends at x = 0; a plate is seen from the front in its first row alone.
    top, seen = 0.0, set[int]()
    for number, chain in enumerate(chains):
        faced = {end: place for of, end, place, _ in contacts if of == number}
        sides = {end: list(side_of(structures[place])) for end, place in faced.items() if structures[place] is not None}
        half = max(0.5 * size_of(bead)[1] for bead in chain["beads"])
        half = max([half, *(abs(up) + half for side in sides.values() for _, half, up, *_ in side)])
        y = top - half - 9.0 * (len(chains) > 1)
        start = draw_chain(ax, chain, y, FIRST not in sides)
        if len(chains) > 1:
            ends = (f"contact {point} of structure {place}" for of, _, place, point in contacts if of == number)
            letters(ax, start, top - 5.0, ", ".join([f"chain {number}", *ends]))
        if not sides.get(LAST):
            note(ax, "the last bead faces nothing")
        for end, x, sign in ((FIRST, start, -1.0), (LAST, 0.0, 1.0)):
            for width, high, up, words, look in sides.get(end, []):
                draw(ax, Rectangle((x, y + up - high), sign * width, 2.0 * high), words, **look)
                x += sign * width
        row, top = top, y - half - 6.0
        if LAST in sides and faced[LAST] not in seen and "thickness" in structures[faced[LAST]]:
            seen.add(faced[LAST])
            touching = {point: of for of, end, at, point in contacts if (end, at) == (LAST, faced[LAST])}
            top = min(top, draw_front(ax, structures[faced[LAST]], touching, x + 12.0, y, row) - 6.0)

    ax.set_aspect("equal", anchor="NW")
    ax.set_axis_off()
    ax.autoscale_view()
    left, right = ax.get_xlim()
    length = round_number(0.25 * (right - left))
    ax.plot([left, left + length], [top, top], color=INK, linewidth=2.0, solid_capstyle="butt")
    letters(ax, left + length, top, f" {length:g} mm")
    ax.margins(0.02)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    width = float(ax.get_figure(root=True).get_figwidth())  # type: ignore[union-attr]
    legend_below(ax, "", 1.5 * ROW + width * min(1.0, (high - low) / (right - left)), 0.5 * ROW)
    return ax


def described_input(run: Any, name: str = "run") -> dict[str, Any]:
    """Return the input of a run as plain data; a ValueError if it is not known. name: the name of the argument."""
    if isinstance(run, CoSimulation):
        # Through JSON, so that the sketch is the same before and after a run.
        return dict(json.loads(json.dumps(run.describe(), default=repr)))
    inputs = stored(run.attrs.get("input", "")) if isinstance(run, xr.Dataset) else {}
    for known in (inputs, stored(inputs.get("first_run", ""))):
        chains = known.get("chains", [known.get("chain")])
        if chains and all(isinstance(chain, Mapping) and chain.get("beads") for chain in chains):
            return known
    what = "" if isinstance(run, xr.Dataset) else f" = {short(run)}"
    raise ValueError(f"{name}{what}: must be a CoSimulation, or the Dataset of a run, which holds its input")


def note(ax: Axes, words: str) -> None:
    """Write a line in the legend."""
    ax.plot([], [], linestyle="none", label=words)


def letters(ax: Axes, x: float, y: float, words: str) -> None:
    ax.text(x, y, plain(words), fontsize=SMALL, color=INK, ha="left", va="center")
    ax.plot([x], [y], linestyle="none")  # a text alone does not widen the limits of the axes


def draw(ax: Axes, patch: Ellipse | Rectangle, words: str = "", **look: Any) -> None:
    """Draw a shape. words: its label in the legend."""
    ax.add_patch(patch).set(**{"facecolor": "white", "edgecolor": INK, "linewidth": 0.6, "label": words, **look})


def draw_chain(ax: Axes, chain: Described, y: float, is_free: bool) -> float:
    """Draw a chain that ends at x = 0, and its striker if the struck end is free; return the x of that end."""
    beads = chain["beads"]
    kinds = Counter(map(bead_in_words, beads))
    faces = dict(zip(kinds, BEAD_COLOURS, strict=False))
    others = count_of(len(kinds) - len(faces), "other kind of bead", "other kinds of beads")
    x = start = -sum(size_of(bead)[0] for bead in beads)
    for bead in beads:
        (width, height), kind = size_of(bead), bead_in_words(bead)
        words = f"{kinds[kind]} × {kind}" if kind in faces else others
        shape: Any = Ellipse((x + 0.5 * width, y), width, height)
        if bead.get("class") == "Cylinder" and abs(cos(bead.get("angle") or 0.0)) > 0.5:  # its side is seen
            shape = Rectangle((x, y - 0.5 * height), width, height)
        draw(ax, shape, words, facecolor=faces.get(kind, "white"))
        if inner := 2e3 * (bead.get("inner_radius") or 0.0):
            draw(ax, Ellipse((x + 0.5 * width, y), inner, inner), linewidth=0.4)
        x += width
    if not is_free:
        return start

    # An arrow shows what strikes the first bead.
    striker, speed, gap = chain.get("striker"), chain.get("impact_speed"), 0.6 * size_of(beads[0])[0]
    moves, begin, up = f", {float(speed):.3g} m/s" if speed else "", start - 2.0 * gap, y
    body = striker.get("striker", striker) if isinstance(striker, Mapping) else {}
    if "radius" in body or "size" in body:
        width, height = size_of(body)
        begin, up = start - gap - width, y + 0.5 * height + 2.0
        shape = Ellipse((begin + 0.5 * width, y), width, height)
        draw(ax, shape, f"striker: {bead_in_words(body)}{moves}", facecolor="#f2b38a")
    else:
        words = f"first bead starts{moves}" if striker is None else "pushed: a force or a place over time"
        ax.plot([], [], label=words, color=COLOURS[1], marker=">", linestyle="none")
    ax.annotate("", (start, up), (begin, up), arrowprops={"arrowstyle": "-|>", "color": COLOURS[1], "linewidth": 1.2})
    ax.plot([begin, start], [up, up], linestyle="none")  # an arrow alone does not widen the limits of the axes
    return start


def side_of(data: Described) -> Iterator[tuple[float, float, float, str, dict[str, Any]]]:
    """Yield the parts of a structure as seen from the side, from the contact on. A part has a width along the chain, a
    half-height, the height of its middle above the contact, words and a look."""
    kind, look, layers = str(data.get("kind", "structure")), {"facecolor": LAYER_COLOURS[0]}, data.get("layers") or []
    material: Any = data.get("material")
    of = f" of {material_of(data)}" if material else ""
    if "thickness" in data:
        thick = 1e3 * float(data["thickness"])
        yield thick, SPACE, 0.0, f"{kind}, {thick:.4g} mm{of}", look
    elif kind == "beam":
        # The thickness is that of a rectangular section with the same stiffness and mass.
        length, away = 1e3 * data["length"], 1e3 * data["at"]
        area = data["mass_per_length"] / material["density"]
        thick = 1e3 * sqrt(12.0 * data["bending_stiffness"] / (material["youngs_modulus"] * area))
        ends = " and ".join(map(str, dict.fromkeys(data.get("supports") or ())))
        words = f"beam{of}, {length:.4g} mm long, ends {ends}, struck at {away:.4g} mm"
        yield thick, 0.5 * length, away - 0.5 * length, f"{words}; thickness of a rectangular section", look
    elif not layers:
        words, hatch = (f"{kind}{of}", "//") if kind == "half-space" else (f"{kind}{of}, whose size is not known", "..")
        yield SPACE, SPACE, 0.0, words, {"facecolor": "#e6e6e6", "edgecolor": PALE, "hatch": hatch}
    names = list(dict.fromkeys(map(material_of, layers)))
    for layer in layers:
        name, length, radius = material_of(layer), 1e3 * float(layer["length"]), 1e3 * float(layer["radius"])
        alike = [1e3 * float(one["length"]) for one in layers if material_of(one) == name]
        words = f"{name}, {sum(alike):.4g} mm long"
        words += f" in {len(alike)} layers" if len(alike) > 1 else f", radius {radius:.4g} mm"
        yield length, radius, 0.0, words, {"facecolor": LAYER_COLOURS[names.index(name) % len(LAYER_COLOURS)]}
    base = str(data.get("base"))
    if layers and base not in ("free", "contact", "None"):
        half = 1.2e3 * max(float(layer["radius"]) for layer in layers)
        yield 0.3 * half, half, 0.0, f"base: {base}", {"hatch": BASES.get(base, "++"), "linewidth": 0.0}


def draw_front(ax: Axes, plate: Described, touching: Mapping[int, int], x: float, y: float, top: float) -> float:
    """Draw a plate as seen along the chain, to the right of x, below `top`; return its lowest y. touching: for each
    contact point of the plate, the chain that touches it."""
    contact: dict[str, Any] = {"color": COLOURS[1], "marker": "o", "linestyle": "none", "zorder": 4.0}
    # The outline and its holes, with the names of their edges.
    if "corners" in plate:
        rings = [(plate["corners"], plate.get("edges") or ["edge"] * len(plate["corners"]))]
        rings += [(hole, [f"hole {k}"] * len(hole)) for k, hole in enumerate(plate.get("holes") or [], 1)]
    elif "length" in plate and "width" in plate:
        a, b = float(plate["length"]), float(plate["width"])
        rings = [([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)], ["bottom", "right", "top", "left"])]
    else:
        away, kind = 1e3 * float(plate.get("distance") or 0.0), str(plate.get("edge", "free"))
        draw(ax, Rectangle((x, y - SPACE), away + SPACE, 2.0 * SPACE), facecolor="#eef1f4", linewidth=0.0)
        if away:
            words, look = f"edge: {kind}, {away:.4g} mm from the contact", EDGES.get(kind, EDGES["elastic"])
            ax.plot([x, x], [y - SPACE, y + SPACE], label=words, solid_capstyle="butt", **look)
        beyond = f"the outline is in {plate['mesh']}" if "mesh" in plate else "the plate continues beyond the picture"
        ax.plot([x + (away or 0.5 * SPACE)], [y], label=f"contact; {beyond}", **contact)
        return y - SPACE

    corners = np.concatenate([ring for ring, _ in rings])
    low, (width, height) = corners.min(axis=0), 1e3 * np.ptp(corners, axis=0)
    factor = min(1.0, max(abs(ax.dataLim.x0), 100.0) / max(width, height))
    half = 0.5 * factor * height
    corner = np.array([x, min(y, top - half) - half])

    def line(places: Any, words: str, **look: Any) -> None:
        """Draw through places on the plate, m."""
        ax.plot(*(corner + factor * 1e3 * (np.array(places) - low)).T, label=words, **look)

    for ring, names in rings:
        for name, *ends in zip(names, ring, [*ring[1:], ring[0]], strict=True):
            kind = (plate.get("supports") or {}).get(name, "free")
            kind = "elastic" if isinstance(kind, Mapping) else str(kind)
            line(ends, f"edge: {kind}", solid_capstyle="butt", **EDGES.get(kind, EDGES["elastic"]))
    for addition in plate.get("additions") or []:
        if "region" in addition:
            around = np.array(addition["region"])[[[0, 2], [1, 2], [1, 3], [0, 3], [0, 2]]]
            line(around, "weakened region", color=COLOURS[3], linewidth=1.2, linestyle="--")
        elif "start" in addition:
            line([addition["start"], addition["end"]], "stiffener", color=COLOURS[3], linewidth=2.5)
        elif "mass" in addition:
            place = addition["x"], addition["y"]
            line([place], "point mass", color=INK, marker="s", markersize=5.0, linestyle="none")
    for point, place in enumerate(np.reshape(plate.get("at") or [], (2, -1)).T):
        of = f" of chain {touching[point]}" if point in touching and len(touching) > 1 else ""
        words = f"contact{of} at ({1e3 * place[0]:.4g}, {1e3 * place[1]:.4g}) mm"
        face = COLOURS[1] if point in touching else "white"
        line([place], words if point in touching else "other contacts", **contact, markerfacecolor=face)
    scale = "" if factor == 1.0 else f", drawn × {factor:.2g}"
    note(ax, f"right: seen along the chain, {width:.4g} × {height:.4g} mm{scale}")
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
        words[-1] = f"{2e3 * bead['radius']:.4g} mm × {1e3 * bead['length']:.4g} mm"
        words[-1] += " along the chain" * (bead.get("axis") == "along")
    if kind == "HollowSphere":
        words.append(f"wall {1e3 * (bead['radius'] - bead['inner_radius']):.3g} mm")
    return ", ".join([*words, material_of(bead)] if isinstance(bead.get("material"), Mapping) else words)


def material_of(data: Described) -> str:
    """Return the name of a material, or its modulus if it has no name."""
    material = data["material"] if isinstance(data.get("material"), Mapping) else {}
    if plies := material.get("plies"):
        return ", ".join(dict.fromkeys(map(material_of, plies)))
    if not material.get("name") and "youngs_modulus" in material:
        return f"E = {1e-9 * float(material['youngs_modulus']):.4g} GPa"
    return str(material.get("name") or "a material")
