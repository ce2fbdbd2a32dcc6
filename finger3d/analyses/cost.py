"""What accuracy costs: the error, time and memory of a press on finer meshes, and the plan of a press.

Both coarse presses have error bars.  Those of a number fall as a power of the edge length: of the usual order,
corrected by the order between both presses, and through the mean of both.  The edge lengths for a wanted error follow.
The forecast of unknowns and seconds on such a mesh is corrected by what the finer of both presses had and took.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Self

from finger3d._cost import factor_mb
from finger3d._ranges import four_digits
from finger3d._types import Tree, TreeView
from finger3d.accuracy.cost import forecast, without_output_s
from finger3d.accuracy.error_bars import relative_error
from finger3d.accuracy.estimate import companion_presses, estimate, press_numbers
from finger3d.accuracy.refine import ALL
from finger3d.analyses.free_keys import settled
from finger3d.analyses.pressed_body import PressedBody
from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.geometry.imported import extent
from finger3d.mechanics.discretise.companions import coarser
from finger3d.mechanics.discretise.resolution import warnings_before_meshing
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.march.step_halving import march_automatic, with_increments_of
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.readings import AREAS, MAIN, ORDER, by_key, kinds_of
from finger3d.meshing.given import GivenMesh
from finger3d.progress import QUIET, Progress
from finger3d.scene import Source, scene_of
from finger3d.scene.material import moduli

ERRORS = (0.1, 0.03, 0.01, 0.003)
"""Relative errors that `cost` forecasts a press for."""

_USUAL = "depth_mm", "normal_force_N", "friction_sum_N"
"""Numbers whose errors are meant by default, beside readings: those of zones cost far more."""

_MOST_COLUMNS = 8
"""Largest number of errors in a table; the JSON output has all."""

_PILOTS = 2.2, 1.4
"""Edge lengths of the coarse presses over those of the scene."""

_ORDERS, _MEASURED = (0.5, 2.0), 0.25
"""Least and greatest order between two presses, and its weight beside that of the usual order: single bars scatter."""

_INCREMENT_ORDER = 2.0

_FACTORS = (1.0 / 64.0, 2.5)
"""Least and largest edge lengths that are forecast, over those of the scene."""

_FEWEST_POINTS = 8
"""Edges along half the length of contact on the coarsest mesh."""

_OVERHEAD_S = 2.0
"""Seconds that are added to the real and to the forecast time of a press before they are divided: how much longer a
short press takes is a constant, and no factor of a long one."""


@dataclass(frozen=True, kw_only=True)
class CostRow:
    """Forecast of a press on one mesh.

    Attributes
    ----------
    error : relative, that the mesh is chosen for; None: the mesh of the scene
    mesh : its edge lengths
    increments : of all legs, in the last run
    dofs : unknowns
    seconds, memory_MB : of the press, with error bars and pictures
    solving_s : seconds among these that its solution takes, with the error bars and without the mesh
    errors : expected relative error of each number by name, of mesh and increments
    limit : why the error cannot be reached, or is smaller than was asked for; empty otherwise
    legs : of the path with another number of increments than the scene's; empty if that is kept
    has_legs : whether the scene names them, ``[[press.leg]]``
    """

    error: float | None
    mesh: MeshOptions
    increments: int
    dofs: int = 0
    seconds: float = math.nan
    memory_MB: float = math.nan
    solving_s: float = math.nan
    errors: Mapping[str, float] = field(default_factory=dict)
    limit: str = ""
    legs: tuple[Leg, ...] = ()
    has_legs: bool = False

    @property
    def keys(self) -> list[str]:
        """Keys of a scene with this mesh, for ``--set``."""
        own, factors = self.mesh, ("gauge_refinement", "stick_refinement")
        sizes = [f"mesh.size_mm={own.size_mm:g}", f"mesh.base_size_mm={own.base_size_mm:g}"]
        sizes += [f"mesh.{name}={value:g}" for name in factors if (value := getattr(own, name)) > 1.0]
        return sizes + [f"press.{f'leg.{k}.' * self.has_legs}steps={leg.steps}" for k, leg in enumerate(self.legs)]

    def as_dict(self) -> Tree:
        """Return the entry of the JSON output."""
        forecast = ("increments", "dofs", "seconds", "memory_MB", "errors", "limit")
        return {"error": self.error, "set": self.keys, **{name: getattr(self, name) for name in forecast}}


@dataclass(frozen=True)
class Costs:
    """What accuracy costs for a scene.

    Attributes
    ----------
    title : of the scene
    of : names of the numbers that the wanted errors are those of
    rows : the mesh of the scene first, then one for each of `ERRORS`
    names : of the numbers that tables and figures show
    seconds : that this forecast took
    """

    title: str
    of: tuple[str, ...]
    rows: tuple[CostRow, ...]
    names: tuple[str, ...]
    seconds: float

    def as_dict(self) -> Tree:
        """Return what `finger3d cost --json` prints."""
        rows = [row.as_dict() for row in self.rows]
        return {"title": self.title, "of": list(self.of), "rows": rows, "seconds": self.seconds}

    def table(self) -> list[list[str]]:
        """Return the names of the columns, and a line for each row."""
        named = (name.replace("_", " ") for name in self.names)
        head = ["error", "edges, mm", "increments", "unknowns", "seconds", "memory", *named]
        return [head, *(_line(row, self.names) for row in self.rows)]


def cost(
    scene: Source,
    of: Sequence[str] = (),
    png: str | Path | None = None,
    report: Progress = QUIET,
    overrides: Sequence[str] = (),
) -> Costs:
    """Forecast edge lengths, time and memory of a scene for errors of 10, 3, 1 and 0.3 %.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    of : numbers of the press whose errors are meant, such as "stick_area_mm2", or "all"; default: ``mesh.goal``, else
        the normal force (or the depth under a prescribed force), the friction sum and all readings
    png : file of a figure with the errors against the time
    report : receives the progress
    overrides : other keys to set, such as ``"friction.mu=0.5"``

    Returns
    -------
    Costs

    Raises
    ------
    Finger3dError
        If the press has no number of such a name, if its mesh is given, or if a coarse press fails.
    """
    start = time.perf_counter()
    scene, _ = settled(scene_of(scene, overrides), report)
    model = scene.model()
    if isinstance(model.design, GivenMesh):
        raise Finger3dError("cost: the mesh of this finger is given; it has no edge lengths to choose")
    scene.check_numbers(of, ALL)
    goals = tuple(of) or ((scene.tables.mesh.goal,) if scene.tables.mesh.goal else ())
    forecasts = Forecasts.of(model, report)
    chosen = forecasts.numbers(goals)
    rows = (forecasts.row(1.0), *(forecasts.wanted(error, chosen) for error in ERRORS))
    rows = tuple(replace(row, has_legs="leg" in scene.given.get("press", {})) for row in rows)
    tabled = tuple(of) if of and ALL not in of else forecasts.main[:_MOST_COLUMNS]
    found = Costs(scene.title, chosen, rows, tabled, time.perf_counter() - start)
    if png is not None:
        from finger3d.plotting.analyses import draw_cost  # matplotlib is loaded for a figure only

        timed = [row for row in rows if row.dofs]
        errors = {name: [row.errors[name] for row in timed] for name in found.names}
        own_s = rows[0].seconds if rows[0].dofs else None
        draw_cost(Path(png), found.title, [row.seconds for row in timed], errors, own_s)
    return found


@dataclass(frozen=True)
class _Pilot:
    """A coarse press: edges over the scene's, unknowns, increments, seconds without bars, relative errors by name."""

    factor: float
    dofs: int
    increments: int
    seconds: float
    mesh: Mapping[str, float]
    steps: Mapping[str, float]
    contact_half_length_mm: float
    readings: tuple[str, ...]


def _pressed(model: Model, report: Progress) -> Iterator[_Pilot]:
    """Yield two coarse presses, the coarser first; edges are shorter where a mesh does not resolve the contact."""
    shorter, meant = 1.0, forecast(model)["dofs"]
    for factor in _PILOTS:
        while True:
            report.stage(f"pressing with {factor * shorter:.3g} times the edge lengths")
            try:
                yield _pilot(model, factor * shorter, meant)
            except UnresolvedError:
                if shorter < 0.5:
                    raise
                shorter *= 0.75
            else:
                break


def _pilot(model: Model, factor: float, meant: int) -> _Pilot:
    """Press a model on coarse edges; its companions are of the kind that a mesh with ``meant`` unknowns has."""
    start = time.perf_counter()
    problem = PressedBody.with_refined_borders(replace(model, mesh=_scaled(model, factor))).problem
    meshed = problem.seconds["cad"] + problem.seconds["mesh"]
    steps, chosen = march_automatic(problem)
    steps[-1].check("cost: a coarse press")
    seconds = time.perf_counter() - start - meshed
    companions = partial(companion_presses, unknowns=meant)
    found = estimate(problem, steps, numbers=press_numbers, chosen=chosen, companions=companions)
    if not found.discretisation:
        raise Finger3dError(f"cost: a coarse press has no error bars: {found.method}")
    numbers, kinds = press_numbers(problem, steps[-1]), kinds_of(steps[-1].readings)

    def relative(errors: Mapping[str, float]) -> dict[str, float]:
        return {name: relative_error(numbers, kinds, name, error) for name, error in errors.items() if name in numbers}

    return _Pilot(
        factor,
        int(problem.body.stiffness.upper.shape[0]),
        len(steps),
        seconds,
        relative(found.discretisation),
        relative(found.steps),
        numbers["contact_half_length_mm"],
        tuple(by_key(steps[-1].readings)),
    )


def _scaled(model: Model, factor: float) -> MeshOptions:
    """Return the mesh with edge lengths times a factor, those at the base at most half of the body."""
    own = coarser(model, factor).mesh
    return replace(model.mesh, size_mm=four_digits(own.size_mm), base_size_mm=four_digits(own.base_size_mm))


class Forecasts:
    """Forecasts of a press on other meshes, from two coarse presses.

    Attributes
    ----------
    bars : relative error bar of each number with the edges of the scene, and the order at which it falls with them
    main : names of the numbers that tables show, those whose errors are meant by default first
    """

    def __init__(self, model: Model, coarse: _Pilot, fine: _Pilot) -> None:
        self.model, self._fine = model, fine
        self.bars = {name: _through(coarse, fine, name) for name, error in fine.mesh.items() if math.isfinite(error)}
        names = dict.fromkeys((*_USUAL, *fine.readings, *MAIN, *AREAS))
        self.main = tuple(name for name in names if name in self.bars)
        expected = forecast(replace(model, mesh=_scaled(model, fine.factor)))
        short_s = _solving(expected)
        self._slower = (fine.seconds + _OVERHEAD_S) / (short_s + _OVERHEAD_S)
        self._later_s = max(fine.seconds - self._slower * short_s, 0.0)
        self._more = fine.dofs / expected["dofs"]
        resolved = fine.contact_half_length_mm / (_FEWEST_POINTS * model.mesh.size_mm)
        self._coarsest = min(_FACTORS[1], max(1.0, resolved))

    @classmethod
    def of(cls, model: Model, report: Progress = QUIET) -> Self:
        """Press a model twice on coarse meshes."""
        return cls(model, *_pressed(model, report))

    def numbers(self, goals: Sequence[str]) -> tuple[str, ...]:
        """Return the names of the numbers that goals mean, by default forces and readings.

        Raises
        ------
        Finger3dError
            If the coarse presses give no error of a goal.
        """
        if ALL in goals:
            return tuple(self.bars)
        if unknown := [name for name in goals if name not in self.bars]:
            raise Finger3dError(f"cost: the coarse presses give no error of {', '.join(unknown)}")
        return tuple(goals) or tuple(n for n in self.bars if n in _USUAL or n in self._fine.readings)

    def errors(self, factor: float, increments: int) -> dict[str, float]:
        """Return the expected relative errors with edge lengths times a factor."""
        fewer, steps = (self._fine.increments / increments) ** _INCREMENT_ORDER, self._fine.steps
        return {
            name: error * factor**order + fewer * steps.get(name, 0.0) for name, (error, order) in self.bars.items()
        }

    def wanted(self, error: float, goals: Sequence[str]) -> CostRow:
        """Return the forecast of the longest edges whose errors of all goals are as small as is wanted."""
        left = max(self._fine.steps.get(name, 0.0) for name in goals)
        increments = self._fine.increments
        if left > 0.5 * error:
            increments = math.ceil(increments * (left / (0.5 * error)) ** (1.0 / _INCREMENT_ORDER))

        def worst(factor: float) -> float:
            found = self.errors(factor, increments)
            return max(found[name] for name in goals)

        low, high = _FACTORS[0], self._coarsest
        if worst(high) <= error:
            return self.row(high, error, increments, "the coarsest mesh that resolves the contact")
        if worst(low) > error:
            return CostRow(error=error, mesh=_scaled(self.model, low), increments=increments, limit="out of reach")
        for _ in range(40):
            middle = math.sqrt(low * high)
            low, high = (middle, high) if worst(middle) <= error else (low, middle)
        return self.row(low, error, increments)

    def row(self, factor: float, error: float | None = None, increments: int | None = None, limit: str = "") -> CostRow:
        """Return the forecast for edge lengths times a factor."""
        mesh, count = _scaled(self.model, factor), increments or self._fine.increments
        own = CostRow(error=error, mesh=mesh, increments=count, errors=self.errors(factor, count), limit=limit)
        model, fine = replace(self.model, mesh=mesh), self._fine
        if count != fine.increments:
            given = with_increments_of(model.legs, fine.increments)
            legs = tuple(replace(leg, steps=round(int(leg.steps) * count / fine.increments)) for leg in given)
            own, model = replace(own, legs=legs), replace(model, legs=legs)
        try:
            expected = forecast(model, bars=True)
        except Finger3dError as failure:
            return replace(own, limit=str(failure).split(";")[0])
        dofs, dim = self._more * expected["dofs"], 3 if model.domain == "solid" else 2
        memory = expected["memory_MB"] + factor_mb(dofs, dim) - factor_mb(expected["dofs"], dim)
        solving = self._slower * _solving(expected) + self._later_s
        seconds = expected["total_s"] - _solving(expected) + solving
        return replace(own, dofs=round(dofs), seconds=round(seconds, 1), memory_MB=round(memory), solving_s=solving)


def _solving(expected: Tree) -> float:
    """Return the forecast seconds of a press without start, mesh and output."""
    return without_output_s(expected) - float(expected["mesh_s"])


def _through(coarse: _Pilot, fine: _Pilot, name: str) -> tuple[float, float]:
    """Return the error bar of a number with the edges of the scene, from two presses, and its order."""
    one, other = coarse.mesh.get(name, 0.0), fine.mesh[name]
    if not (one > 0.0 and other > 0.0):
        return other * fine.factor**-ORDER, ORDER
    measured = math.log(one / other) / math.log(coarse.factor / fine.factor)
    order = ORDER + _MEASURED * (min(max(measured, _ORDERS[0]), _ORDERS[1]) - ORDER)
    return math.sqrt(one * coarse.factor**-order * other * fine.factor**-order), order


def _line(row: CostRow, names: Sequence[str]) -> list[str]:
    """Return the cells of a line of the table."""
    own = row.mesh
    finer = f", {own.size_mm / own.stick_refinement:.3g} at stick" if own.stick_refinement > 1.0 else ""
    size = [""] * 3
    if row.dofs:
        memory = f"{row.memory_MB:.0f} MB" if row.memory_MB < 1e3 else f"{1e-3 * row.memory_MB:.1f} GB"
        size = [f"{row.dofs}", f"{row.seconds:.3g}", memory]
    return [
        "this mesh" if row.error is None else f"{100 * row.error:g} %",
        f"{own.size_mm:.3g} to {own.base_size_mm:.3g}{finer}",
        str(row.increments),
        *size,
        *(f"{100 * row.errors[name]:.2g} %" if name in row.errors else "" for name in names),
    ]


@dataclass(frozen=True)
class Plan:
    """Forecast of a press.

    Attributes
    ----------
    title : of the scene
    moduli : Young's modulus of the finger and of its parts in words, with spread and origin
    effects : settings by name of the effects that are on
    forecast : printable values by name: model, size, seconds of each stage, memory
    warnings : unusual values of the scene, and what the mesh will not resolve
    """

    title: str
    moduli: Mapping[str, str]
    effects: Mapping[str, TreeView]
    forecast: TreeView
    warnings: tuple[str, ...]

    @property
    def dofs(self) -> int:
        """Number of unknowns."""
        return int(self.forecast["dofs"])

    @property
    def contact_points(self) -> int:
        """Number of contact points of the meshed part."""
        return int(self.forecast["contact_points"])

    @property
    def total_s(self) -> float:
        """Time of the press, s; the real time is 0.5 to 2.5 times this."""
        return float(self.forecast["total_s"])

    @property
    def memory_MB(self) -> float:
        """Peak memory, MB; the real one is 0.8 to 1.3 times this."""
        return float(self.forecast["memory_MB"])

    def summary(self) -> Tree:
        """Return what `finger3d plan --json` prints."""
        return asdict(self)


def plan(scene: Source, overrides: Sequence[str] = ()) -> Plan:
    """Forecast size, time and memory of a press without solving anything.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Returns
    -------
    Plan
        For instance ``plan.dofs``, ``plan.total_s`` and ``plan.memory_MB``.
    """
    scene = scene_of(scene, overrides)
    model = scene.with_effects([*scene.fixed_effects, *scene.open_effects]).model()  # at the most
    expected = forecast(model, bars=True)
    warnings = [*model.warnings, *warnings_before_meshing(model, symmetry(model))]
    expected = {"finger": extent(model.design)} | expected
    tolerance = scene.tables.mesh.tolerance
    if tolerance is not None:
        expected = {"mesh": f"the first of those refined to tolerance = {tolerance:g}"} | expected
    effects = {name: settings for name, settings in scene.as_dict()["effects"].items() if name in scene.effects}
    return Plan(scene.title, moduli(scene.tables), effects, expected, tuple(warnings))
