"""The structures of a sketch: rods, cylinders, half-spaces and plates from the side; plates along the chain.

All lengths are mm. What is drawn comes from the description of a structure in the input of a run.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from coupling.plots.canvas import COLOURS, INK, PALE, SMALL, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPACE = 26.0
"""Drawn depth and half-height of what has no ends, mm."""

LAYER_COLOURS = ("#9fb4c7", "#f0e2b6", "#c7a58f", "#b5cda3", "#cdb7d6", "#d9d9d9")

EDGES = {
    "clamped": {"color": INK, "linewidth": 3.0, "linestyle": "-"},
    "simple": {"color": COLOURS[0], "linewidth": 2.0, "linestyle": "--"},
    "soft simple": {"color": COLOURS[5], "linewidth": 2.0, "linestyle": "--"},
    "symmetry": {"color": COLOURS[3], "linewidth": 1.5, "linestyle": "-."},
    "elastic": {"color": COLOURS[2], "linewidth": 2.0, "linestyle": ":"},
    "free": {"color": PALE, "linewidth": 0.9, "linestyle": "-"},
}
"""How an edge of each support is drawn."""


class Drawn:
    """The axes of a sketch, and its legend: each word once."""

    def __init__(self, ax: "Axes") -> None:
        self.ax = ax
        self._known: dict[str, Any] = {}

    def add(self, patch: Any, words: str = "") -> None:
        """Add a patch, with its words in the legend."""
        self.ax.add_patch(patch)
        if words:
            self.named(words, patch)

    def named(self, words: str, handle: Any = None) -> None:
        """Add words to the legend; those that come first stand first, even if they are drawn later."""
        if self._known.get(words) is None:
            self._known[words] = handle

    def line(self, x: Sequence[float], y: Sequence[float], words: str = "", **look: Any) -> None:
        """Draw a line, with its words in the legend."""
        (line,) = self.ax.plot(x, y, **look)
        if words:
            self.named(words, line)

    def text(self, x: float, y: float, words: str, **place: Any) -> None:
        """Write small letters."""
        self.ax.text(x, y, plain(words), fontsize=SMALL, color=INK, **place)

    def arrow(self, start: tuple[float, float], end: tuple[float, float], words: str = "") -> None:
        """Draw an arrow, which shows where something moves."""
        self.ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": COLOURS[1], "linewidth": 1.2})
        # An annotation does not count where limits are chosen.
        self.ax.plot(*zip(start, end, strict=True), linestyle="none")
        if words:
            self.line([], [], words, color=COLOURS[1], marker=">", linestyle="none")

    def note(self, words: str) -> None:
        """Add words to the legend that belong to no mark."""
        self.line([], [], words, linestyle="none")

    def legend(self) -> tuple[list[Any], list[str]]:
        """Return the handles and words."""
        labelled = {words: handle for words, handle in self._known.items() if handle is not None}
        return list(labelled.values()), list(labelled)


def half_height(structure: Any) -> float:
    """Return half the height of a structure, seen from the side, mm."""
    if isinstance(structure, Mapping) and structure.get("layers"):
        return 1.2e3 * max(float(layer["radius"]) for layer in structure["layers"])
    return SPACE


def side_view(drawn: Drawn, structure: Any, x: float, y: float, mirrored: bool = False) -> float:
    """Draw a structure from the side, whose face is at x; return its far end, mm."""
    data = structure if isinstance(structure, Mapping) else {"kind": str(structure)}
    kind, sign = str(data.get("kind", "structure")), -1.0 if mirrored else 1.0
    if data.get("layers"):
        return _layers(drawn, data, x, y, sign)
    if "thickness" in data:
        return _plate_from_side(drawn, data, kind, x, y, sign)
    of = f" of {_material(data)}" if data.get("material") else ""
    words = f"half-space{of}" if kind == "half-space" else f"{kind}{of}, not to scale"
    _block(drawn, x, y - SPACE, sign * SPACE, 2.0 * SPACE, words, hatch="//" if kind == "half-space" else "..")
    return x + sign * SPACE


def _block(drawn: Drawn, x: float, y: float, width: float, height: float, words: str, **look: Any) -> None:
    from matplotlib.patches import Rectangle

    full: dict[str, Any] = {"facecolor": "#e6e6e6", "edgecolor": PALE, "linewidth": 0.6} | look
    drawn.add(Rectangle((min(x, x + width), y), abs(width), height, **full), words)


def _layers(drawn: Drawn, data: Mapping[str, Any], x: float, y: float, sign: float) -> float:
    """Draw a rod or a cylinder of layers, and what holds its far end."""
    layers = data["layers"]
    radius = max(1e3 * float(layer["radius"]) for layer in layers)
    names = list(dict.fromkeys(_material(layer) for layer in layers))
    for layer in layers:
        long, half, name = 1e3 * float(layer["length"]), 1e3 * float(layer["radius"]), _material(layer)
        colour = LAYER_COLOURS[names.index(name) % len(LAYER_COLOURS)]
        words = f"{name}, {long:.4g} mm long, radius {half:.4g} mm"
        _block(drawn, x, y - half, sign * long, 2.0 * half, words, facecolor=colour, edgecolor=INK)
        x += sign * long
    base = data.get("base")
    half, name = 1.2 * radius, str(base)
    if name not in ("free", "contact", "None"):
        hatch = {"fixed": "////", "absorbing": "...."}.get(name, "++")
        look = {"hatch": hatch, "facecolor": "white", "edgecolor": INK, "linewidth": 0.0}
        _block(drawn, x, y - half, sign * 0.35 * radius, 2.0 * half, f"base: {name}", **look)
    return x + sign * 0.35 * radius


def _plate_from_side(drawn: Drawn, data: Mapping[str, Any], kind: str, x: float, y: float, sign: float) -> float:
    """Draw a thin block at the chain's end, as high as the part of the plate that fits the sketch."""
    thick = 1e3 * float(data["thickness"])
    words = f"{kind}, {thick:.4g} mm of {_material(data)}"
    _block(drawn, x, y - SPACE, sign * thick, 2.0 * SPACE, words, facecolor=LAYER_COLOURS[0], edgecolor=INK)
    return x + sign * thick


def front_view(drawn: Drawn, structure: Any, point: int, x: float, y: float, top: float) -> float:
    """Draw a plate as seen along the chain, right of x, below `top`; return its lowest y. Others have no such view."""
    if not isinstance(structure, Mapping) or "thickness" not in structure:
        return y - SPACE
    rings = _rings(structure)
    if not rings:
        return _without_outline(drawn, structure, x, y)
    everywhere = [place for ring, _ in rings for place in ring]
    left, right = (pick(px for px, _ in everywhere) for pick in (min, max))
    low, high = (pick(py for _, py in everywhere) for pick in (min, max))
    chain = abs(drawn.ax.dataLim.x0) if drawn.ax.dataLim.x0 < 0.0 else 100.0
    factor = min(1.0, max(chain, 100.0) / max(right - left, high - low))
    half = 0.5 * factor * (high - low)
    x0, y0 = x + 12.0, min(y, top - half) - half

    def to_sketch(px: float, py: float) -> tuple[float, float]:
        return x0 + factor * (px - left), y0 + factor * (py - low)

    _mesh_of(drawn, structure, to_sketch)
    supports = structure.get("supports") or {}
    for ring, names in rings:
        for i, name in enumerate(names):
            ends = [to_sketch(*ring[i]), to_sketch(*ring[(i + 1) % len(ring)])]
            kind = supports.get(name, "free")
            kind = "elastic" if isinstance(kind, Mapping) else str(kind)
            look = EDGES.get(kind, EDGES["free"])
            xs, ys = zip(*ends, strict=True)
            drawn.line(xs, ys, f"edge: {kind}", solid_capstyle="butt", **look)
    _marks(drawn, structure, point, to_sketch)
    scale = "" if factor == 1.0 else f", drawn × {factor:.2g}"
    drawn.note(f"right: seen along the chain, {right - left:.4g} × {high - low:.4g} mm{scale}")
    return y0


def _rings(structure: Mapping[str, Any]) -> list[tuple[list[tuple[float, float]], list[str]]]:
    """Return the outline and its holes, mm, with the names of their edges."""
    if "corners" in structure:
        edges = [str(name) for name in structure.get("edges") or []]
        outer = _points(structure["corners"])
        holes = [_points(hole) for hole in structure.get("holes") or []]
        named = [(hole, [f"hole {i + 1}"] * len(hole)) for i, hole in enumerate(holes)]
        return [(outer, edges or ["edge"] * len(outer)), *named]
    if "length" in structure and "width" in structure:
        a, b = 1e3 * float(structure["length"]), 1e3 * float(structure["width"])
        return [([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)], ["bottom", "right", "top", "left"])]
    return []


def _points(corners: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    return [(1e3 * float(x), 1e3 * float(y)) for x, y in corners]


def _mesh_of(drawn: Drawn, structure: Mapping[str, Any], to_sketch: Any) -> None:
    """Draw the lines of a uniform mesh; others depend on the contact, and are not drawn."""
    cells = structure.get("cells")
    if "corners" in structure or not isinstance(cells, Sequence) or len(cells) != 2:
        return
    size = (1e3 * float(structure["length"]), 1e3 * float(structure["width"]))
    look = {"color": PALE, "linewidth": 0.25}
    for axis in (0, 1):
        for i in range(1, int(cells[axis])):
            at, end = size[axis] * i / int(cells[axis]), size[1 - axis]
            ends = [(at, 0.0), (at, end)] if axis == 0 else [(0.0, at), (end, at)]
            xs, ys = zip(*(to_sketch(*end) for end in ends), strict=True)
            drawn.line(xs, ys, f"mesh, {cells[0]} × {cells[1]} cells", **look)


def _marks(drawn: Drawn, structure: Mapping[str, Any], point: int, to_sketch: Any) -> None:
    """Mark where chains touch, and what was added to the plate."""
    for addition in structure.get("additions") or []:
        if "region" in addition:
            left, right, bottom, top = (1e3 * side for side in addition["region"])
            corners = ((left, bottom), (right, bottom), (right, top), (left, top), (left, bottom))
            xs, ys = zip(*(to_sketch(*corner) for corner in corners), strict=True)
            drawn.line(xs, ys, "weakened region", color=COLOURS[3], linewidth=1.2, linestyle="--")
        elif "mass" in addition and "x" in addition:
            at = to_sketch(1e3 * addition["x"], 1e3 * addition["y"])
            drawn.line([at[0]], [at[1]], "point mass", color=INK, marker="s", markersize=5.0, linestyle="none")
        elif "start" in addition and "end" in addition:
            xs, ys = zip(*(to_sketch(*place) for place in _points([addition["start"], addition["end"]])), strict=True)
            drawn.line(xs, ys, "stiffener", color=COLOURS[3], linewidth=2.5)
    at = structure.get("at")
    if not at:
        return
    many = isinstance(at[0], Sequence)
    places = list(zip(at[0], at[1], strict=True)) if many else [tuple(at)]
    for i, (px, py) in enumerate(_points(places)):
        x, y = to_sketch(px, py)
        words = f"contact at ({px:.4g}, {py:.4g}) mm" if i == point else "other contacts"
        face = COLOURS[1] if i == point else "white"
        drawn.line([x], [y], words, color=COLOURS[1], markerfacecolor=face, marker="o", linestyle="none", zorder=4.0)


def _without_outline(drawn: Drawn, structure: Mapping[str, Any], x: float, y: float) -> float:
    """Draw a half-plane and its edge, a plate without edges, or one with an outline in a file; return its lowest y."""
    away = 1e3 * float(structure.get("distance") or 0.0)
    x0 = x + 12.0
    _block(drawn, x0, y - SPACE, away + SPACE, 2.0 * SPACE, "", edgecolor="none", facecolor="#eef1f4")
    if away:
        kind = str(structure.get("edge", "free"))
        look = EDGES.get(kind, EDGES["free"])
        drawn.line([x0, x0], [y - SPACE, y + SPACE], f"edge: {kind}, {away:.4g} mm from the contact", **look)
    words = "contact; the plate continues beyond the picture"
    if "mesh" in structure:
        words = f"contact; the outline is in {structure['mesh']}"
    at = x0 + (away or 0.5 * SPACE)
    drawn.line([at], [y], words, color=COLOURS[1], marker="o", linestyle="none", zorder=4.0)
    return y - SPACE


def _material(data: Mapping[str, Any]) -> str:
    material = data.get("material")
    name = material.get("name") if isinstance(material, Mapping) else None
    if name:
        return str(name)
    if isinstance(material, Mapping) and "youngs_modulus" in material:
        return f"E = {1e-9 * float(material['youngs_modulus']):.4g} GPa"
    return "several plies" if material is None else "a material"
