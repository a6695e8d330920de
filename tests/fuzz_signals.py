# ruff: noqa: T201 (a script that prints)
"""Damaged files of oscilloscopes: a good one, of which bytes, lines or cells are changed.

A damaged file may be read, with the right waves or a warning, or be refused by a ValueError in one line that begins
with the file. Everything else is a fault: another exception, more than 10 s, or another peak without a word. A record
that ends before the reflected wave does, and a unit that the header states anew, are none.

    python tests/fuzz_signals.py 20000 [seed] [folder of other files]    reports all faults, each kind once
"""

import os
import random
import re
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

import hertzlink as hl

LONGEST = 10.0
"""Time that a file may take, s of the processor."""

SAME = 0.02
"""Peaks and times of flight agree within this part, or something must be said."""

TIME = 5e-7 * np.arange(-200, 1000)
FORCE = sum(a * np.exp(-(((TIME - at) / 1.2e-5) ** 2)) for a, at in ((1.2, 6e-5), (0.6, 3.6e-4)))
NOISE = np.random.default_rng(1).normal(0.0, 0.005, TIME.size)
UNITS = (b"ms", b"us", b"mV", b"kN", b"pC")
"""Units among the words below."""

Waves = tuple[float, float, float]
"""Peak of the incident wave, N; time of flight, s; and the time by which the reflected wave is over, s."""

WORDS = (
    *(
        "",
        "nan",
        "inf",
        "OVER",
        "9.9E+37",
        "****",
        "-1.#IND",
        "1e5",
        "-1e5",
        "0",
        "1,5",
        "\u22121",
        '"',
        "''",
        ";",
        "\t",
        "1e-3e",
        "é",
    ),
    *(
        "(ms)",
        "(mV)",
        "ms",
        "mV",
        "kN",
        "Time (us)",
        "CH1 [pC]",
        "Sample Interval,1e-6",
        "10:23:11.5",
        "\x00",
        "\x1a",
        "\r",
        "1e999",
    ),
    *(
        "Record Length,7",
        "Vertical Units,mV",
        "XInc,2e-6",
        "Segments,2",
        "# end",
        ",,",
        "=1+1",
        "-",
        "+",
        "e",
        "0x10",
        "1_0",
    ),
)


def written(form: str, head: str, second: float = 1.0, volt: float = 1.0, comma: bool = False) -> bytes:
    """A file of one form."""
    rows = [
        form.format(t=second * t, v=volt * v, k=k) for k, (t, v) in enumerate(zip(TIME, FORCE + NOISE, strict=True))
    ]
    text = "\r\n".join([head, *(row.replace(".", ",") if comma else row for row in rows), ""])
    return text.encode()


FILES: dict[str, tuple[bytes, int]] = {
    "plain": (written("{t:.8e},{v:.6e},{v:.6e}", "time (s),ch1 (V),ch2 (V)"), 1),
    "pico": (written("{t:.7f};{v:.6f}", "Zeit;Kanal A\r\n(ms);(mV)\r\n", 1e3, 1e3, True), 1),
    "rigol": (written("{k},{v:.5e},", "X,CH1,Start,Increment,\r\nSequence,Volt,-1.0e-4,5.0e-7"), 1),
    "tektronix": (written("{t:.8e},{v:.5f}", 'Model,MSO54\r\nHorizontal Units,s\r\nVertical Units,V\r\nTIME,CH1'), 1),
    "two times": (written("{t:.8e},{v:.5f},{t:.8e},{v:.5f}", "t1 (s),ch1 (V),t2 (s),ch2 (V)"), 3),
    "doubled": (written("{t:.1f},{v:.4f}", "Zeit (µs),Kanal 1 (V)", 1e6, 1.0, True), 1),
    "coarse": (written("{t:.6f}\t{v:.6f}", "X_Value\tVoltage"), 1),
    "thousands": (written('{t:.1f},"{v:,.0f}"', '"time (us)","ch1 (uV)"', 1e6, 1e6), 1),
}  # fmt: skip


def damaged(content: bytes, drawn: random.Random) -> bytes:
    """A file with one to three changes."""
    for _ in range(drawn.choice((1, 1, 2, 3))):
        content = drawn.choice(CHANGES)(content, drawn)
    return content


def _byte(content: bytes, drawn: random.Random) -> bytes:
    place = drawn.randrange(len(content) + 1)
    return content[:place] + bytes([drawn.randrange(256)]) + content[place + drawn.randrange(2) :]


def _cut(content: bytes, drawn: random.Random) -> bytes:
    return content[: drawn.randrange(len(content) + 1)]


def _hole(content: bytes, drawn: random.Random) -> bytes:
    place = drawn.randrange(len(content) + 1)
    return content[:place] + content[place + drawn.choice((1, 10, 100, 1000, 10_000)) :]


def _zeros(content: bytes, drawn: random.Random) -> bytes:
    place = drawn.randrange(len(content) + 1)
    return content[:place] + bytes(drawn.choice((1, 50, 4096))) + content[place:]


def _lines(content: bytes, drawn: random.Random) -> bytes:
    """A line left out, doubled, moved, blank, or text."""
    lines = content.split(b"\n")
    place, other = drawn.randrange(len(lines)), drawn.randrange(len(lines))
    kind = drawn.choice(("out", "twice", "moved", "swapped", "word", "again"))
    if kind == "out":
        del lines[place]
    elif kind == "twice":
        lines.insert(place, lines[place])
    elif kind == "moved":
        lines.insert(other, lines.pop(place))
    elif kind == "swapped":
        lines[place], lines[other] = lines[other], lines[place]
    elif kind == "word":
        lines.insert(place, drawn.choice(WORDS).encode())
    else:
        lines += lines[place:]
    return b"\n".join(lines)


def _cell(content: bytes, drawn: random.Random) -> bytes:
    """A cell replaced by a word, in one line, in some or in the header."""
    lines = content.split(b"\n")
    word = drawn.choice(WORDS).encode()
    first = drawn.choice((0, drawn.randrange(len(lines))))
    for place in range(first, min(len(lines), first + drawn.choice((1, 1, 1, 5, 40)))):
        cells = re.split(rb"([,;\t])", lines[place])
        cells[2 * drawn.randrange((len(cells) + 1) // 2)] = word
        lines[place] = b"".join(cells)
    return b"\n".join(lines)


def _ends(content: bytes, drawn: random.Random) -> bytes:
    return content.replace(b"\r\n", drawn.choice((b"\n", b"\r", b"\r\r\n", b"\r\n\r\n", b" \r\n", b",\r\n")))


def _encoded(content: bytes, drawn: random.Random) -> bytes:
    return content.decode("latin-1").encode(
        drawn.choice(("utf-16", "utf-16-be", "utf-8-sig", "utf-32")), errors="replace"
    )


CHANGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    *(_byte, _byte, _cut, _hole, _zeros, _lines, _lines, _cell, _cell, _ends, _encoded),
)


def attempt(content: bytes, column: int, expected: Waves | None) -> str | None:
    """Read a file; the fault, if there is one."""
    path = Path("scope.csv")
    path.write_bytes(content)
    began = time.process_time()
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            signal = hl.read_signal(path, {7: column}, calibration=25.0)
    except ValueError as error:
        text, last = str(error), traceback.extract_tb(error.__traceback__)[-1]
        if (
            "\n" in text
            or not text.startswith(("scope.csv", "calibration"))
            or not (last.line or "").startswith("raise")
        ):
            return f"raw ValueError [{Path(last.filename).name}:{last.lineno}]: {text[:200]!r}"
        return None
    except Exception as error:  # noqa: BLE001 (whatever must not happen is sought)
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} [{Path(last.filename).name}:{last.lineno}]: {str(error)[:200]}"
    finally:
        taken = time.process_time() - began
        if taken > LONGEST:
            print(f"slow: {taken:.1f} s", flush=True)
    if taken > LONGEST:
        return f"takes {taken:.1f} s"
    if [*map(str, (one.category.__name__ for one in said))] != ["HertzlinkWarning"] * len(said):
        return f"raw warning: {said[0].category.__name__} {said[0].message}"
    # A file that ends early and does not say so is a short record.
    if said or expected is None or signal.time[-1] < expected[2]:
        return None
    try:
        found = measured(signal)
    except ValueError:
        return "silent: no waves"
    near = all(abs(one - other) <= SAME * other for one, other in zip(found[:2], expected[:2], strict=True))
    return None if near else f"silent: {found} for {expected}"


def measured(signal: xr.Dataset) -> Waves:
    """What is compared."""
    waves = hl.reflections(signal, 7)
    over = waves.incident.arrival + waves.primary.time_of_flight + 5e-5
    return waves.incident.amplitude, waves.primary.time_of_flight, over


def restated(content: bytes, good: bytes) -> bool:
    """Whether a word that was put above the samples states another unit, which no check can know to be wrong."""
    heads = [b"\n".join(one.replace(b"\0", b"").split(b"\n")[:6]) for one in (content, good)]
    return any(heads[0].count(unit) > heads[1].count(unit) for unit in UNITS)


def main(tries: int, seed: int, folder: str | None) -> int:
    """Report each kind of fault once; the files of all stay in a folder."""
    files = dict(FILES)
    if folder:
        files = {one.name: (one.read_bytes(), 1) for one in sorted(Path(folder).iterdir()) if one.is_file()}
    drawn, found, slowest = random.Random(seed), dict[str, int](), 0.0
    os.chdir(tempfile.mkdtemp(prefix="signals"))
    good = {name: waves_of(*one) for name, one in files.items()}
    for done in range(tries):
        if done % 1000 == 0:
            print(f"{done} files, slowest {slowest:.2f} s, faults {found}", flush=True)
        name = drawn.choice([*files])
        content = damaged(files[name][0], drawn)
        began = time.process_time()
        fault = attempt(content, files[name][1], good[name])
        if fault and fault.startswith("silent") and restated(content, files[name][0]):
            fault = None
        slowest = max(slowest, time.process_time() - began)
        if fault:
            kind = f"{name}: {fault.split(':')[0]}"
            Path(f"wrong{done}.csv").write_bytes(content)
            if kind not in found:
                print(f"{Path().resolve()}/wrong{done}.csv\n    {name}: {fault}", flush=True)
            found[kind] = found.get(kind, 0) + 1
    print(f"{tries} files, slowest {slowest:.2f} s, {len(found)} kinds of fault: {found}")
    return 1 if found else 0


def waves_of(content: bytes, column: int) -> Waves | None:
    """What a good file holds; None for one that is refused."""
    Path("scope.csv").write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return measured(hl.read_signal("scope.csv", {7: column}, calibration=25.0))
    except ValueError:
        return None


if __name__ == "__main__":
    others = sys.argv[3] if len(sys.argv) > 3 else None
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0, others))
