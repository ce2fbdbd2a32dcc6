"""Options of ``sweep``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from finger3d.cli.options import Texts
from finger3d.errors import Finger3dError


@dataclass(frozen=True, kw_only=True)
class SweepOptions:
    """Which points are pressed, and where.

    Parameters
    ----------
    vary
        A key and its values, for instance friction.mu=0.06,0.25,1; may be repeated.
    points
        CSV file with a column for each key and a row for each point, instead of --vary.
    sample
        Points within --range, instead of --vary: lhs:200 (Latin hypercube) or random:200.
    range
        A key and its bounds, as friction.mu=0.05:1; may be repeated.
    seed
        Of the random numbers of --sample.
    scheduler
        Address of a Dask scheduler that runs the presses, instead of processes here.
    workers
        Number of processes on this machine; default: one for each core, none for a single body.
    """

    vary: Texts | None = None
    points: Path | None = None
    sample: str | None = None
    range: Texts | None = None
    seed: int = 0
    scheduler: str | None = None
    workers: int | None = None

    def check(self) -> None:
        """Raise a Finger3dError for options that contradict each other."""
        if self.workers is not None and self.workers < 1:
            raise Finger3dError(f"--workers {self.workers}: must be at least 1")
        if self.workers is not None and self.scheduler is not None:
            raise Finger3dError("--workers and --scheduler: give one of them; a cluster has its own workers")
        if sum(given is not None for given in (self.vary, self.points, self.sample)) != 1:
            raise Finger3dError(
                "sweep: give one of --vary, --points and --sample, for instance --vary friction.mu=0.06,0.25,1"
            )
        if self.range is not None and self.sample is None:
            raise Finger3dError("--range: only with --sample, for instance --sample lhs:200")
        if self.sample in ("grid", "list"):
            raise Finger3dError(
                f"--sample {self.sample}: must be lhs:NUMBER or random:NUMBER; --vary and --points list points"
            )
