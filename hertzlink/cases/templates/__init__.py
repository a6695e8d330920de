"""Case files that are written: first ones, by kind, and the case of a result."""

import os
import tomllib
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from shlex import quote

import numpy as np

from coupling.results.measures import sensor_force
from coupling.results.provenance import stored
from coupling.results.reading import read_netcdf
from hertzlink.cases.case import Case
from hertzlink.cases.identification import TRACE
from hertzlink.cases.paths import CaseError
from structures.caution import collected
from structures.checks import nearest

KINDS = (
    "chain", "deformable", "two-chains", "rod", "layered-rod", "beam", "cylinder", "wall", "plate", "thick-plate",
    "laminate", "half-plane", "sweep", "critical-distance", "identify",
)  # fmt: skip


def template(kind: str) -> str:
    """Return the text of a first case file; a CaseError for an unknown kind, or for a file or folder in its place."""
    if kind in KINDS:
        return (files(__name__) / f"{kind}.toml").read_text(encoding="utf-8")
    place = Path(kind)
    if not kind or (len(place.parts) == 1 and not place.suffix and not place.exists()):
        what = f"is no kind of case; {nearest(kind, [*KINDS], len(KINDS))}"
    elif place.suffix == ".toml":
        what = f"is a case file already; `hertzlink run {quote(kind)}` runs it"
    else:
        result = (place if place.is_dir() else place.parent) / "results.nc"
        cure = (
            f"did you mean {result}?" if result.is_file() else f"give results.nc of a run, or one of {', '.join(KINDS)}"
        )
        what = f"is neither a kind of case nor a result; {cure}"
    raise CaseError(f'hertzlink: new: "{kind}" {what}')


def write_new(kind: str, path: Path | None) -> list[str]:
    """Write a first case, or the case of a result, into a new file; lines that say what was written, and what next."""
    text, trace = case_again(Path(kind)) if kind.endswith(".nc") else (template(kind), "")
    path = path or Path(f"{Path(kind).stem}.toml")
    written = str(path)
    if kind == "identify":
        measured = path.with_suffix(".csv")
        if measured.exists():
            raise CaseError(f"{measured}: exists already; give another PATH")
    _write(path, text)
    if kind == "identify":
        try:
            with collected():  # the fit warns of it
                _write(measured, example_trace(text))
        except OSError:
            path.unlink()
            raise
        trace, written = str(measured), f"{path}, {measured} (a simulated trace)"
    case = quote(str(path))
    again = f"hertzlink check {case}, then hertzlink run {case}"
    if trace:
        again = f"hertzlink identify {case} {quote(trace.removeprefix(f'{Path.cwd()}{os.sep}'))}"
    return [f"written: {written}", f"next: {again}"]


def case_again(file: Path) -> tuple[str, str]:
    """Return the text of the case of a result, and the name of the signal's file if it was identified from one.

    A CaseError says in one line what else the file holds.
    """
    data = read_netcdf(file)
    if "case" in data.attrs:
        return str(data.attrs["case"]), str(data.attrs.get(TRACE, ""))
    if name := stored(data.attrs.get("input")).get("study"):
        raise CaseError(f"{file}: is a study, which has no case; `hertzlink study {name}` repeats it")
    raise CaseError(f"{file}: holds no case, as what was made in Python; `hertzlink new` writes a first one")


def example_trace(text: str) -> str:
    """Return a trace such as an oscilloscope's: a run of the case with another plate, with noise of 1 % of the peak."""
    true = {"structure.thickness": "3.18 mm", "structure.distance": "42 mm", "chain.impact_speed": "0.33 m/s"}
    run = Case(tomllib.loads(text)).changed(true).run()
    lead, volts = 50e-6, 25.0
    time = np.arange(0.0, float(run.time[-1]) + lead, 0.5e-6)
    random = np.random.default_rng(7)
    columns = []
    for sensor in (7, 13):
        force = np.interp(time - lead, run.time.values, sensor_force(run, sensor).values, left=0.0)
        columns.append((force + random.normal(0.0, 0.01 * force.max(), time.size)) / volts)
    lines = [f"{t:.7e},{a:.6e},{b:.6e}" for t, a, b in zip(time, *columns, strict=True)]
    return "\n".join(["time (s),channel 1 (V),channel 2 (V)", *lines]) + "\n"


def _write(path: Path, text: str) -> None:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CaseError(f"{path}: exists already; give another PATH") from None
    except OSError as error:
        with suppress(OSError):
            if path.is_file() and path.stat().st_size == 0:
                path.unlink()
        raise CaseError(f"{path}: cannot be written ({error.strerror})") from None
