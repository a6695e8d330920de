"""Runs that people type, from the scripts in the folder above; memory and time by commit.

pip install asv && cd benchmarks && asv run main^!      this commit; `asv run --python=same --quick` in this environment
"""

import sys
import warnings
from pathlib import Path

import hertzlink as hl

sys.path.append(str(Path(__file__).parents[1]))

import free_chain
import natural_code

warnings.simplefilter("ignore", hl.HertzlinkWarning)


class Runs:
    """One run on each structure; the first, which compiles, is not counted."""

    params = ("layered rod", "reduced rod", "half-space")
    param_names = ("structure",)

    def setup(self, structure: str) -> None:
        rod = hl.rod(natural_code.LAYERS, base="fixed")
        facing = {"layered rod": rod, "reduced rod": hl.reduce(rod, 1.2e-3), "half-space": hl.half_space(hl.PTFE)}
        self.simulation = hl.CoSimulation(natural_code.chain(), facing[structure])
        self.run = self.simulation.run(natural_code.UNTIL)

    def time_run(self, structure: str) -> None:
        self.simulation.run(natural_code.UNTIL)

    def time_reflections(self, structure: str) -> None:
        hl.reflections(self.run, sensor=7)


class FreeChains:
    """Chains that face nothing, as compared with LAMMPS."""

    params = (20, 1_000)
    param_names = ("beads",)

    def setup(self, beads: int) -> None:
        self.run = free_chain.hertzlink_run(free_chain.impact(beads))

    def time_impact(self, beads: int) -> None:
        self.run()


class Import:
    """The time of the import in a fresh process."""

    def timeraw_import(self) -> str:
        return "import hertzlink"
