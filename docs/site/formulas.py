"""Formulas as drawings: the site needs no scripts, no network, and no font for mathematics."""

from html import escape
from typing import Any

from docutils import nodes
from matplotlib import rc_context
from matplotlib.textpath import TextPath

SIZE = 16.0
"""Height of the letters in the units of a drawing, which one em of the text around it replaces."""


def svg(formula: str) -> str:
    """A formula of LaTeX as SVG in the colour of the text, on its base line."""
    words = " ".join(formula.split())
    with rc_context({"mathtext.fontset": "stix"}):
        path = TextPath((0.0, 0.0), f"${words}$", size=SIZE)
    box = path.get_extents().padded(0.5)
    steps = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}
    drawn = "".join(
        steps[int(code)] + ("" if code == 79 else " ".join(f"{x:.2f},{-y:.2f}" for x, y in points.reshape(-1, 2)))
        for points, code in path.iter_segments(curves=True)
    )
    place = f"{box.x0:.2f} {-box.y1:.2f} {box.width:.2f} {box.height:.2f}"
    look = f"width:{box.width / SIZE:.3f}em;vertical-align:{box.y0 / SIZE:.3f}em"
    return (
        f'<svg class="formula" role="img" viewBox="{place}" style="{look}"><title>{escape(words)}</title>'
        f'<path fill="currentColor" d="{drawn}"/></svg>'
    )


def visit_inline(writer: Any, node: nodes.Element) -> None:
    writer.body.append(svg(node.astext()))
    raise nodes.SkipNode


def visit_block(writer: Any, node: nodes.Element) -> None:
    writer.body.append(f'<div class="math">{svg(node.astext())}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("drawn", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True}
