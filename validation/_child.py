"""Cases run one after the other, each in a process of its own, so that no case shadows another's memory or caches.

Run as a program this file reads a job a line, forks, and writes the answer as a line; the libraries are loaded once,
before the first fork.  A peak is VmHWM of the process that did the work: ru_maxrss would start at its parent's.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
import traceback
import types
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

PACKAGE = "finger3d_validation"
HOME = Path(__file__).resolve().parent

_TIMES = {"seconds", "processor_seconds"}

Key = TypeVar("Key")


def peak_mb() -> float:
    """Largest resident memory (MB) of this process since its start or the last `reset_peak`."""
    return _kilobytes("/proc/self/status", "VmHWM") / 1024.0


def available_gb() -> float:
    """Memory (GB) that processes can get without swapping, page cache included."""
    return _kilobytes("/proc/meminfo", "MemAvailable") * 1024e-9


def _kilobytes(file: str, key: str) -> float:
    for line in Path(file).read_text(encoding="ascii").splitlines():
        if line.startswith(f"{key}:"):
            return float(line.split()[1])
    raise OSError(f"{file} has no {key}")


def reset_peak() -> None:
    """Forget the peak so far (proc(5), clear_refs)."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


class Bench:
    """Calls functions ``(case: dict) -> dict`` of a module in this folder, each in a fork of its own."""

    def __init__(self, module: str) -> None:
        self.module = module

    def __enter__(self) -> Bench:
        root = str(HOME.parent)
        path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        command = [sys.executable, "-P", str(HOME / "_child.py"), self.module]
        self._server = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": path}
        )
        return self

    def __exit__(self, *_: object) -> None:
        self._server.communicate()

    def __call__(self, function: str, case: dict[str, Any]) -> dict[str, Any]:
        """Answer of one call, with `load`, the machine's load average when it began.

        Raises
        ------
        RuntimeError
            With the traceback of what went wrong there.
        """
        stdin, stdout = self._server.stdin, self._server.stdout
        if stdin is None or stdout is None:
            raise RuntimeError("the server's pipes are closed")
        load = os.getloadavg()[0]
        stdin.write(json.dumps([function, case]) + "\n")
        stdin.flush()
        line = stdout.readline()
        answer = json.loads(line) if line else {"error": "the server ended"}
        if "error" in answer:
            raise RuntimeError(f"{function} {case}: {answer['error']}")
        return {**answer, "load": load}


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


def _answer(function: Callable[[dict[str, Any]], dict[str, Any]], case: dict[str, Any], to: int) -> None:
    """What a fork does: its own output goes to stderr, its answer into the pipe."""
    os.dup2(2, 1)
    try:
        answer = function(case)
        text = json.dumps({"peak_MB": peak_mb(), **answer})
    except Exception:  # noqa: BLE001 - handed on as text, and raised again where the case was asked for
        text = json.dumps({"error": traceback.format_exc()})
    with os.fdopen(to, "w") as pipe:
        pipe.write(text)


def _serve(module_name: str) -> None:
    package = types.ModuleType(PACKAGE)
    package.__path__ = [str(HOME)]
    sys.modules[PACKAGE] = package
    module = importlib.import_module(f"{PACKAGE}.{module_name}")
    module.prepare()
    for line in sys.stdin:
        function, case = json.loads(line)
        source, to = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(source)
            _answer(getattr(module, function), case, to)
            os._exit(0)
        os.close(to)
        with os.fdopen(source) as pipe:
            text = pipe.read()
        _, status = os.waitpid(child, 0)
        print(text or json.dumps({"error": f"the process ended with status {status}, no memory left?"}), flush=True)


if __name__ == "__main__":
    try:
        _serve(sys.argv[1])
    except KeyboardInterrupt:
        sys.exit(130)
