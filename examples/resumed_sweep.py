"""A sweep with a store: it resumes where it was stopped, longer axes run only the new points, failures are reported.

On a cluster, connect with `distributed.Client(address)` and put the calls of `sweep` below
`with joblib.parallel_config("dask"):`; see docs/python.md.
"""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.44)


def against(length: float, material: hl.Material) -> hl.CoSimulation:
    return hl.CoSimulation(chain, hl.rod([hl.Layer(material, length, radius=9.525e-3)], base="fixed"))


hl.sweep(against, until=1e-3, store="rods", length=[0.02], material=[hl.PTFE, hl.ACRYLIC])
runs = hl.sweep(against, until=1e-3, store="rods", length=[0.02, 0.04, -1.0], material=[hl.PTFE, hl.ACRYLIC])
print("AR", hl.amplitude_ratio(runs.sel(length=[0.02, 0.04]), sensor=7).values.round(3))
print("failed:", runs.error.sel(length=-1.0).values)
