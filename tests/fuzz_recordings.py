# ruff: noqa: T201 (a script that prints)
"""Damaged and hostile files of recorders: those that test_recorders writes, cut, with other bytes, or with huge counts.

Each is read, or refused by a ValueError in one line that begins with its name, within the limits of `reading_process`,
which a child has here that is forked from a process with the libraries loaded. All else is a fault.

    python tests/fuzz_recordings.py 2000 [seed] [format]    reports all faults, each kind once
"""

import faulthandler
import os
import random
import resource
import struct
import sys
import tempfile
import traceback
import warnings
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "coupling"))

import test_recorders

import hertzlink as hl
from coupling.results import binary_files
from structures.reading_process import limit

HUGE = (0, 1, 0x7F, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1)
SECONDS = 10
"""Of the processor, that a child may take; each file has less than 30 kB."""


def changed(content: bytes, drawn: random.Random) -> bytes:
    """Return a file with some changes, most of them in its head."""
    for _ in range(drawn.choice((1, 1, 2, 4))):
        data = bytearray(content)
        place = drawn.randrange(drawn.choice((64, 512, len(data))) or 1)
        kind = drawn.choice(("cut", "byte", "count", "count", "zeros", "digits"))
        if kind == "cut":
            data = data[: drawn.choice((place, len(data) - 1 - place % 3))]
        elif kind == "byte":
            data[place : place + 1] = drawn.randbytes(drawn.choice((1, 1, 4)))
        elif kind == "count":
            form = drawn.choice(("<I", ">I", "<Q", ">Q"))
            number = struct.pack(form, drawn.choice(HUGE) & (2 ** (8 * struct.calcsize(form)) - 1))
            data[place - place % 2 : place - place % 2 + len(number)] = number
        elif kind == "zeros":
            data[place : place + 16] = bytes(16)
        else:
            digit = next((k for k in range(place, len(data)) if 48 <= data[k] <= 57), place)
            data[digit : digit + 1] = drawn.choice((b"9999999999", b"-1", b"0", b"1e99", b"nan"))
        content = bytes(data)
    return content


def fault_of(path: Path) -> str:
    """Return what is wrong with the reading of a file, by a child."""
    child = os.fork()
    if not child:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # libraries print what they meet
        limit(SECONDS, 2 << 30)
        os._exit(_read(path))
    _, status, used = os.wait4(child, 0)
    if os.WIFSIGNALED(status):
        return "" if used.ru_utime + used.ru_stime >= SECONDS - 1 else f"signal {os.WTERMSIG(status)}"
    return Path("fault").read_text() if os.WEXITSTATUS(status) else ""


def _read(path: Path) -> int:
    fault = ""
    try:
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            hl.read_signal(path, {7: 1}, calibration=1.0, baseline=0.0)
    except ValueError as error:
        if "\n" in str(error) or path.name not in str(error):
            fault = f"raw ValueError: {error} {traceback.extract_tb(error.__traceback__)[-1]}"
    except Exception as error:  # noqa: BLE001 (whatever must not happen is sought)
        fault = f"{type(error).__name__}: {error} {traceback.extract_tb(error.__traceback__)[-1]}"
    Path("fault").write_text(fault)
    return bool(fault)


def main(tries: int, seed: int, only: str) -> int:
    """Report each kind of fault once; the files of all stay in a folder."""
    binary_files.read_apart = test_recorders.read_here
    os.chdir(tempfile.mkdtemp(prefix="recordings"))
    faulthandler.disable()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    good = {}
    for name, (write, library) in test_recorders.FORMATS.items():
        if only in name and find_spec(library) and (name != "tektronix.wfm" or find_spec("tm_data_types")):
            write(Path(name))
            for beside in Path().glob("recording.*"):
                beside.rename(beside.name.replace("recording", Path(name).stem))
            good[name] = Path(name).read_bytes()
            assert not _read(Path(name)), name  # here, which loads the library
    drawn, found = random.Random(seed), dict[str, int]()
    for done in range(tries):
        name = drawn.choice([*good])
        path = Path(name)
        path.write_bytes(changed(good[name], drawn))
        fault = fault_of(path)
        if fault:
            kind = f"{name}: {fault.split(':')[0]} {fault[-90:]}"
            if kind not in found:
                path.rename(f"wrong{done}-{name}")
                print(f"{Path().resolve()}/wrong{done}-{name}\n    {fault}", flush=True)
            found[kind] = found.get(kind, 0) + 1
        path.write_bytes(good[name])
    print(f"{tries} files of {len(good)} formats, {len(found)} kinds of fault: {found}")
    return 1 if found else 0


if __name__ == "__main__":
    arguments = sys.argv[1:4] + ["2000", "0", ""][len(sys.argv) - 1 :]
    sys.exit(main(int(arguments[0]), int(arguments[1]), arguments[2]))
