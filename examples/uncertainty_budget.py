"""How uncertain is AR near an edge? The budget of bead, plate and drop height, compared with runs drawn at random.

`python uncertainty_budget.py 10000` takes ten thousand draws, as docs/identification.md does.
"""

import sys
from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt

import hertzlink as hl


def build(
    distance: float = 0.02, thickness: float = 2.29e-3, bead_radius: float = 2.38e-3, bead_modulus: float = 200e9,
    plate_modulus: float = 68.9e9, plate_density: float = 2700.0, drop_height: float = 5e-3,
) -> hl.CoSimulation:  # fmt: skip
    """A chain of small beads on a plate with one clamped edge."""
    bead = hl.Sphere(bead_radius, replace(hl.STEEL_440C, youngs_modulus=bead_modulus))
    metal = replace(hl.ALUMINIUM_6061, youngs_modulus=plate_modulus, density=plate_density)
    chain = hl.Chain([bead] * 20, bead, hl.drop_speed(drop_height), gravity=9.81)
    return hl.CoSimulation(chain, hl.half_plane(thickness, metal, "clamped", distance, until=0.7e-3))


tolerances: dict[str, Any] = {  # standard uncertainties, as shops and data sheets state them
    "distance": "0.5 mm",
    "thickness": "0.02 mm",
    "bead_radius": "2 um",
    "bead_modulus": "2 %",
    "plate_modulus": "1.5 %",
    "plate_density": "0.5 %",
    "drop_height": "0.2 mm",
}
draws = int(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1].isdigit() else 400
budget = hl.uncertainty(build, 0.7e-3, 7, draws=draws, **tolerances)
print(f"AR {budget.value['amplitude_ratio']:.3f} ± {budget.standard['amplitude_ratio']:.4f}")
print(budget)
for name, (_, spread) in budget.sampled.items():
    more = 100.0 * (spread / budget.standard[name] - 1.0)
    print(f"{name}: the draws scatter {abs(more):.0f} % {'more' if more > 0.0 else 'less'} than the budget")

figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.0), layout="constrained", sharey=True)
titles = {"amplitude_ratio": "AR", "time_of_flight": "TOF"}
for (name, title), axes in zip(titles.items(), panels, strict=True):
    axes.barh(list(tolerances), [100.0 * budget.shares[one][name] for one in tolerances])
    axes.set(title=title, xlabel="share of the variance, %", xlim=(0.0, 100.0))
