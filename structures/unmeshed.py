"""Structures whose mesh is made when it is needed, so that a faster model can take their place before."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from structures.structure import Structure

_LEFT_OUT: ContextVar[bool] = ContextVar("meshes are left out", default=False)


class NeedsMeshError(ValueError):
    """Raised where a structure's matrices are used while meshes are left out."""


@contextmanager
def unmeshed() -> Iterator[None]:
    """Leave out meshes: within it `Plate.at` returns an Unmeshed structure, which a chain can face."""
    before = _LEFT_OUT.set(True)
    try:
        yield
    finally:
        _LEFT_OUT.reset(before)


def is_unmeshed() -> bool:
    """Return whether meshes are left out."""
    return _LEFT_OUT.get()


class Unmeshed(Structure):
    """A structure that makes its mesh when its matrices are first used outside `unmeshed`, and refuses that inside.

    body, place: what is struck, and where. make: makes the structure.
    """

    body: Any
    place: Any

    def __new__(cls, *_: Any, **fields_given: Any) -> Any:
        """Make a Structure of a changed copy, which has its matrices."""
        return super().__new__(cls) if "make" in fields_given else Structure(**fields_given)

    def __init__(self, *, body: Any, place: Any, make: Callable[[], Structure], surface: Any, origin: Any) -> None:
        vars(self).update(body=body, place=place, make=make, surface=surface, origin=origin)

    @cached_property
    def _meshed(self) -> Structure:
        if is_unmeshed():
            raise NeedsMeshError("structure: its matrices are not made yet")
        structure: Structure = vars(self)["make"]()
        return structure

    @property
    def rigid(self) -> Structure:
        """The body that chains face while the mesh is left out: it never moves."""
        none, count = sparse.csr_array((0, 0)), len(self.place)
        rigid = [0.0] * count if count > 1 else 0.0
        return Structure(none, none, None, np.zeros((0, count)), rigid, self.surface, self.origin)


def _of_mesh(name: str) -> property:
    return property(lambda self: getattr(self._meshed, name))


for _field in fields(Structure):
    if _field.name not in ("surface", "origin"):
        setattr(Unmeshed, _field.name, _of_mesh(_field.name))


def is_left_out(structure: Structure) -> bool:
    """Return whether a structure has no mesh yet, while meshes are left out."""
    return isinstance(structure, Unmeshed) and is_unmeshed()


def as_struck(structure: Structure) -> Structure:
    """Return what a chain faces: the structure, or a rigid body while its mesh is left out."""
    if not isinstance(structure, Unmeshed):
        return structure
    return structure.rigid if is_unmeshed() else structure._meshed
