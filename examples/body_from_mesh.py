"""A cube of acrylic from a mesh, on a table and free, compared with a half-space; see docs/meshes.md for files."""

import numpy as np
from skfem import MeshHex  # type: ignore[import-untyped]
from skfem.io.meshio import to_meshio  # type: ignore[import-untyped]

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, bead, hl.drop_speed(0.01))

side = 20e-3
grid = MeshHex.init_tensor(*3 * [np.linspace(0.0, side, 8)])
mesh = to_meshio(grid)  # or "cube.msh", with a physical group "table"
mesh.point_sets["table"] = np.flatnonzero(grid.p[2] == 0.0)
top = (side / 2.0, side / 2.0, side)

bodies = {
    "on a table": hl.solid(mesh, hl.ACRYLIC, contact=top, fixed="table", patch_radius=4.5e-3),
    "in the air": hl.solid(mesh, hl.ACRYLIC, contact=top, patch_radius=4.5e-3),
    "half-space": hl.half_space(hl.ACRYLIC),
}
for name, body in bodies.items():
    run = hl.CoSimulation(chain, hl.reduce(body, until=0.8e-3)).run(until=0.8e-3)
    print(f"{name}: AR {float(hl.amplitude_ratio(run, sensor=10)):.4f}")
