"""The command `hertzlink`, also as `python -m hertzlink`."""

import os
import sys
from collections.abc import Sequence

# Small matrices gain little from threads, and beside other work threads wait for each other: studies and sweeps use
# processes instead. The libraries of linear algebra read these variables once, when they are loaded.
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"), "1")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, with settings for all that it loads and starts."""
    # Services and pythonw close standard streams; another file would get their numbers, and the printed text.
    while (handle := os.open(os.devnull, os.O_RDWR)) < 3:
        os.set_inheritable(handle, True)
    os.close(handle)
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115

    # Processes of sweeps must not import files beside a case. A notebook names a backend; figures go to files.
    os.environ.update({**ONE_THREAD, "PYTHONSAFEPATH": "1"} | os.environ, MPLBACKEND="Agg")
    from hertzlink import cli

    cli.main(arguments)


if __name__ == "__main__":
    # `python -m` looks first in the current folder, where a file may have the name of a library.
    if sys.path[0] in ("", os.getcwd()) and not os.path.isdir("hertzlink"):
        del sys.path[0]
    main()
