"""The gallery of the site: copies of examples/*.py with a title, what they print, and a picture.

Examples that take long are not run when the site is built. What they print and draw is stored below `stored`;
`python docs/site/gallery_pages.py NAME ...` runs them and stores it again.
"""

import ast
import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
STORED = HERE / "stored"

RUN = {
    "body_from_mesh": "hl.plots.traces(run, sensors=10)",
    "edge_from_a_tap": "",
    "layered_rod": "hl.plots.contact_map(hl.CoSimulation(chain, hl.rod(layers)).run(until=1.5e-3))",
    "mixed_chain": "hl.plots.contact_map(run)",
    "own_structure": "hl.plots.traces(run, sensors=7)",
    "own_law": "hl.plots.contact_map(runs[-1])",
    "plate_wave": """import matplotlib.pyplot as plt

figure, axes = plt.subplots(figsize=(7.0, 5.0), layout="constrained")
axes.imshow(plt.imread("plate.png"))
axes.axis("off")""",
    "signal_from_file": "hl.plots.traces(signal)",
    "uncertainty_budget": "",
    "two_chains": "hl.plots.setup(hl.CoSimulation([chain, chain], body))",
    "viscous_beads": """import matplotlib.pyplot as plt

figure, axes = plt.subplots(figsize=(8.0, 4.5), layout="constrained")
for (name, force), marker in zip(decay.items(), "ov^Dx", strict=True):
    axes.plot(sensors, [100.0 * one / force[0] for one in force], marker=marker, label=name)
axes.set(xlabel="bead", ylabel="peak force / peak force at bead 8 (%)", xticks=sensors, ylim=(40, 105))
axes.legend(frameon=False, fontsize=8, loc="lower left")""",
    "wall": "hl.plots.traces(run, sensors=7)",
    "what_a_trace_shows": "",
    "yielding": """import matplotlib.pyplot as plt
import numpy as np

figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
for law in list(laws.values())[1:]:
    pair, there, most = law.contact(bead, wall.surface), np.linspace(0.0, 6e-6, 200), 5e-6
    (line,) = axes.plot(1e6 * there, pair.force(there), label=type(law).__name__)
    axes.plot(1e6 * there[there < most], pair.force(there[there < most], most), "--", color=line.get_color())
axes.plot(1e6 * there, pair.elastic.force(there), color="grey", label="Hertz")
axes.set(xlabel="overlap (µm)", ylabel="force (N)", ylim=(0.0, None))
axes.legend(frameon=False)""",
}
"""The examples that are run when the site is built, all within three minutes, and lines that add a picture."""

PATTERN = rf"/({'|'.join(RUN)})\.py$"

SLOW = {
    "bead_stress": """import matplotlib.pyplot as plt

figure, axes = plt.subplots(figsize=(7.0, 5.0), layout="constrained")
axes.imshow(plt.imread("peak.png"))
axes.axis("off")""",
    "deformable_beads": "hl.plots.traces(run, sensors=7)",
    "plate_edge": "hl.plots.swept(runs, sensor=7)",
    "prestress": "",
    "resumed_sweep": "hl.plots.swept(runs, sensor=7, over='length')",
    "tap_map": "",
}
"""The examples whose output is stored, and lines that draw a picture."""

STORED_OUTPUT = """
# sphinx_gallery_thumbnail_path = "site/stored/{name}.png"

# %%
# It prints:
#
# .. code-block:: text
#
{lines}
#
# .. image:: /site/stored/{name}.png
#    :alt: What the example shows.
"""

HEADER = """Gallery
=======

Each example is a script that runs as it stands: ``examples/`` in the sources holds them all.
Tests check the numbers that they print.
The quick ones were run when the page was built. Of the others the output is stored.

Most of them also warn of `yield`: a steel bead at these speeds presses steel slightly beyond first yield.
The contact laws are elastic, unless the chain has a law of yielding.
"""


def write(examples: Path, folder: Path) -> None:
    """The copies, in a folder of their own; a file that is the same stays as it is, so that it is not run again."""
    folder.mkdir(exist_ok=True)
    found = {"GALLERY_HEADER.rst": HEADER}
    for path in sorted(examples.glob("*.py")):
        found[path.name] = page(path)
    for old in folder.iterdir():
        if old.name not in found and old.suffix in (".py", ".rst"):
            old.unlink()
    for name, text in found.items():
        if not (folder / name).is_file() or (folder / name).read_text(encoding="utf-8") != text:
            (folder / name).write_text(text, encoding="utf-8")
    for data in examples.glob("*.csv"):
        shutil.copy(data, folder / data.name)


def page(path: Path) -> str:
    """An example: its title and its docstring, before its code."""
    text = path.read_text(encoding="utf-8")
    said = ast.get_docstring(ast.parse(text)) or ""
    # The gallery runs code that has no __file__, in the folder of the example.
    code = text.split('"""', 2)[2].lstrip("\n").replace("Path(__file__).with_name", "Path")
    title = path.stem.replace("_", " ").capitalize()
    picture = RUN.get(path.stem, "")
    if picture:
        code += f"\n# %%\n# And a picture:\n\n{picture}\n"
    if path.stem in SLOW:
        lines = (STORED / f"{path.stem}.txt").read_text(encoding="utf-8").splitlines()
        code += STORED_OUTPUT.format(name=path.stem, lines="\n".join(f"#    {line}" for line in lines))
    return f'"""\n{title}\n{"=" * len(title)}\n\n{said}\n"""\n\n{code}'


def store(example: Path) -> None:
    """Run an example in a folder of its own; store what it prints, and its last figure."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    code = example.read_text(encoding="utf-8") + "\n" + SLOW[example.stem]
    printed, before = io.StringIO(), Path.cwd()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(printed):
        os.chdir(folder)
        try:
            exec(compile(code, str(example), "exec"), {"__name__": "__main__", "__file__": str(Path(folder) / "x.py")})
        finally:
            os.chdir(before)
    STORED.mkdir(exist_ok=True)
    (STORED / f"{example.stem}.txt").write_text(printed.getvalue(), encoding="utf-8")
    pyplot.gcf().savefig(STORED / f"{example.stem}.png", dpi=100)
    pyplot.close("all")


def link(app: Any, name: str, source: list[str]) -> None:
    """Pages of the sources lead to files of the repository; on the site the same links lead to its pages."""
    depth = "../" * name.count("/")
    text = re.sub(r"\]\(\.\./examples/(\w+)\.py\)", rf"]({depth}gallery/\1.rst)", source[0])
    text = text.replace("](../examples/README.md)", f"]({depth}gallery/index.rst)")
    source[0] = text.replace("](../benchmarks/README.md)", f"]({depth}benchmarks.md)")


if __name__ == "__main__":
    for name in sys.argv[1:] or SLOW:
        store(HERE.parent.parent / "examples" / f"{name}.py")
