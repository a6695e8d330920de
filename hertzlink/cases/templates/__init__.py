"""Case files that are written: first ones, by kind, and the case of a result."""

import os
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from shlex import quote

import numpy as np

from coupling.files.loading import read_netcdf
from coupling.results.provenance import stored
from hertzlink.cases.case import Case
from hertzlink.cases.faults import CaseError
from structures.caution import collected
from structures.checks import nearest

KINDS = (
    "chain", "deformable", "two-chains", "rod", "layered-rod", "beam", "cylinder", "wall", "plate", "thick-plate",
    "laminate", "half-plane", "sweep", "critical-distance", "identify",
)  # fmt: skip

TRUE = {"structure.thickness": "3.18 mm", "structure.distance": "42 mm", "chain.impact_speed": "0.33 m/s"}
"""The plate of the example's trace, which the template of `identify` does not know."""

TRACE = "trace"
"""The attribute of an identification that names the file of its signal."""

NOISE, LEAD, VOLTS = 0.01, 50e-6, 25.0
"""Noise over the peak, s before the impact, and N/V of the example's trace."""


def template(kind: str) -> str:
    """Return the text of a first case file; raise a ValueError for an unknown kind."""
    if kind not in KINDS:
        raise CaseError(f'hertzlink: new: "{kind}" {_no_kind(kind)}')
    return (files(__name__) / f"{kind}.toml").read_text(encoding="utf-8")


def _no_kind(kind: str) -> str:
    """Return what a word is that is no kind, and what to give: files and folders are taken for places of results."""
    place = Path(kind)
    if not kind or (len(place.parts) == 1 and not place.suffix and not place.exists()):
        return f"is no kind of case; {nearest(kind, [*KINDS], len(KINDS))}"
    if place.suffix == ".toml":
        return f"is a case file already; `hertzlink run {quote(kind)}` runs it"
    result = (place if place.is_dir() else place.parent) / "results.nc"
    cure = f"did you mean {result}?" if result.is_file() else f"give results.nc of a run, or one of {', '.join(KINDS)}"
    return f"is neither a kind of case nor a result; {cure}"


def write_new(kind: str, path: Path | None) -> list[str]:
    """Write a first case, or the case of a result, into a new file; lines that say what was written, and what next."""
    if kind.endswith(".nc"):
        text, measured = case_again(Path(kind))
        path = path or Path(f"{Path(kind).stem}.toml")
        measured = measured.removeprefix(f"{Path.cwd()}{os.sep}")
        _write(path, text)
        again = f"next: hertzlink identify {quote(str(path))} {quote(measured)}"
        return [f"written: {path}", again if measured else _next(path)]
    text, path = template(kind), path or Path(f"{kind}.toml")
    if kind != "identify":
        _write(path, text)
        return [f"written: {path}", _next(path)]
    trace = path.with_suffix(".csv")
    if trace.exists():
        raise _exists(trace)
    _write(path, text)
    try:
        with collected():  # the fit warns of it
            _write(trace, example_trace(path))
    except OSError:
        path.unlink()
        raise
    again = f"next: hertzlink identify {quote(str(path))} {quote(str(trace))}"
    return [f"written: {path}, {trace} (a simulated trace)", again]


def _next(path: Path) -> str:
    return f"next: hertzlink check {quote(str(path))}, then hertzlink run {quote(str(path))}"


def case_again(file: Path) -> tuple[str, str]:
    """Return the text of the case of a result, and the name of the signal's file where the case was identified from
    one.

    A ValueError that says in one line what else the file holds.
    """
    data = read_netcdf(file)
    if "case" in data.attrs:
        return str(data.attrs["case"]), str(data.attrs.get(TRACE, ""))
    if name := stored(data.attrs.get("input")).get("study"):
        raise CaseError(f"{file}: is a study, which has no case; `hertzlink study {name}` repeats it")
    raise CaseError(f"{file}: holds no case, as what was made in Python; `hertzlink new` writes a first one")


def example_trace(path: Path) -> str:
    """Return a trace such as an oscilloscope's: a run of the case with another plate, with noise."""
    import tomllib

    case = Case(tomllib.loads(path.read_text(encoding="utf-8"))).changed(TRUE)
    run = case.run()
    from coupling.results.measures import sensor_force

    time = np.arange(0.0, float(run.time[-1]) + LEAD, 0.5e-6)
    random = np.random.default_rng(7)
    lines = ["time (s),channel 1 (V),channel 2 (V)"]
    columns = []
    for sensor in (7, 13):
        force = np.interp(time - LEAD, run.time.values, sensor_force(run, sensor).values, left=0.0)
        columns.append((force + random.normal(0.0, NOISE * force.max(), time.size)) / VOLTS)
    lines += [f"{t:.7e},{a:.6e},{b:.6e}" for t, a, b in zip(time, *columns, strict=True)]
    return "\n".join(lines) + "\n"


def _write(path: Path, text: str) -> None:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise _exists(path) from None
    except OSError as error:
        with suppress(OSError):
            if path.is_file() and path.stat().st_size == 0:
                path.unlink()
        raise CaseError(f"{path}: cannot be written ({error.strerror})") from None


def _exists(path: Path) -> CaseError:
    return CaseError(f"{path}: exists already; give another PATH")
