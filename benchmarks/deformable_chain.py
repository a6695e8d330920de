"""A chain of deformable beads on one core: explicit finite elements over the cells' size.

    python benchmarks/deformable_chain.py [--quick]

A striker and 20 beads of 316 steel, R = 2.38 mm, 0.5 m/s, over 200 µs (thesis, section 3.4). Point masses give 20.55 N
at contacts 15 and 16, and 569.1 m/s. Seconds are of the processor, without compilation.
"""

import argparse
import os
from time import process_time

import xarray as xr

import hertzlink as hl
from coupling.peaks import interpolated

BEAD = hl.Sphere(2.38e-3, hl.STEEL_316)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.5)
UNTIL = 200e-6
SPACINGS = (40e-6, 20e-6, 10e-6)
SENSORS = (7, 16)
CONTACTS = (15, 16)

HEAD = "spacing  degrees of    step    steps  seconds  contact 15  contact 16    speed   energy  momentum"
UNITS = "     µm     freedom      ns                           N           N      m/s    error     error"


def timed(spacing: float) -> tuple[xr.Dataset, float]:
    """The run, and the processor's seconds."""
    begin = process_time()
    run = hl.explicit_chain(CHAIN, UNTIL, spacing)
    return run, process_time() - begin


def peak(run: xr.Dataset, contact: int) -> float:
    """Greatest force of a contact, N."""
    force = run.contact_force.sel(contact=contact).values
    return interpolated(run.time.values, force, int(force.argmax()))[0]


def momentum_error(run: xr.Dataset) -> float:
    """Greatest change of the momentum, in units of the striker's."""
    total = run.velocity.sum("bead")
    return float(abs(total - total[0]).max() / total[0])


def row(spacing: float, run: xr.Dataset, seconds: float) -> str:
    """One line of the table."""
    peaks = "  ".join(f"{peak(run, contact):10.3f}" for contact in CONTACTS)
    mesh = f"{1e6 * spacing:7.3g}  {run.degrees_of_freedom:10d}  {1e9 * run.step:6.3f}  {UNTIL / run.step:7.0f}"
    errors = f"{hl.energy_error(run):7.0e}  {momentum_error(run):8.0e}"
    return f"{mesh}  {seconds:7.1f}  {peaks}  {hl.wave_speed(run, *SENSORS):7.2f}  {errors}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="the coarsest mesh only")
    quick = parser.parse_args().quick
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    hl.explicit_chain(CHAIN, 1e-6, SPACINGS[0])
    print(f"{HEAD}\n{UNITS}")
    for spacing in SPACINGS[:1] if quick else SPACINGS:
        print(row(spacing, *timed(spacing)), flush=True)


if __name__ == "__main__":
    main()
