"""The content of an FMU besides its script: a chain and the surface that it faces, as plain data; and its state."""

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from inspect import isclass
from math import isfinite
from typing import Any, NamedTuple

from coupling.files import plain
from coupling.ports.guest import GuestState, guest_chain
from particles.bead import Bead
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.deformable.vibration import vibration
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from particles.moving import ChainState
from structures.checks import short
from structures.described import registered
from structures.surface import Surface


@dataclass(frozen=True)
class KnownLaws:
    """The laws that a user's function gave to the pairs of bodies of a chain, in its place."""

    pairs: tuple[tuple[Bead, Bead | Surface, ContactLaw], ...]

    def __call__(self, bead: Bead, facing: Bead | Surface) -> ContactLaw:
        """Return the law of a pair. Raises ValueError for one that the chain does not have."""
        for first, second, law in self.pairs:
            if (first, second) == (bead, facing):
                return law
        raise ValueError(f"law: knows no contact of {bead!r} with {facing!r}")


HOMES = "particles.", "structures.damping", "structures.material", "structures.surface"
TYPES = plain.own_types(
    KnownLaws, *(of.target for of in registered() if isclass(of.target) and of.target.__module__.startswith(HOMES))
)
"""Everything that a chain consists of, unless a user defines a class of his own."""


class UnitState(NamedTuple):
    """The complete state of a unit: of its chain, its input, its parameter (None without one), its start time, s, and
    whether it is initialised.
    """

    guest: GuestState
    surface_displacement: float
    impact_speed: float | None
    begin: float
    initialised: bool


STATE_TYPES = plain.own_types(UnitState, GuestState, ChainState)


def pack(chain: Chain, surface: Surface, flexibility: float, dt: float | None, trust: bool) -> bytes:
    """Return the content as bytes. Raises ValueError where a part of it is no plain data, or another Python cannot find
    it."""
    content = {
        "kind": type(chain).__name__,
        "chain": _fields_of(chain, surface, flexibility, dt),
        "facing": {"surface": surface, "flexibility": flexibility, "dt": dt},
    }
    try:
        data = plain.to_bytes(content, TYPES, trust)
    except plain.NotPlain as error:
        hint = "define it in a module" if trust else "with trust=True it is pickled, if it is defined in a module"
        raise ValueError(f"chain: does not fit into an FMU: it {error}; {hint}") from error
    if trust and b"__main__" in data:
        raise ValueError(
            "chain: a class of your own must be defined in a module that the FMU's Python can import, not here"
        )
    return importlib.metadata.version("hertzlink").encode() + b"\n" + data


def unpack(data: bytes, trust: bool) -> tuple[Chain, dict[str, Any]]:
    """Return the chain, checked as any input, and what it faces. Raises ValueError for anything else."""
    written, _, rest = data.partition(b"\n")
    here = importlib.metadata.version("hertzlink")
    if written != here.encode():
        raise ValueError(f"the FMU's chain was written by hertzlink {short(written)}, not {here}: write the FMU again")
    try:
        content = plain.from_bytes(rest, TYPES, trust, checked=True)
        chain_fields, facing, kind = dict(content["chain"]), dict(content["facing"]), content["kind"]
    except (plain.Unreadable, KeyError, TypeError) as error:
        raise ValueError(f"the FMU's chain is no plain data of hertzlink ({error})") from error
    return {"Chain": Chain, "DeformableChain": DeformableChain}[kind](**chain_fields), facing


def state_bytes(state: UnitState) -> bytes:
    """Return the state of a unit as bytes."""
    return plain.to_bytes(state, STATE_TYPES)


def state_from(data: bytes) -> UnitState:
    """Return the state in bytes. Raises ValueError for anything else."""
    state = plain.from_bytes(data, STATE_TYPES)
    if not (isinstance(state, UnitState) and isinstance(state.guest, GuestState)):
        raise ValueError("state: is none of this unit")
    speed = state.impact_speed
    numbers = (state.surface_displacement, state.begin, *([] if speed is None else [speed]))
    if not all(isinstance(number, int | float) and isfinite(number) for number in numbers):
        raise ValueError("state: holds no finite displacement, start time or impact speed")
    return state


def _fields_of(chain: Chain, surface: Surface, flexibility: float, dt: float | None) -> Mapping[str, Any]:
    """Return what builds the chain, with a function as a law replaced by the laws that it gives."""
    chain_fields = {field.name: getattr(chain, field.name) for field in fields(chain) if field.init}
    if chain_fields.get("vibrations") is vibration:
        del chain_fields["vibrations"]
    law = chain.law
    if law is not None and not isinstance(law, ContactLaw | YieldingLaw):
        laws: dict[tuple[Any, Any], ContactLaw] = {}

        def noted(bead: Bead, facing: Bead | Surface) -> ContactLaw:
            return laws.setdefault((bead, facing), law(bead, facing))

        guest_chain(replace(chain, law=noted), surface, flexibility, dt)
        chain_fields["law"] = KnownLaws(tuple((*pair, item) for pair, item in laws.items()))
    return chain_fields
