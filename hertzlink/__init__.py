"""hertzlink simulates solitary waves in chains of beads, and their reflection from structures.

A striker taps one end of a chain of beads. The other end touches a structure: a half-space, a rod or a plate. The
discrete-particle model of the chain and the finite-element model of the structure are coupled through the Hertzian
contact at the last bead. The results are the amplitude ratio (AR) and the time of flight (TOF) of the reflected waves.

Its public names are listed in `__init__.pyi`; each is imported when it is first used. A first run:

>>> import hertzlink as hl
>>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
>>> chain = hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01))
>>> rod = hl.rod([hl.Layer(hl.STEEL_440C, length=0.1, radius=9.525e-3)])
>>> run = hl.CoSimulation(chain, rod).run(until=1e-3)
>>> round(float(hl.time_of_flight(run, sensor=7)) * 1e6)
461
"""

from importlib import import_module

from hertzlink._names import PUBLIC as _PUBLIC

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> object:
    """Import what is used for the first time; for an unknown name, raise an error that gives the nearest one.

    lazy_loader cannot serve here: it imports from submodules of one package, and the rooms are packages of their own.
    """
    if name == "__version__":
        from coupling.results.provenance import version_of

        return version_of(__name__)
    from hertzlink._names import namespaces

    if name not in _PUBLIC:
        from structures.checks import near

        places = {public: public for public in _PUBLIC}
        places = {inner: f"{space}.{inner}" for space, names in namespaces().items() for inner in names} | places
        matches = [] if name.startswith("_") else near(name, places)
        hint = f"; did you mean {__name__}.{places[matches[0]]}?" if matches else ""
        # Without `obj` Python would add a suggestion of its own, which may be another name.
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}", name=name, obj=None)
    if _PUBLIC[name] == __name__:
        space = import_module(f"{__name__}.{name}")
        vars(space)["__all__"] = namespaces()[name]  # for help(), which otherwise leaves out imported names
        return space
    globals()[name] = getattr(import_module(_PUBLIC[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    return list(__all__)
