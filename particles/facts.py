"""Facts of chains that differ in the impact speed only: made once, for a batch has thousands of such chains."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cached_property, wraps
from typing import Any, TypeVar

from particles.chain import Chain
from structures.surface import Surface

MOST_CHAINS = 64
"""Chains whose facts are kept at a time."""

CHAINS: dict[Any, tuple[Any, dict[str, Any]]] = {}
"""Parts of the last chains, and their facts."""

T = TypeVar("T")


def fact(make: Callable[[Any], T]) -> cached_property[T]:
    """Return a property that is made once for chains that differ in the impact speed only; as a decorator."""

    @wraps(make)
    def of_chain(chain: Any) -> T:
        made: T = chain.once(make.__name__, lambda: make(chain))
        return made

    return cached_property(of_chain)


def shared_facts(chain: Chain, springs: tuple[float, float], ends: tuple[Surface | None, Surface | None]) -> Any:
    """Return the facts of an earlier chain with the same parts and loads; empty where there is none, or parts may
    change.

    Only parts of our own never change. A user's bead, law or loss may. ends: what the last bead and the first one face;
    springs: the flexibilities there, m/N.
    """
    parts = (*chain.beads, chain.striker, chain.law, chain.dissipation, *ends)
    loads = chain.gravity, chain.inclination, chain.preload, *springs
    # Structures that differ make their surfaces anew; equal ones are as good.
    faced = [end if type(end) is Surface else id(end) for end in ends]
    key = type(chain), chain.impact_speed is None, loads, *faced, *map(id, parts[:-2])
    # Other threads may forget it meanwhile.
    if (entry := CHAINS.get(key)) is not None:
        return entry[1]
    facts = dict[str, Any]()
    if all(map(_never_changes, parts)):
        for old in list(CHAINS)[: 1 - MOST_CHAINS or None]:
            CHAINS.pop(old, None)
        # With the parts: another object could get the number of one that is gone.
        CHAINS[key] = parts, facts
    return facts


def _never_changes(part: Any) -> bool:
    """Return whether a part of a chain is plain, or a frozen dataclass of ours of such parts."""
    if part is None or isinstance(part, bool | int | float | str):
        return True
    if isinstance(part, tuple):
        return all(map(_never_changes, part))
    kind: Any = type(part)
    ours = kind.__module__.startswith(("hertzlink", "particles", "structures")) and is_dataclass(kind)
    if not ours or not kind.__dataclass_params__.frozen:
        return False
    return all(_never_changes(getattr(part, field.name)) for field in fields(kind))
