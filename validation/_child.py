"""Cases run one after the other, each in a process of its own, so that no case shadows another's memory or caches.

Processes are forked from one that has only loaded the libraries.  A peak is VmHWM of the process that did the work:
ru_maxrss would start at its parent's.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

from finger3d.geometry.design import import_from

PACKAGE = "finger3d_validation"
HOME = Path(__file__).resolve().parent

_TIMES = {"seconds", "processor_seconds"}


def peak_mb() -> float:
    """Largest resident memory (MB) of this process since its start or the last `reset_peak`."""
    return _kilobytes("/proc/self/status", "VmHWM") / 1024.0


def available_gb() -> float:
    """Memory (GB) that processes can get without swapping, page cache included."""
    return _kilobytes("/proc/meminfo", "MemAvailable") * 1024e-9


def _kilobytes(file: str, key: str) -> float:
    lines = Path(file).read_text(encoding="ascii").splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith(f"{key}:")))


def reset_peak() -> None:
    """Forget the peak so far (proc(5), clear_refs)."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


class Bench:
    """Calls functions ``(case: dict) -> dict`` of a module in this folder, each in a process of its own."""

    def __init__(self, module: str) -> None:
        self.module = module

    def __enter__(self) -> Bench:
        known = HOME, PACKAGE, self.module
        server = multiprocessing.get_context("forkserver")
        server.set_forkserver_preload([f"validation.{self.module}"])
        self._pool = ProcessPoolExecutor(1, server, import_from, known, max_tasks_per_child=1)
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()

    def __call__(self, function: str, case: dict[str, Any]) -> dict[str, Any]:
        """Answer of one call, with `load`, the machine's load average when it began."""
        load = os.getloadavg()[0]
        answered = import_from(HOME, PACKAGE, "_child").answer  # under the name that the process knows it by
        return {**self._pool.submit(answered, self.module, function, case, dict(os.environ)).result(), "load": load}


def answer(module: str, function: str, case: dict[str, Any], environment: Mapping[str, str]) -> dict[str, Any]:
    """What a process does: load the libraries, call the function, and add the peak; its output goes to stderr."""
    os.dup2(2, 1)
    os.environ.clear()
    os.environ.update(environment)  # the server has that of its start
    known = sys.modules[f"{PACKAGE}.{module}"]
    known.prepare()
    found = getattr(known, function)(case)
    return {"peak_MB": peak_mb(), **found}


def best_of(
    bench: Bench, function: str, cases: Iterable[Any], repeats: Callable[[float], int]
) -> dict[Any, dict[str, Any]]:
    """Answers by case (a frozen dataclass), all times the least of `repeats(seconds of the first run)` runs.

    Rounds go over all cases in turn, so that a busy minute of the machine does not fall on one case alone.  Times are
    what stands under "seconds" and "processor_seconds", dicts; peaks under "peak_MB", of which the largest is kept.
    """
    found, wanted = {}, {}
    turn, left = 0, list(cases)
    while left:
        for case in left:
            begin = time.perf_counter()
            answer = bench(function, asdict(case))
            if turn == 0:
                wanted[case] = repeats(time.perf_counter() - begin)
                found[case] = answer
                continue
            known = found[case]
            for times in _TIMES & known.keys():
                known[times] = {k: min(v, answer[times][k]) for k, v in known[times].items()}
            known["peak_MB"] = max(known["peak_MB"], answer["peak_MB"])
            known["load"] = max(known["load"], answer["load"])
        turn += 1
        left = [c for c in left if wanted[c] > turn]
    return found
