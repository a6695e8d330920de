"""ParaView's files of a `motion`."""

import os
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import xarray as xr

from coupling.plots.motion import known_motion

LISTING = "motion.pvd"
OWN_FILES = re.compile(r"motion(_\d+)?\.(vtu|pvd)")


def write_vtu(motion: xr.Dataset, folder: str | Path) -> Path:
    """Write a `motion` for ParaView: motion_0000.vtu, ... and motion.pvd.

    The files hold displacement (m), von Mises stress and, for beads, the stress components (Pa), and for each cell its
    part. Cells stay quadratic. A body of revolution is written as its half-plane (r, 0, −z).

    Parameters
    ----------
    motion : xarray.Dataset
        From `motion`.
    folder : str or Path
        The folder to write. A folder that holds only an earlier motion is replaced.

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
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    >>> chain = hl.DeformableChain([bead] * 2, bead, impact_speed=1.0, modes=2)
    >>> run = hl.CoSimulation(chain, None).run(until=10e-6)
    >>> motion = hl.plots.motion(run, chain, times=[4e-6, 5e-6], beads=[1])
    >>> hl.plots.write_vtu(motion, "paraview").name
    'motion.pvd'
    """
    import meshio  # type: ignore[import-untyped]

    known_motion(motion)
    target = Path(folder)
    if not target.absolute().parent.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: its parent folder does not exist")
    if target.exists() and not target.is_dir():
        raise ValueError(f"folder = {str(folder)!r}: is no folder; name another")
    foreign = [path.name for path in target.iterdir() if not OWN_FILES.fullmatch(path.name)] if target.exists() else []
    if foreign:
        raise ValueError(f"folder = {str(folder)!r}: holds {foreign[0]}; name another")
    with TemporaryDirectory(prefix=".", dir=target.absolute().parent) as temporary:
        part = Path(temporary, target.name)
        part.mkdir()
        listing = ElementTree.Element("VTKFile", type="Collection", version="0.1")
        collection = ElementTree.SubElement(listing, "Collection")
        cells, parts = [(motion.attrs["cell_type"], motion.cells.values)], {"part": [motion.part.values]}
        for number, moment in enumerate(motion.time.values.tolist()):
            fields = {name: motion[name].values[number] for name in ("displacement", "von_mises")}
            for which in motion.stress_component.values if "stress" in motion else ():
                fields[f"{which}_stress"] = motion.stress.sel(stress_component=which).values[number]
            name = f"motion_{number:04d}.vtu"
            meshio.Mesh(motion.position.values, cells, fields, parts).write(part / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(moment), part="0", file=name)
        ElementTree.indent(listing)
        ElementTree.ElementTree(listing).write(part / LISTING, encoding="utf-8", xml_declaration=True)
        shutil.rmtree(target, ignore_errors=True)
        os.replace(part, target)
    return target / LISTING
