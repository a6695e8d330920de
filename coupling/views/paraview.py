"""A `structure_motion` or `bead_motion` as files that ParaView opens: a .vtu for each time, a .pvd that lists them."""

import re
import shutil
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import xarray as xr

from coupling.views.motion import known_motion

LISTING = "motion.pvd"
OURS = re.compile(r"motion(_\d+)?\.(vtu|pvd)")


def write_vtu(motion: xr.Dataset, folder: str | Path) -> Path:
    """Write a `structure_motion` or `bead_motion` into a folder: motion_0000.vtu, ... and motion.pvd; the path of that.

    Displacement (m), von_mises and, of beads, the stresses (Pa); for each cell, part; cells stay quadratic. A body of
    revolution is written as its half-plane (r, 0, −z). The folder is made, whole or not at all; one that holds an
    earlier motion and nothing else is replaced, any other is left alone (ValueError).
    """
    import meshio  # type: ignore[import-untyped]

    known_motion(motion)
    target = _folder(folder)
    beside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        beside.chmod(0o755)
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        cells, parts = [(motion.attrs["cell_type"], motion.cells.values)], {"part": [motion.part.values]}
        for number, moment in enumerate(motion.time.values.tolist()):
            fields = {name: motion[name].values[number] for name in ("displacement", "von_mises")}
            for which in motion.stress_component.values if "stress" in motion else ():
                fields[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            meshio.Mesh(motion.position.values, cells, fields, parts).write(beside / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(moment), part="0", file=name)
        ElementTree.indent(listing)
        ElementTree.ElementTree(listing).write(beside / LISTING, encoding="utf-8", xml_declaration=True)
        old = beside.with_name(beside.name + "-old")
        if target.exists():
            target.rename(old)
        beside.rename(target)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return Path(folder) / LISTING


def _folder(folder: str | Path) -> Path:
    """The folder, or a ValueError where it cannot be written."""
    if not isinstance(folder, str | Path):
        raise ValueError(f"folder = {folder!r}: must be the name of a folder")
    whole = Path(folder).resolve()
    if not whole.parent.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: its parent folder does not exist")
    if whole.exists():
        foreign = [] if not whole.is_dir() else [path.name for path in whole.iterdir() if not OURS.fullmatch(path.name)]
        if not whole.is_dir() or foreign or whole == Path.cwd() or whole in Path.cwd().parents:
            held = f"holds {foreign[0]}" if foreign else "is no folder of an earlier motion"
            raise ValueError(f"folder = {str(folder)!r}: {held}; name another")
    return whole
