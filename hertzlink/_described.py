"""All modules that describe what users construct: cases and reports read what they describe."""

from importlib import import_module

for _module in (
    "coupling.cosimulation", "coupling.schemes.explicit", "coupling.schemes.iterated",
    "particles.deformable.deformable_chain", "particles.laws.computed", "plates.beam", "plates.builders",
    "plates.half_plane", "structures.cylinder", "structures.rod", "structures.solid", "structures.spherical_shell",
    "structures.structure",
):  # fmt: skip
    import_module(_module)
