"""Coupling of the chain with other programs: FMI units (FMUs) and preCICE."""

from coupling.ports.fmu import write_fmu
from coupling.ports.precice import run_in_precice

__all__ = ["run_in_precice", "write_fmu"]
