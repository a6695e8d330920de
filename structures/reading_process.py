"""Reads a file in a process of limited time and memory: a damaged file may make a library crash, hang, or take both.

The process is this module: `python -P reading_process.py SCRIPT FUNCTION SECONDS BYTES FILE ARGUMENT …` writes what the
function returns to standard output as a pickle, for the process that started it.
"""

import os
import pickle
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

LEAST_PATIENCE = 120.0
"""Time by the clock, s, that a process may take on an idle machine, or twice that of the processor."""

LOAD = 4.0
"""Processes for each processor, where the system does not count them."""

MISSING = 3
"""Exit status where a library is missing."""


class Unread(Exception):
    """Why a process gave no answer: the library that is missing, or the last line that was written."""

    def __init__(self, said: str, missing: bool = False) -> None:
        super().__init__(said)
        self.said, self.missing = said, missing


def read_apart(script: Path, function: str, path: Path, *arguments: str, seconds: int, memory: int) -> Any:
    """Return what a function of a script, whose imports are few, returns for a file. Raises Unread."""
    command = [sys.executable, "-P", __file__, str(script), function, str(seconds), str(memory), str(path.resolve())]
    places = os.pathsep.join(place for place in sys.path if place)
    settings = {"PYTHONPATH": places, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    try:
        done = subprocess.run(
            [*command, *arguments], capture_output=True, check=False, env=os.environ | settings,
            stdin=subprocess.DEVNULL, timeout=patience(seconds), cwd=path.parent,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise Unread(f"ValueError: reading it takes more than {error.timeout:.0f} s") from None
    return answer_of(done.returncode, done.stdout, done.stderr)


def patience(seconds: int) -> float:
    """Return the time by the clock, s, for so much of the processor: longer where other processes wait for it."""
    load = os.getloadavg()[0] / (os.cpu_count() or 1) if hasattr(os, "getloadavg") else LOAD
    return max(LEAST_PATIENCE, 2.0 * seconds) * (1.0 + load)


def answer_of(status: int, answer: bytes, said: bytes) -> Any:
    """Return the answer from what a process left. Raises Unread."""
    if status != 0:
        raise Unread(said.decode("utf-8", "replace").strip().rpartition("\n")[2][:200], status == MISSING)
    return pickle.loads(answer)


def main(script: str, function: str, seconds: str, memory: str, *arguments: str) -> int:
    """Writes the answer, or leaves the reason as the last line of the standard error."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries print
    limit(int(seconds), int(memory))
    try:
        read = runpy.run_path(script)[function](*arguments)
    except ModuleNotFoundError as error:
        os.write(2, f"\n{error.name}".encode())
        return MISSING
    with answer:
        pickle.dump(read, answer)
    return 0


def limit(seconds: int, memory: int) -> None:
    """Bound the processor time, s, and the memory, B, of this process, as far as the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
