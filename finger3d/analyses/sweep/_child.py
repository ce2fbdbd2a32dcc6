"""Child process that presses batches of points: python -m ... PARENT_PID.

It reads pickled (body, points, size) from standard input, and writes (rows, reason) for each to standard output. It
ends with its parent.
"""

from __future__ import annotations

import os
import pickle
import sys

from finger3d._process import end_with
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.local import send


def main() -> None:
    """Press batches until standard input ends."""
    output = os.dup(1)  # what is printed must not come between the results
    os.dup2(2, 1)
    with os.fdopen(output, "wb") as results:
        while True:
            try:
                spec, points, size = pickle.load(sys.stdin.buffer)
            except EOFError:
                return
            try:
                rows, reason = worker.batch(spec, points, size), ""
            except Exception as error:  # noqa: BLE001 - the parent reports it, whatever it is
                rows, reason = [], f"{type(error).__name__}: {' '.join(str(error).split())}"
            send(results, (rows, reason))


if __name__ == "__main__":
    end_with(int(sys.argv[1]))
    main()
