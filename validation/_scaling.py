"""One whole press through the main job, timed by stage, with the peak memory of every stage; and a whole sweep."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from finger3d._machine import child_environment
from finger3d.analyses.press import press
from finger3d.progress import Progress
from finger3d.scene import Scene, load

from ._child import peak_mb, reset_peak
from ._press import GEOMETRIES

BODIES = 16
STAGES = ("mesh", "assembly", "condensation", "contact", "output", "error bars and page")


@dataclass(frozen=True)
class Size:
    """A press of the Fig. 9 finger, 20 mm wide: edge lengths (mm), swept mesh; and whether the job draws."""

    size: float
    base: float
    figures: bool = True


class Watch(Progress):
    """Tells by the job's own announcements which stage runs, and keeps seconds, processor seconds and peak of each."""

    _STARTS: Mapping[str, str] = {
        "meshing": "mesh", "assembling": "assembly", "condensing": "condensation", "pressing": "contact",
        "writing": "output", "estimating": "error bars and page",
    }  # fmt: skip

    def __init__(self) -> None:
        self.peaks = dict.fromkeys(STAGES, 0.0)
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self.processor = dict.fromkeys(STAGES, 0.0)
        self.since = time.perf_counter(), time.process_time()
        self.now = "mesh"

    def stage(self, text: str) -> None:
        """A stage of the job, or a part of the build."""
        following = self._STARTS.get(text.split(" ")[0].rstrip(","))
        if following and following != self.now:
            self.close()
            self.now = following

    say = stage

    def close(self) -> None:
        """End of a stage: its peak is kept, and the next begins at what is in use."""
        self.peaks[self.now] = max(self.peaks[self.now], peak_mb())
        reset_peak()
        now = time.perf_counter(), time.process_time()
        self.seconds[self.now] += now[0] - self.since[0]
        self.processor[self.now] += now[1] - self.since[1]
        self.since = now


def prepare() -> None:
    """Load what every press needs, before the first fork."""
    from finger3d.fem.solvers.condense import is_installed

    is_installed("pardiso")


def _scene(size: float, base: float) -> Scene:
    mesh = f"mesh={{size_mm={size}, base_size_mm={base}, mesher='swept'}}"
    return load(
        GEOMETRIES / "fig9.toml", ["gauge=[]", "material.nu=0.49", "press.steps=10", "effects.auto=false", mesh]
    )


def sweep_seconds(size: Size, workers: int) -> float:
    """Wall time (s) of the command ``finger3d sweep`` over `BODIES` values of nu, its start included."""
    nus = ",".join(f"{0.30 + 0.01 * i:.2f}" for i in range(BODIES))
    with tempfile.TemporaryDirectory(prefix="finger3d_scaling_") as folder:
        scene = Path(folder, "body.toml")
        scene.write_text(_scene(size.size, size.base).to_toml(), encoding="utf-8")
        command = [sys.executable, "-m", "finger3d", "sweep", str(scene), "--vary", f"material.nu={nus}"]
        command += ["--out", str(Path(folder, "out")), "--workers", str(workers)]
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=child_environment())
        return time.perf_counter() - start


def pressed(given: dict[str, Any]) -> dict[str, Any]:
    """Seconds, processor seconds and peaks (MB) by stage, and sizes, of a press given as a dict.

    Processor seconds are those of this process; the children that draw pictures are not among them.
    """
    scene = _scene(given["size"], given["base"])
    watch = Watch()
    with tempfile.TemporaryDirectory(prefix="finger3d_scaling_") as folder:
        result = press(scene, folder, watch, figures=given["figures"])
        watch.close()
    summary = result.summary()
    last = summary["steps"][-1]
    return {
        "seconds": watch.seconds,
        "processor_seconds": watch.processor,
        "peaks": watch.peaks,
        "peak_MB": max(watch.peaks.values()),
        "dofs": summary["mesh"]["dofs"],
        "rows": 3 * summary["mesh"]["contact_points"],
        "factorizations": summary["cost"]["factorizations"],
        "force": last["normal_force_N"],
        "iterations": sum(s["iterations"] for s in summary["steps"]),
        "outcome": summary["outcome"],
    }
