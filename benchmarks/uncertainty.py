"""The uncertainty budget of AR and TOF in the boundary study, compared with runs whose parameters are drawn at random.

The plate is the thesis's thinnest, clamped, with the chain 20 mm from its edge. The tolerances are those of shops and
data sheets. The figure shows the sampled runs and the normal distribution of the law of propagation.

    python benchmarks/uncertainty.py [draws] [figure.png]
"""

import platform
import sys
import warnings
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl
from coupling.inference.uncertainty import Uncertainty

UNTIL, SENSOR = 0.7e-3, 7

TOLERANCES = {
    "distance": "0.5 mm",
    "thickness": "0.02 mm",
    "bead_radius": "2 um",
    "bead_modulus": "2 %",
    "plate_modulus": "1.5 %",
    "plate_density": "0.5 %",
    "drop_height": "0.2 mm",
}
"""Standard uncertainties."""


def build(
    distance: float = 0.02, thickness: float = 2.29e-3, bead_radius: float = 2.38e-3, bead_modulus: float = 200e9,
    plate_modulus: float = 68.9e9, plate_density: float = 2700.0, drop_height: float = 5e-3,
) -> hl.CoSimulation:  # fmt: skip
    """Return a chain of small beads on a clamped half-plane."""
    bead = hl.Sphere(bead_radius, replace(hl.STEEL_440C, youngs_modulus=bead_modulus))
    metal = replace(hl.ALUMINIUM_6061, youngs_modulus=plate_modulus, density=plate_density)
    chain = hl.Chain([bead] * 20, bead, hl.drop_speed(drop_height), gravity=9.81)
    return hl.CoSimulation(chain, hl.half_plane(thickness, metal, "clamped", distance, until=UNTIL))


def draw(budget: Uncertainty, path: str) -> None:
    """Draw the sampled runs, the propagated distributions and the shares."""
    titles = {"amplitude_ratio": ("AR", 1.0), "time_of_flight": ("TOF, µs", 1e6)}
    figure, axes = plt.subplots(2, 2, figsize=(8.0, 5.0), layout="constrained", height_ratios=(3, 2))
    for (name, (title, scale)), (above, below) in zip(titles.items(), axes.T, strict=True):
        samples = scale * budget.samples[name][np.isfinite(budget.samples[name])]
        middle, width = scale * budget.value[name], scale * budget.standard[name]
        above.hist(samples, bins=60, density=True, color="C0", alpha=0.5, label=f"{samples.size} runs")
        places = np.linspace(middle - 4.0 * width, middle + 4.0 * width, 200)
        normal = np.exp(-0.5 * ((places - middle) / width) ** 2) / (width * np.sqrt(2.0 * np.pi))
        above.plot(places, normal, "C1", label="law of propagation")
        above.set(xlabel=title, yticks=[], ylim=(0.0, 1.35 * normal.max()))
        above.legend(frameon=False, fontsize="small", ncols=2, loc="upper center")
        names = sorted(budget.inputs, key=lambda parameter: budget.shares[parameter][name])
        below.barh([n.replace("_", " ") for n in names], [100.0 * budget.shares[n][name] for n in names], color="C0")
        below.set(xlabel="share of the variance, %", xlim=(0.0, 100.0))
        below.tick_params(axis="y", labelsize="small")
    figure.savefig(path, dpi=150)


def main() -> None:
    """Print the budget, compare it with the draws, and draw the figure if a path is given."""
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(f"Python {platform.python_version()}, numpy {np.__version__}; {draws} draws")
    budget = hl.uncertainty(build, UNTIL, SENSOR, draws=draws, **TOLERANCES)
    print(budget)
    for name, (_, spread) in budget.sampled.items():
        away, chance = spread / budget.standard[name] - 1.0, 1.0 / np.sqrt(2.0 * draws)
        print(f"{name}: sampled over propagated {100.0 * away:+.1f} % (± {100.0 * chance:.1f} % by chance)")
    if len(sys.argv) > 2:
        draw(budget, sys.argv[2])


if __name__ == "__main__":
    main()
