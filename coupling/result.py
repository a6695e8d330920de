"""A result is an xarray.Dataset: named dimensions, units, the full input and the versions in its attributes."""

import json
import logging
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr

from particles.moving import MovingChain
from structures.structure import Vector

PACKAGES = ("hertzlink", "numpy", "scipy", "numba", "scikit-fem", "xarray")

DESCRIPTIONS = {
    "displacement": (("time", "bead"), "m", "displacement from static equilibrium; bead 0 is the striker"),
    "velocity": (("time", "bead"), "m/s", "velocity; bead 0 is the striker"),
    "contact_force": (("time", "contact"), "N", "force between bead n - 1 and bead n, preload included"),
    "surface_displacement": (("time",), "m", "displacement of the structure's contact point"),
    "kinetic_energy": (("time",), "J", "kinetic energy of striker and beads"),
    "contact_energy": (("time",), "J", "energy of contacts, gravity, dead load and spring, from the start"),
    "dissipated_energy": (("time",), "J", "energy taken by losses since the start"),
    "excitation_work": (("time",), "J", "work of a force history or a piston since the start"),
    "interface_work": (("time",), "J", "work of the dynamic contact force on the structure since the start"),
    "structure_energy": (("time",), "J", "kinetic and elastic energy of the structure, NaN where it is not known"),
    "evaluations": (("time",), "1", "chain windows tried since the last saved time"),
}


log = logging.getLogger("hertzlink.result")


class Frames:
    """The arrays that a run fills, one row for each saved time, row 0 the start."""

    def __init__(self, rows: int, bodies: int) -> None:
        self.position, self.velocity, self.contact_force = (np.zeros((rows, bodies)) for _ in range(3))
        self.surface, self.kinetic, self.potential, self.structure, self.lost, self.work, self.driven = (
            np.zeros(rows) for _ in range(7)
        )
        self.evaluations = np.zeros(rows)

    def arrays(self) -> tuple[Vector, ...]:
        """In the order that the compiled window loop wants."""
        return (
            self.position, self.velocity, self.contact_force, self.surface, self.kinetic, self.potential,
            self.structure, self.lost, self.work, self.driven, self.evaluations,
        )  # fmt: skip


def dataset(chain: MovingChain, frames: Frames, interval: float, given: Mapping[str, Any]) -> xr.Dataset:
    """The Dataset of one run; `given` is its input. Structure energy is NaN where it is not known."""
    potential = frames.potential + chain.static_force[-1] * frames.surface
    values = {
        "displacement": frames.position - chain.rest,
        "velocity": frames.velocity,
        "contact_force": frames.contact_force,
        "surface_displacement": frames.surface,
        "kinetic_energy": frames.kinetic,
        "contact_energy": potential - potential[0],
        "dissipated_energy": frames.lost,
        "excitation_work": frames.driven,
        "interface_work": frames.work,
        "structure_energy": frames.structure,
        "evaluations": frames.evaluations,
    }
    bodies = chain.mass.size
    data = xr.Dataset(
        {name: (DESCRIPTIONS[name][0], value, _attributes(name)) for name, value in values.items()},
        coords={
            "time": ("time", interval * np.arange(frames.surface.size), {"units": "s"}),
            "bead": ("bead", np.arange(bodies)),
            "contact": ("contact", np.arange(1, bodies + 1)),
            "centre": ("bead", chain.chain.centres, {"units": "m", "long_name": "centre, from the struck end"}),
            "impact_energy": ((), chain.chain.impact_energy, {"units": "J", "long_name": "energy of the excitation"}),
            "static_force": ("contact", chain.static_force, {"units": "N", "long_name": "preload"}),
        },
    )
    data = data.assign_attrs(provenance(given))
    told, new = chain.cautions(_deepest(chain, frames))
    for caution in new:
        log.warning("%s", caution)
    return data.assign_attrs(warnings="\n".join(told + new)) if told + new else data


def _deepest(chain: MovingChain, frames: Frames) -> Vector:
    """Greatest approach that each contact saw at a saved time, m; the last one's without the spring behind it."""
    place = np.column_stack([frames.position, frames.surface])
    deepest: Vector = (place[:, :-1] - place[:, 1:]).max(axis=0)
    deepest[-1] -= chain.flexibility * frames.contact_force[:, -1].max()
    return deepest


def provenance(given: Mapping[str, Any]) -> dict[str, str]:
    """Input and versions as text, for the attributes of a Dataset."""
    return {"input": json.dumps(given, default=repr, ensure_ascii=False), "versions": _versions()}


@cache
def _versions() -> str:
    """Read once: the packages' metadata takes longer than many a run."""
    return json.dumps(versions())


def versions() -> dict[str, str]:
    """Versions of Python, hertzlink and what its numbers depend on."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _attributes(name: str) -> dict[str, str]:
    _, units, text = DESCRIPTIONS[name]
    return {"units": units, "long_name": text}
