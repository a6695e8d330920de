"""The command `hertzlink`, also as `python -m hertzlink`."""

import os
import signal
import sys
from collections.abc import Sequence

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
"""Where the libraries of linear algebra read how many threads they may use, once, as they are loaded."""

STREAMS = ("stdin", "stdout", "stderr")

WRONG = 2
"""Exit code where hertzlink cannot be loaded, as for wrong input."""

STOPPED = 130
"""Exit code after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line with one thread of linear algebra.

    The matrices of a case are small: threads gain little on an idle machine, and beside other work they wait for each
    other and take ten times as long. Studies and sweeps use processes instead.
    """
    _open_closed_streams()
    # A notebook names a backend that need not be installed here; figures go to files.
    os.environ["MPLBACKEND"] = "Agg"
    for name in THREADS:
        os.environ.setdefault(name, "1")
    try:
        from hertzlink import cli
    except KeyboardInterrupt:
        # What follows must not be stopped again, as by the second signal that some programs send.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print("hertzlink: stopped; nothing was written", file=sys.stderr)  # noqa: T201
        sys.exit(STOPPED)
    except ImportError as error:
        print(f"hertzlink: {error}", file=sys.stderr)  # noqa: T201
        sys.exit(WRONG)
    cli.main(arguments)


def _open_closed_streams() -> None:
    """Lead what is said nowhere if the caller closed standard output or errors, as services and pythonw do.

    Another file would otherwise get their numbers, and what is printed.
    """
    while (handle := os.open(os.devnull, os.O_RDWR)) < len(STREAMS):
        os.set_inheritable(handle, True)
    os.close(handle)
    for name in STREAMS:
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115


if __name__ == "__main__":
    main()
