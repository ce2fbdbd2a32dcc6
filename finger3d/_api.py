"""Functions of the Python interface that read a scene or a calibration before they call the analysis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._extras import require
from finger3d.progress import Progress

if TYPE_CHECKING:
    import pandas

    from finger3d.analyses.identify.run import Identification
    from finger3d.analyses.optimise.gauge_run import GaugePlaces
    from finger3d.analyses.optimise.run import OptimisationResult
    from finger3d.analyses.plan import Plan
    from finger3d.mold.export import Exported
    from finger3d.mold.options import MoldOptions
    from finger3d.scene import Source

Value = float | int | bool | str
"""A value of a key of a scene."""


def plan(scene: Source) -> Plan:
    """Forecast size, time and memory of a press without solving anything.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene

    Returns
    -------
    Plan
        For instance ``plan.dofs``, ``plan.total_s`` and ``plan.memory_MB``.
    """
    from finger3d.analyses import plan
    from finger3d.scene import scene_of

    return plan.plan(scene_of(scene))


@dataclass(frozen=True)
class SweepResult:
    """Rows of a sweep.

    Attributes
    ----------
    out : folder of results.csv, report.html and, with pyarrow, results.parquet
    columns : name -> a value for each point: the varied keys, the numbers of the last step with their units in the
        name, gauges, outcome
    failed : number of points without results
    """

    out: Path
    columns: Mapping[str, Sequence[Value]]
    failed: int

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the columns as a pandas DataFrame, one row for each point."""
        require("to_dataframe()", "pandas")
        import pandas

        return pandas.DataFrame(dict(self.columns))


def sweep(
    scene: Source,
    vary: Mapping[str, Sequence[Value]] | str | Path,
    out: str | Path,
    overrides: Sequence[str] = (),
    scheduler: str | None = None,
    workers: int | None = None,
    report: Progress | None = None,
    sample: str = "grid",
    seed: int = 0,
) -> SweepResult:
    """Press many points of a scene: every combination of some values of keys, a list of points, or random samples.

    A sweep that was interrupted continues in the same folder.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    vary : key -> values, for instance ``{"friction.mu": [0.06, 0.25, 1.0], "material.nu": [0.45, 0.49]}``; or the path
        of a CSV file with a column for each key and a row for each point
    out : folder for the results
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    scheduler : address of a Dask scheduler; None: processes on this machine
    workers : number of these processes; None: one for each core
    report : receives the progress at every point
    sample : ``"grid"``, every combination of the values; ``"list"``, values at the same place make a point;
        ``"lhs:200"`` or ``"random:200"``, that many samples, of a Latin hypercube or independent, where `vary` has the
        lower and the upper bound of every key
    seed : of the random numbers

    Raises
    ------
    Finger3dError
        For a mistake in the scene or the values, before any point is solved.
    """
    from finger3d.analyses.sweep.points import combinations, listed_points
    from finger3d.analyses.sweep.run import sweep as run
    from finger3d.analyses.sweep.samples import columns_of, drawn, rows_of

    if isinstance(vary, str | Path):
        points = listed_points(scene, overrides, rows_of(Path(vary)), "--points")
    elif sample == "list":
        points = listed_points(
            scene, overrides, columns_of({k: list(map(_as_toml, v)) for k, v in vary.items()}), "vary"
        )
    elif sample != "grid":
        ranges = [f"{key}={':'.join(map(_as_toml, bounds))}" for key, bounds in vary.items()]
        points = listed_points(scene, overrides, drawn(sample, ranges, seed), "--sample")
    else:
        texts = [f"{key}={','.join(map(_as_toml, values))}" for key, values in vary.items()]
        points = combinations(scene, overrides, texts)
    store = run(points, out, scheduler, workers, report)
    columns = store.columns()
    return SweepResult(Path(out), columns, sum(outcome != "converged" for outcome in columns["outcome"]))


def optimise(
    scene: str | Path,
    free: Mapping[str, tuple[float, float]],
    out: str | Path,
    objective: str | Path = "sensitivity",
    gauge: str | None = None,
    mus: Sequence[float] | None = None,
    noise: float = 1.5e-4,
    budget: int = 60,
    method: str = "differential-evolution",
    seed: int = 0,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> OptimisationResult:
    """Search for the values of free keys with the largest objective.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene; the start of the search
    free : key -> lower and upper bound, for instance ``{"gauge.g36.x_mm": (10.0, 48.0)}``
    out : folder for evaluations.csv, best.toml and report.html
    objective : "sensitivity", or a Python file with a function ``objective(table) -> number``
    gauge : name of the gauge that the objective reads; None: the first
    mus : friction coefficients, ascending; None: nine from 0.05 to 1
    noise : standard deviation of a strain reading
    budget : number of designs, or of bodies if gauges are searched in each
    method : "differential-evolution", "dual-annealing" or "nelder-mead"
    seed : of the random numbers
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : receives the progress at every design

    Returns
    -------
    OptimisationResult
        With the best design as a scene that can be pressed.
    """
    from finger3d.analyses.free_keys import FreeKey
    from finger3d.analyses.optimise.run import optimise as run
    from finger3d.analyses.optimise.task import MUS, OptimisationProblem
    from finger3d.scene import tables_of

    given, path = tables_of(scene, overrides)
    problem = OptimisationProblem(
        given=given,
        free=tuple(FreeKey.of(f"{key}={low!r}:{high!r}") for key, (low, high) in free.items()),
        objective=str(objective),
        path=path,
        gauge=gauge,
        mus=tuple(mus) if mus is not None else MUS,
        noise=noise,
        budget=budget,
        method=method,
        seed=seed,
    )
    return run(problem, out, report)


def place_gauges(
    scene: str | Path,
    count: int,
    out: str | Path,
    free: Mapping[str, tuple[float, float]] | None = None,
    mus: Sequence[float] | None = None,
    noise: float = 1.5e-4,
    tolerances: Mapping[str, float] | None = None,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> GaugePlaces:
    """Find the places and directions of gauges that together determine mu best, as ``finger3d optimise --gauges``.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    count : number of gauges
    out : folder for gauges.json, best.toml, map.csv, map.png and report.html
    free : bounds of "gauge.x_mm", "gauge.y_mm", "gauge.z_mm" and "gauge.angle_deg"; None: the whole body at z = 0
    mus : friction coefficients at which the gauges are judged, ascending; None: nine from 0.05 to 1
    noise : standard deviation of a strain reading
    tolerances : standard deviations by name, in place of the defaults of `calibrate`; 0 omits one
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : told about stages

    Returns
    -------
    GaugePlaces
        With the scene that has these gauges, and the standard deviation of mu.
    """
    from finger3d.analyses.free_keys import FreeKey
    from finger3d.analyses.optimise.gauge_run import place_gauges as run
    from finger3d.analyses.optimise.task import MUS
    from finger3d.scene import tables_of

    given, path = tables_of(scene, overrides)
    keys = [FreeKey.of(f"{key}={low!r}:{high!r}") for key, (low, high) in (free or {}).items()]
    return run(given, count, out, keys, MUS if mus is None else mus, noise, tolerances, path, report)


def identify(
    scene: str | Path,
    measured: str | Path,
    free: Mapping[str, tuple[float, float]],
    out: str | Path,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
) -> Identification:
    """Find the values of free keys with which a scene reproduces a measured press.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    measured : CSV file with columns named as in history.csv, and optionally their standard deviations, ``..._std``
    free : key -> lower and upper bound, for instance ``{"material.E_MPa": (0.05, 5.0)}``
    out : folder for identify.json, identify.csv, identified.toml, identify.png and report.html
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : receives the progress at every iteration

    Returns
    -------
    Identification
        With the values, their standard deviations and correlation, and notes on values that the data do not determine.
    """
    from finger3d.analyses.free_keys import FreeKey
    from finger3d.analyses.identify.run import identify as run
    from finger3d.scene import tables_of

    given, path = tables_of(scene, overrides)
    keys = [FreeKey.of(f"{key}={low!r}:{high!r}") for key, (low, high) in free.items()]
    return run(given, measured, keys, out, path, report)


def export(
    scene: Source,
    out: str | Path,
    mold: MoldOptions | None = None,
    text: bool = False,
    tolerance_mm: float | None = None,
    report: Progress | None = None,
) -> Exported:
    """Write the finger as STEP and STL and, if asked, the printable parts of a mold; all in mm.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for the files
    mold : `finger3d.MoldOptions`; None: no mold
    text : whether the STL file is text instead of binary
    tolerance_mm : largest distance of the triangles from the CAD surface; None: 0.05 mm, or with a mold the printer's
    report : told about stages
    """
    from finger3d.mold.export import export as run
    from finger3d.scene import scene_of

    return run(scene_of(scene), out, mold, text, tolerance_mm, report)


def _as_toml(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
