"""Hints for wrong guesses: of arguments, of entries of case files, and of public names."""

import inspect
import sys
from collections.abc import Callable, Collection, Mapping
from functools import wraps
from importlib.util import find_spec
from typing import Any

from hertzlink._names import PUBLIC, namespaces
from structures.checks import near

OTHER_WORDS = {
    "at": "position place x",
    "base": "boundary bc support bottom end",
    "beads": "n number count spheres particles bead n_beads",
    "bending_stiffness": "ei flexural_rigidity",
    "calibration": "gain sensitivity scale",
    "coefficient": "c damping dashpot viscosity e value",
    "density": "rho mass_density",
    "dissipation": "damping dashpot loss losses viscosity restitution",
    "distance": "x d edge_distance",
    "dt": "time_step timestep step",
    "edge": "support boundary bc",
    "gravity": "g",
    "height": "h drop_height",
    "highest_frequency": "f_max fmax frequency max_frequency bandwidth",
    "impact_speed": "velocity speed v v0 drop_height height striker_speed initial_velocity",
    "inclination": "angle tilt",
    "inner_radius": "inner_diameter thickness wall wall_thickness",
    "length": "l a height thickness h",
    "mass": "m",
    "material": "mat",
    "path": "file filename output",
    "poisson_ratio": "nu poisson poissons_ratio",
    "preload": "precompression static_force",
    "radius": "diameter r d size",
    "radii": "diameters",
    "run": "data result signal",
    "save_every": "output_step sample_every sampling dt_out",
    "sensor": "bead position channel",
    "sensors": "sensor beads bead channels channel columns column",
    "stiffness": "k",
    "striker": "impactor projectile hammer",
    "structure": "wall plate rod body target",
    "supports": "boundary boundary_conditions bc edges edge support",
    "thickness": "t h",
    "time": "t",
    "until": "duration time t t_end tend t_max tmax end end_time stop total_time",
    "width": "w b",
    "yield_strength": "sigma_y yield_stress strength yield",
    "youngs_modulus": "e modulus young youngs elastic_modulus young_modulus stiffness",
}
"""What users call an argument or an entry that has another name here; names in lower case, the first one that is
there counts.
"""

CONVERTED = {
    ("diameter", "radius"): "half the diameter",
    ("d", "radius"): "half the diameter",
    ("inner_diameter", "inner_radius"): "half of it",
    ("diameters", "radii"): "half of each",
    ("drop_height", "impact_speed"): "drop_speed(height) computes it",
    ("height", "impact_speed"): "drop_speed(height) computes it",
    ("wall_thickness", "inner_radius"): "the radius less the wall",
    ("thickness", "inner_radius"): "the radius less the wall",
    ("wall", "inner_radius"): "the radius less the wall",
}
"""How the value changes with the name."""


def meant(word: object, names: Collection[str], others: Mapping[str, str] = OTHER_WORDS) -> list[str]:
    """Return the names that a wrong guess may mean: another word for one, a misspelt one, or a part of one."""
    guess = str(word).lower()
    for name, words in others.items():
        if name in names and name.lower() != guess and guess in words.split():
            return [name]
    if matches := near(word, names):
        return matches
    parts = set(guess.split("_"))
    shared = [name for name in names if set(name.lower().split("_")) <= parts]
    return shared[:1] or list(names) * (len(names) == 1)


def nearest(word: object, choices: Collection[str], many: int = 12) -> str:
    """The end of a message: the names that may be meant, or all of them where none is near and they are few."""
    if matches := meant(word, choices):
        how = CONVERTED.get((str(word).lower(), matches[0]))
        return f"did you mean {' or '.join(matches)}{f', {how}' if how else ''}?"
    return f"must be one of {', '.join(choices)}" if len(choices) <= many else "see `hertzlink schema`"


def hinting(function: Callable[..., Any], name: str, method: bool = False) -> Callable[..., Any]:
    """Return the function, which names the right argument where it is called with a wrong one.

    name: what a user types. method: its first argument is the object or the class.
    """

    @wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except TypeError:
            wrong = misfit(function, name, method, arguments, named)
            if not wrong:  # an error of what the function does, not of the call itself
                raise
        raise TypeError(wrong)

    return called


def misfit(function: Callable[..., Any], name: str, method: bool, arguments: Any, named: dict[str, Any]) -> str:
    """Return what is wrong with the arguments of a call; empty if nothing is."""
    parameters = list(inspect.signature(function).parameters.values())[method:]
    names = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters)
    for word in named:
        if word not in names and not takes_any:
            left = [name for name in names if name not in named]
            return f"{name}() has no argument {word!r}; {nearest(word, left or names, len(names))}"
    signature = f"its arguments are {', '.join(names)}" if names else "it has no arguments"
    placed = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    count = len(arguments) - method
    if count > len(placed) and not any(p.kind is p.VAR_POSITIONAL for p in parameters):
        by_name = "; give the others by name" if len(names) > len(placed) else ""
        return f"{name}() takes {len(placed)} arguments in order, not {count}; {signature}{by_name}"
    before = {p.name for p in placed[:count]}
    twice = next((word for word in named if word in before), None)
    if twice is not None:
        return f"{name}() has the argument {twice!r} twice, in order and by name; {signature}"
    missing = [
        p.name
        for p in parameters
        if p.default is p.empty and p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)
        and p.name not in before and p.name not in named
    ]  # fmt: skip
    return f"{name}() lacks {' and '.join(missing)}; {signature}" if missing else ""


IMPORTER = "importlib._bootstrap"
"""The module whose frame asks for an attribute in `from hertzlink import name`."""

OTHER_NAMES = {
    "AR": "amplitude_ratio",
    "TOF": "time_of_flight",
    "animate": "plots.picture",
    "bead": "Sphere",
    "cosim": "CoSimulation",
    "energy": "energy_error",
    "force": "sensor_force",
    "invert": "identify",
    "plate": "kirchhoff_plate",
    "plot": "plots.traces",
    "read_csv": "read_signal",
    "read_trace": "read_signal",
    "run": "CoSimulation",
    "save_plot": "plots.report",
    "simulate": "CoSimulation",
    "trace": "plots.traces",
    "wall": "half_space",
}
"""What users call a public name."""

ELSEWHERE = {
    "load": 'a saved run is opened with xarray.load_dataset("run.nc")',
    "save": 'a run is saved with run.to_netcdf("run.nc")',
    "read_case": "a case file is run with `hertzlink run case.toml`; hertzlink.from_input makes a case of a run",
}
ELSEWHERE |= dict.fromkeys(("open", "read", "load_run", "open_run", "read_run", "load_dataset"), ELSEWHERE["load"])
ELSEWHERE |= dict.fromkeys(("write", "save_run", "to_netcdf", "export", "dump"), ELSEWHERE["save"])
ELSEWHERE |= dict.fromkeys(("load_case", "open_case", "case", "run_case", "from_toml"), ELSEWHERE["read_case"])
"""What hertzlink leaves to others, and how it is done."""


def missing(name: str, space: str = "") -> Exception:
    """Return the error for a name that hertzlink, or a namespace of it, does not have.

    `from hertzlink import name` replaces an AttributeError by an ImportError without its message, so it gets an
    ImportError; unless a module of this name can still be imported.
    """
    hint, module = _hint(name, space), f"hertzlink.{space}".rstrip(".")
    importing = sys._getframe(2).f_globals.get("__name__") == IMPORTER
    if importing and not name.startswith("__") and find_spec(f"{module}.{name}") is None:
        return ImportError(f"cannot import name {name!r} from {module!r}{hint}", name=module)
    # Without `obj` Python would add a suggestion of its own, which may be another name.
    return AttributeError(f"module {module!r} has no attribute {name!r}{hint}", name=name, obj=None)


def _hint(name: str, space: str) -> str:
    """Return what is meant by a name, or the nearest one; upper and lower case count the same."""
    if name.startswith("_"):
        return ""
    inner = meant(name, namespaces()[space], {}) if space else []
    if inner:
        return f"; did you mean hertzlink.{space}.{inner[0]}?"
    if name.lower() in ELSEWHERE:
        return f"; {ELSEWHERE[name.lower()]}"
    places: dict[str, str] = {}
    for outer, names in namespaces().items():
        places |= {inner.lower(): f"{outer}.{inner}" for inner in names}
    places |= {public.lower(): public for public in PUBLIC}
    places |= {usual.lower(): place for usual, place in OTHER_NAMES.items()}
    matches = meant(name, places, {})
    return f"; did you mean hertzlink.{places[matches[0]]}?" if matches else ""
