"""The command `hertzlink`, also as `python -m hertzlink`."""

import os
import signal
import sys
from collections.abc import Sequence

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
"""Where the libraries of linear algebra read how many threads they may use, once, as they are loaded."""

STOPPED = 130
"""Exit code after Ctrl-C."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line with one thread of linear algebra.

    The matrices of a case are small: threads gain little on an idle machine, and beside other work they wait for each
    other and take ten times as long. Studies and sweeps use processes instead.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")
    try:
        from hertzlink import cli
    except KeyboardInterrupt:
        # What follows must not be stopped again, as by the second signal that some programs send.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print("hertzlink: stopped; nothing was written", file=sys.stderr)  # noqa: T201
        sys.exit(STOPPED)
    cli.main(arguments)


if __name__ == "__main__":
    main()
