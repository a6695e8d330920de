"""Whether the intervals of `identify` keep what they promise under hum, drift, correlated noise and outliers.

For each kind: how many draws hold the truth in the 95 % interval, how many are "identified", and how many of these hold
it; the half-width; and the processor time.

    python benchmarks/noise.py [draws] [case of identification.py] [kind ...]
"""

import platform
import sys
import warnings
from collections.abc import Callable
from time import process_time

import numpy as np
from identification import LEAD, NOISE, SPEED, UNTIL, cases, clean
from scipy.signal import lfilter

import hertzlink as hl

HUM, DRIFT, MEMORY, OUTLIERS = 0.03, 0.05, 0.95, 0.005
"""In parts of the peak: amplitude of 50 Hz with its third harmonic, and rise over the record; the correlation
from sample to sample; the part of samples that are outliers, of ten standard deviations."""


def hum(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """50 Hz and its third harmonic at any phase, beside white noise."""
    first, third = random.uniform(0.0, 2.0 * np.pi, 2)
    wave = 0.8 * np.sin(2 * np.pi * 50.0 * time + first) + 0.2 * np.sin(2 * np.pi * 150.0 * time + third)
    return white(random, time) + HUM * wave


def drift(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """A ramp either way, beside white noise."""
    return white(random, time) + DRIFT * random.uniform(-1.0, 1.0) * (time - time[0]) / np.ptp(time)


def white(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """White noise."""
    return random.normal(0.0, NOISE, time.size)


def correlated(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """Noise of first order, of the same size."""
    steps = random.normal(0.0, NOISE * np.sqrt(1.0 - MEMORY**2), time.size + 1000)
    return lfilter([1.0], [1.0, -MEMORY], steps)[1000:]


def outliers(random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """White noise with few samples far off."""
    far = random.random(time.size) < OUTLIERS
    return white(random, time) + 10.0 * NOISE * far * random.choice([-1.0, 1.0], time.size)


KINDS: dict[str, Callable[[np.random.Generator, np.ndarray], np.ndarray]] = {
    "white": white, "hum": hum, "drift": drift, "correlated": correlated, "outliers": outliers,
}  # fmt: skip


def main() -> None:
    """One row for each kind of noise."""
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    draws, name, *kinds = [*sys.argv[1:], *("200", "rod modulus")[len(sys.argv) - 1 :]]
    case = next(iter(cases([name]).values()))
    time, forces = clean(case)
    ranges = {case.name: (0.6 * case.truth, 1.5 * case.truth), "impact_speed": (0.25, 0.38)}
    guess = {case.name: 1.005 * case.truth, "impact_speed": 1.005 * SPEED}
    print(f"Python {platform.python_version()}, numpy {np.__version__}; {name}, {draws} draws; lead {LEAD:g} s")
    print("noise        holds  identified  of these hold  half-width  s each")
    for kind in kinds or KINDS:
        holds, identified, both, widths, spent = 0, 0, 0, [], process_time()
        for draw in range(int(draws)):
            random = np.random.default_rng(draw)
            noisy = {n: force + force.max() * KINDS[kind](random, time) for n, force in forces.items()}
            result = hl.identify(hl.as_signal(time, noisy), case.build, until=UNTIL, guess=guess, **ranges)
            low, high = result[case.name].interval
            inside = low <= case.truth <= high
            holds += inside
            identified += result.identified
            both += inside and result.identified
            widths.append(0.5 * (high - low) / case.truth)
        share = f"{100 * both / identified:.0f} %" if identified else "-"
        print(
            f"{kind:11s} {100 * holds / int(draws):5.0f} % {100 * identified / int(draws):9.0f} % {share:>12s} "
            f"{100 * np.median(widths):10.2f} % {(process_time() - spent) / int(draws):7.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
