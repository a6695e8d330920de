"""First case files, by kind."""

import tomllib
from importlib.resources import files
from pathlib import Path
from shlex import quote

import numpy as np

from coupling.results.measures import sensor_force
from hertzlink.cases.case import Case
from hertzlink.output import write_file
from structures.caution import collected
from structures.checks import nearest

KINDS = (
    "chain", "deformable", "two-chains", "rod", "layered-rod", "beam", "cylinder", "wall", "plate", "thick-plate",
    "laminate", "half-plane", "sweep", "critical-distance", "identify",
)  # fmt: skip


def template(kind: str) -> str:
    """Return the text of a first case file; a ValueError for an unknown kind."""
    if kind not in KINDS:
        raise ValueError(f'new: "{kind}" is not a kind of case; {nearest(kind, KINDS, len(KINDS))}')
    return (files(__name__) / f"{kind}.toml").read_text(encoding="utf-8")


def write_new(kind: str, path: Path | None) -> list[str]:
    """Write a first case into a new file, and the trace that it asks for; lines that say what next."""
    text, path = template(kind), path or Path(f"{kind}.toml")
    case, trace = quote(str(path)), path.with_suffix(".csv")
    texts = {path: text}
    if kind == "identify":
        # A trace such as an oscilloscope's: a run of the case with another plate, with noise of 1 % of the peak.
        true = {"structure.thickness": "3.18 mm", "structure.distance": "42 mm", "chain.impact_speed": "0.33 m/s"}
        with collected():  # the fit warns of it
            run = Case(tomllib.loads(text)).changed(true).run()
        lead, volts, random = 50e-6, 25.0, np.random.default_rng(7)
        time, columns = np.arange(0.0, float(run.time[-1]) + lead, 0.5e-6), []
        for sensor in (7, 13):
            force = np.interp(time - lead, run.time.values, sensor_force(run, sensor).values, left=0.0)
            columns.append((force + random.normal(0.0, 0.01 * force.max(), time.size)) / volts)
        lines = [f"{t:.7e},{a:.6e},{b:.6e}" for t, a, b in zip(time, *columns, strict=True)]
        texts[trace] = "\n".join(["time (s),channel 1 (V),channel 2 (V)", *lines]) + "\n"
    for place in texts:
        if place.exists():
            raise ValueError(f"{place}: exists already; give another PATH")
    for place, content in texts.items():
        write_file(place, content.encode())
    if kind == "identify":
        return [f"written: {path}, {trace} (a simulated trace)", f"next: hertzlink identify {case} {quote(str(trace))}"]
    return [f"written: {path}", f"next: hertzlink check {case}, then hertzlink run {case}"]
