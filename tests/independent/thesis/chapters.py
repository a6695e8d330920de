"""All entries, in the order of the thesis."""

from . import geometry, layers, plates, rod_length, rods, shapes, spheres, theory
from .values import Chapter, Entry

CHAPTERS: tuple[Chapter, ...] = (
    theory.chapter, geometry.chapter, spheres.fem, spheres.losses, shapes.bodies, shapes.hollow,
    rods.chapter, rod_length.chapter, layers.upper, plates.aspect,
)  # fmt: skip


def entries(*groups: str) -> list[Entry]:
    """The entries of these groups, or all."""
    return [one for chapter in CHAPTERS if not groups or chapter.group in groups for one in chapter.entries]
