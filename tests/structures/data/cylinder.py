"""Writes cylinder.msh next to this file, with gmsh 4.15.2 (pip install gmsh; not needed by the tests).

A cylinder of radius 9.53 mm and length 50.8 mm, in m, of curved tetrahedra; struck at (0, 0, 50.8 mm), held at "base".
"""

from pathlib import Path

import gmsh

RADIUS, LENGTH = 9.53e-3, 50.8e-3

gmsh.initialize()
gmsh.model.occ.addCylinder(0.0, 0.0, 0.0, 0.0, 0.0, LENGTH, RADIUS)
struck = gmsh.model.occ.addPoint(0.0, 0.0, LENGTH)
gmsh.model.occ.synchronize()
[base] = [tag for _, tag in gmsh.model.getEntities(2) if abs(gmsh.model.occ.getCenterOfMass(2, tag)[2]) < 1e-9]
gmsh.model.addPhysicalGroup(2, [base], name="base")
gmsh.model.addPhysicalGroup(3, [1], name="body")

field = gmsh.model.mesh.field
field.add("Distance", 1)
field.setNumbers(1, "PointsList", [struck])
field.add("Threshold", 2)
field.setNumber(2, "InField", 1)
for name, size in (("SizeMin", 0.6e-3), ("SizeMax", 5e-3), ("DistMin", 1.5e-3), ("DistMax", 15e-3)):
    field.setNumber(2, name, size)
field.setAsBackgroundMesh(2)
for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
    gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)
gmsh.option.setNumber("Mesh.ElementOrder", 2)
gmsh.model.mesh.generate(3)
gmsh.write(str(Path(__file__).with_name("cylinder.msh")))
gmsh.finalize()
