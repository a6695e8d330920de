"""A `structure_motion` or `bead_motion` as files for ParaView: a .vtu for each time, and a .pvd that lists them."""

import re
from pathlib import Path
from xml.etree import ElementTree

import xarray as xr

from coupling.files.writing import whole_folder
from coupling.plots.motion import known_motion

LISTING = "motion.pvd"
OWN_FILES = re.compile(r"motion(_\d+)?\.(vtu|pvd)")


def write_vtu(motion: xr.Dataset, folder: str | Path) -> Path:
    """Write a `structure_motion` or `bead_motion` for ParaView: motion_0000.vtu, ... and motion.pvd.

    The files hold displacement (m), von Mises stress and, for beads, the stress components (Pa), and for each cell its
    part. Cells stay quadratic. A body of revolution is written as its half-plane (r, 0, −z).

    Parameters
    ----------
    motion : xarray.Dataset
        From `structure_motion` or `bead_motion`.
    folder : str or Path
        The folder to write, completely or not at all. A folder that holds only an earlier motion is replaced.

    Returns
    -------
    Path
        The path of motion.pvd.

    Raises
    ------
    ValueError
        If the folder holds other files, or cannot be written.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, bead, impact_speed=0.1)
    >>> body = hl.layered_cylinder([hl.Layer(hl.STEEL_440C, 20e-3, 9.5e-3)], patch_radius=2e-3, cells=2)
    >>> body = hl.reduce(body, until=0.2e-3, keep_field=True)
    >>> run = hl.CoSimulation(chain, body).run(until=0.2e-3)
    >>> motion = hl.plots.structure_motion(run, body, times=[100e-6, 110e-6])
    >>> hl.plots.write_vtu(motion, "paraview").name
    'motion.pvd'
    """
    import meshio  # type: ignore[import-untyped]

    known_motion(motion)
    target = _folder(folder)
    with whole_folder(target, lambda path: bool(OWN_FILES.fullmatch(path.name))) as temporary:
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        cells, parts = [(motion.attrs["cell_type"], motion.cells.values)], {"part": [motion.part.values]}
        for number, moment in enumerate(motion.time.values.tolist()):
            fields = {name: motion[name].values[number] for name in ("displacement", "von_mises")}
            for which in motion.stress_component.values if "stress" in motion else ():
                fields[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            meshio.Mesh(motion.position.values, cells, fields, parts).write(temporary / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(moment), part="0", file=name)
        ElementTree.indent(listing)
        ElementTree.ElementTree(listing).write(temporary / LISTING, encoding="utf-8", xml_declaration=True)
    return Path(folder) / LISTING


def _folder(folder: str | Path) -> Path:
    """Return the folder; raise a ValueError if it cannot be written."""
    if not isinstance(folder, str | Path):
        raise ValueError(f"folder = {folder!r}: must be the name of a folder")
    place = Path(folder).resolve()
    if not place.parent.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: its parent folder does not exist")
    if place.exists():
        foreign = (
            [] if not place.is_dir() else [path.name for path in place.iterdir() if not OWN_FILES.fullmatch(path.name)]
        )
        if not place.is_dir() or foreign or place == Path.cwd() or place in Path.cwd().parents:
            held = f"holds {foreign[0]}" if foreign else "is no folder of an earlier motion"
            raise ValueError(f"folder = {str(folder)!r}: {held}; name another")
    return place
