"""Measured presses: CSV files whose columns are named as those of history.csv; and presses simulated for free keys."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from finger3d._types import Float, Tree, TreeView
from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.analyses.free_keys import FreeKey, scene_with
from finger3d.analyses.pressed_body import PressedBody, body_key, kept, under
from finger3d.csv_table import read_table
from finger3d.errors import Finger3dError, MissingError
from finger3d.materials.modulus import modulus_of_shore_00, modulus_of_shore_A
from finger3d.mechanics.discretise.build import changed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, table_row
from finger3d.mechanics.march.step_halving import automatic, with_increments_of
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import ending_at, stations, targets
from finger3d.mechanics.readings import OF_INCREMENT, ORDER, by_key, in_order, in_space, kinds_of, quantities
from finger3d.results.journal import Journal
from finger3d.scene import Scene, tree
from finger3d.scene.messages import listed, nearest

SLIDES = ("slide_x_mm", "slide_z_mm")

INDEX = ("step", "time_s", "depth_mm", *SLIDES)
"""Columns that say when a row was measured; the first of them that changes in one direction counts."""

CLOCKS = ("step", "time_s")
"""Columns that are never fitted, unlike the depth, which is fitted if it does not locate the rows."""

_NO_MEASUREMENTS = ("iterations", "residual", "method", "outcome")
"""Columns of history.csv that tell of the solver, and are passed over."""

STD = "_std"

_FEWEST = 2
"""Least number of rows of a measured press."""

_OPPOSITE = -0.5
"""Cosine between a measured and a simulated column below which they have opposite signs."""

_LEAST_STD, _LARGEST_STD = 1e-12, 1e12
"""Standard deviations, in the unit of their column: squares of the residuals over them neither overflow nor vanish."""

SHARPEST = 1e-9
"""Least standard deviation that a column without one is given, in its unit; numbers below it are round-off of zero."""

_UNIT_RATIO = 30.0
"""Ratio of a measured column to the simulated one beyond which its unit is in doubt; 100 is a percentage."""


@dataclass(frozen=True)
class MeasuredPress:
    """Measured press of n rows.

    Attributes
    ----------
    path : of the file
    index : name of the column that says when a row was measured, one of `INDEX`
    at : (n,) its values, ascending; a slide may also descend
    columns : (n,) values by name
    stds : (n,) standard deviations by name, of the columns that have them
    lines : (n,) numbers of the lines of the file
    """

    path: Path
    index: str
    at: Float
    columns: Mapping[str, Float]
    stds: Mapping[str, Float]
    lines: tuple[int, ...]

    @property
    def direction(self) -> float:
        """1 if the index ascends, -1 if it descends."""
        return _direction(self.index, self.at)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return len(self.at) * len(self.columns)

    def check_against(self, simulated: Sequence[Mapping[str, Float]]) -> None:
        """Raise an error for a column whose sign or magnitude is far from those of all simulated ones (n,), by name."""
        for name, values in self.columns.items():
            row = int(np.argmax(np.abs(values)))
            found, extents = abs(float(values[row])), [float(np.abs(one[name]).max()) for one in simulated]
            least, most = min(extents), max(extents)
            size, own = np.linalg.norm(values), [one[name] for one in simulated]
            opposed = found > SHARPEST and all(values @ one < _OPPOSITE * size * np.linalg.norm(one) for one in own)
            if opposed or not least / _UNIT_RATIO - SHARPEST <= found <= most * _UNIT_RATIO + SHARPEST:
                raise Finger3dError(
                    f"{self.path}: line {self.lines[row]}: {name} = {values[row]:g}: the scene gives up to "
                    f"{least:.2g} to {most:.2g}{', of the opposite sign' * opposed}; are unit and sign those of the "
                    "name (strain is a plain number, not percent; forces that press are positive), and is it this "
                    "sensor?"
                )


def read_measured(path: Path, known: Sequence[str]) -> MeasuredPress:
    """Read a measured press.

    Parameters
    ----------
    path : CSV file with a line of names, then a line for each row
    known : names that columns may have, besides those of `INDEX`

    Raises
    ------
    Finger3dError
        In one line: for a file that cannot be read, an unknown column, a gap, a value that is no number, rows out of
        order.
    """
    every = {*known, *INDEX}
    table = read_table(path, lambda cell: cell.removesuffix(STD) in every)
    names = [name for name in table.names if name not in _NO_MEASUREMENTS]
    indices = [name for name in INDEX if name in names]
    if not indices:
        has = ", ".join(repr(name)[:40] for name in table.names) or "no line of names"
        needed = f"a column {listed(INDEX)}, which says when a row was measured"
        raise Finger3dError(f"{path}: must have {needed}; it has {has}")
    for base in (name.removesuffix(STD) for name in names):
        if base not in every:
            near = next((n for n in known if n.endswith(f"_{base}")), None) or nearest(base, list(known))
            hint = f'did you mean "{near}"? ' if near else ""
            raise Finger3dError(
                f'{path}: column "{base}": {hint}it is none of the forces, lengths, areas, energies and readings of '
                "history.csv, which are fitted; leave out other columns"
            )
    values = table.numbers(names)
    index = next((name for name in indices if not len(_turns(name, values[name]))), indices[0])
    at, columns = values[index], [n for n in names if n not in (index, *CLOCKS) and not n.endswith(STD)]
    if not columns:
        raise Finger3dError(f"{path}: has no measured column beside {index}; for instance normal_force_N")
    for name in names:
        if name.endswith(STD) and name.removesuffix(STD) not in columns:
            raise Finger3dError(f'{path}: column "{name}" has no column "{name.removesuffix(STD)}"')
    if len(turns := _turns(index, at)):
        line = table.lines[turns[0] + 1]
        more = "; of a press that goes back, give time_s or step" if index not in CLOCKS else ""
        raise Finger3dError(f"{path}: line {line}: {index} = {at[turns[0] + 1]:g}: must be larger than before{more}")
    if len(at) < _FEWEST:
        raise Finger3dError(f"{path}: has {len(at)} rows; at least {_FEWEST} are needed")
    stds = {n: values[n + STD] for n in columns if n + STD in values}
    for name, own in stds.items():
        check_stds(path, table.lines, name, own)
    return MeasuredPress(path, index, at, {n: values[n] for n in columns}, stds, table.lines)


NO_PRESS = MeasuredPress(Path(), "", np.empty(0), {}, {}, ())
"""Where material tests alone are given."""


def check_stds(path: Path, lines: Sequence[int], name: str, stds: Float) -> None:
    """Raise an error for the first standard deviation (n,) of a column that is out of range."""
    bad = np.flatnonzero((stds < _LEAST_STD) | (stds > _LARGEST_STD))
    if len(bad):
        allowed = f"must be from {_LEAST_STD:g} to {_LARGEST_STD:g}"
        raise Finger3dError(f"{path}: line {lines[int(bad[0])]}: {name}{STD} = {stds[bad[0]]:g}: {allowed}")


def _direction(index: str, at: Float) -> float:
    return -1.0 if index in SLIDES and at[-1:] < at[:1] else 1.0


def _turns(index: str, at: Float) -> NDArray[np.int64]:
    """Return the rows after which an index does not go on in its direction."""
    return np.flatnonzero(_direction(index, at) * np.diff(at) <= 0.0)


OFFSET = "depth_offset_mm"
"""Key that is added to the measured depth; it needs no solution of its own."""

MODULI: dict[str, Callable[[float], float]] = {
    "material.E_MPa": float,
    "material.shore_A": modulus_of_shore_A,
    "material.shore_00": modulus_of_shore_00,
}
"""Young's modulus, MPa, by the keys that give it; forces scale with it, so that they need no solution of their own."""

_TERMS = "effects.large_deformation.terms"

_SHORTEST = 1.0 / 30.0
"""Measured part of the path of a scene below which the unit of the depths is in doubt."""

_LOAD, _SIZE = "normal_force_N", "contact_half_length_mm"
"""Numbers that say how strongly the finger is pressed, and how large the contact is."""

Curve = Mapping[str, Float]
"""Columns of history.csv, a value for each increment."""


def names_of(model: Model) -> tuple[str, ...]:
    """Return the names of the numbers of an increment, readings included."""
    return (*(one.name for one in OF_INCREMENT), *by_key(in_space(in_order(dict.fromkeys(model.columns, 0.0)))))


@dataclass
class Simulation:
    """Presses of a scene with several values of its free keys; each solution is stored at once.

    Attributes
    ----------
    given : the scene as written, overrides included
    free : keys and bounds
    journal : the solutions that are known
    measured : the press at whose rows increments end; None for those of the scene
    """

    given: TreeView
    path: Path | None
    free: tuple[FreeKey, ...]
    journal: Journal
    measured: MeasuredPress | None = None
    _known: dict[tuple[float, ...], Curve | str] = field(default_factory=dict)
    _bodies: dict[str, PressedBody] = field(default_factory=dict)
    _presses: dict[tuple[float, ...], tuple[Problem, list[StepResult]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Take over the solutions of an earlier run."""
        for row in self.journal.rows:
            self._keep(row)

    @property
    def solved(self) -> int:
        """Number of presses that were solved."""
        return len(self._known)

    @cached_property
    def scales_with_modulus(self) -> bool:
        """Whether all forces are proportional to Young's modulus, and nothing else depends on it."""
        return self.scene([f.middle for f in self.free]).model().forces_scale_with_modulus

    @cached_property
    def _increments(self) -> int:
        """Number of increments of the path of the scene; automatic ones are those at the middle of the bounds."""
        model = self.scene([f.middle for f in self.free]).model()
        return len(PressedBody(model).steps() if automatic(model) else stations(model.legs))

    def _legs(self, model: Model) -> tuple[Leg, ...]:
        """Return the path of a model with increments that end at the measured rows, too."""
        if self.measured is None or self.measured.index == "step":
            return model.legs
        legs = with_increments_of(model.legs, self._increments)
        return ending_at(legs, self.measured.index, self.measured.at)

    def scene(self, values: Sequence[float] | Float) -> Scene:
        """Return the scene with values of the free keys; the offset of the depth is none of its keys."""
        return fitted_scene(self.given, self.free, values, self.path)

    def _point(self, values: Sequence[float] | Float) -> tuple[tuple[float, ...], float]:
        """Return the values that a press is solved with, and the factor of its forces."""
        wanted, factor = [float(v) for v in values], 1.0
        for i, free in enumerate(self.free):
            if free.key == OFFSET:
                wanted[i] = 0.0
            if free.key in MODULI and self.scales_with_modulus:
                modulus = MODULI[free.key]
                factor, wanted[i] = modulus(wanted[i]) / modulus(free.middle), free.middle
        return tuple(wanted), factor

    def curve(self, values: Sequence[float] | Float) -> Curve:
        """Return the simulated curve, which begins at first touch, where everything is zero.

        Raises
        ------
        Finger3dError
            If the press fails.
        """
        point, factor = self._point(values)
        return self._scaled(self._unscaled(point), factor)

    @cached_property
    def stresses(self) -> set[str]:
        """Names of the numbers that are proportional to the stresses."""
        columns = self.scene([f.middle for f in self.free]).model().columns
        return {name for name, one in quantities(columns).items() if one.is_stress}

    def _scaled(self, curve: Curve, factor: float) -> Curve:
        """Return a curve with stresses times a factor."""
        return {name: factor * v if name in self.stresses else v for name, v in curve.items()}

    def _unscaled(self, point: tuple[float, ...]) -> Curve:
        """Return the curve of a press with the values that it is solved with."""
        if point not in self._known:
            row = self._solve(point)
            self.journal.append(row)
            self._keep(row)
        found = self._known[point]
        if isinstance(found, str):
            raise MissingError(found)
        return found

    def at(self, values: Sequence[float] | Float, measured: MeasuredPress) -> dict[str, Float]:
        """Return the simulated values of every measured column at its rows, by monotone cubic interpolation."""
        point, factor = self._point(values)
        curve = self._unscaled(point)
        offsets = [float(value) for free, value in zip(self.free, values, strict=True) if free.key == OFFSET]
        offset = sum(offsets) if measured.index == "depth_mm" else 0.0
        _check_range(measured, offset, curve[measured.index])
        return dict(self._scaled(_at_rows(curve, measured, offset), factor))

    def errors(self, values: Float, measured: MeasuredPress) -> dict[str, Float]:
        """Return independent errors (m, n) of every measured column whose error at the end of the press is known.

        They are proportional to the normal force, and grow as the contact becomes smaller beside the edges of the mesh,
        as an error of order `ORDER` does.  Two are those of all rows at once, with and without this growth, and one is
        of each row, since errors change as points close one by one.
        """
        self.curve(values)  # the press is one of the journal
        point, factor = self._point(values)
        problem, steps = self._pressed(point)
        self._known[point] = _curve_of(problem, steps)
        curve = self.curve(values)
        bars = estimate(problem, steps, numbers=press_numbers).totals()
        found = self.at(values, replace(measured, columns=dict.fromkeys((_LOAD, _SIZE), measured.at)))
        ratio = np.divide(curve[_SIZE][-1], found[_SIZE], out=np.ones_like(measured.at), where=found[_SIZE] > 0.0)
        growth = ratio**ORDER
        shapes = found[_LOAD] / curve[_LOAD][-1] * np.vstack([np.ones_like(growth), growth - 1.0, np.diag(growth)])
        known = {n: np.asarray(bars[n]) for n in measured.columns if math.isfinite(bars.get(n, math.nan))}
        return {n: shapes * bar for n, bar in self._scaled(known, factor).items()}

    def _pressed(self, point: tuple[float, ...]) -> tuple[Problem, list[StepResult]]:
        """Return the condensed body at values of the free keys, and its increments; the last ones are kept."""

        def pressed() -> tuple[Problem, list[StepResult]]:
            scene = self.scene(point)
            model = scene.model()
            model = replace(model, legs=self._legs(model))
            key = json.dumps([body_key(scene), scene.as_dict()["press"], repr(model.gauges)])
            body = kept(self._bodies, key, lambda: PressedBody(model, problem=self._in_same_mesh(model)))
            steps = body.steps(model.friction, model.rule)  # which may condense it again
            return under(body.problem, model.friction, rule=model.rule), steps

        return kept(self._presses, point, pressed)

    def _in_same_mesh(self, model: Model) -> Problem | None:
        """Return the condensed body of a model in the mesh of one that differs in materials and friction, if any."""
        for problem in (body.problem for body in self._bodies.values()):
            own = replace(problem.model, material=model.material, parts=model.parts, friction=model.friction)
            if own == model:
                with suppress(Finger3dError):  # where it needs other elements
                    return changed(problem, model)
        return None

    def _solve(self, point: tuple[float, ...]) -> Tree:
        try:
            problem, frames = self._pressed(point)
        except Finger3dError as error:
            return {"values": list(point), "outcome": " ".join(str(error).split()), "curve": {}}
        bad = next((f for f in frames if not f.outcome.ok), None)
        if bad is not None:
            return {"values": list(point), "outcome": bad.failure, "curve": {}}
        # lengths and areas of zones take most of the time of the numbers
        with_zones = self.measured is None or has_zones(self.measured.columns)
        columns = _curve_of(problem, frames, with_zones)
        return {"values": list(point), "outcome": "converged", "curve": {n: v.tolist() for n, v in columns.items()}}

    def _keep(self, row: Mapping[str, Any]) -> None:
        """Keep the solution of a row of the journal."""
        point = tuple(float(v) for v in row["values"])
        if row["outcome"] == "converged":
            self._known[point] = {name: np.array(v, dtype=float) for name, v in row["curve"].items()}
        else:
            named = ", ".join(f"{f.key} = {v:.5g}" for f, v in zip(self.free, point, strict=True))
            self._known[point] = f"the press fails with {named}: {row['outcome']}"


def has_zones(columns: Iterable[str]) -> bool:
    """Return whether lengths or areas of zones are among columns of history.csv."""
    kinds = kinds_of(())
    return any(name in kinds and kinds[name].is_zone for name in columns)


def _curve_of(problem: Problem, steps: Sequence[StepResult], with_zones: bool = True) -> Curve:
    """Return the curve of a press from its increments."""
    rows = [{"step": float(k)} | table_row(problem.points, step, with_zones) for k, step in enumerate(steps, start=1)]
    return {n: np.array([0.0, *(r[n] for r in rows)]) for n in rows[0] if isinstance(rows[0][n], int | float)}


def _at_rows(curve: Curve, measured: MeasuredPress, offset: float) -> dict[str, Float]:
    """Return the values of every measured column at its rows."""
    part = moving_part(curve[measured.index], measured)
    at = measured.direction * curve[measured.index][part]
    where = np.clip(measured.direction * (measured.at + offset), at[0], at[-1])
    rows = PchipInterpolator(at, np.column_stack([curve[name][part] for name in measured.columns]))(where)
    return dict(zip(measured.columns, np.asarray(rows).T, strict=True))


def fitted_scene(given: TreeView, free: Sequence[FreeKey], values: Sequence[float] | Float, path: Path | None) -> Scene:
    """Return the scene with values of the free keys; the offset of the depth is none of its keys."""
    pairs = [(f.numbered(given), v) for f, v in zip(free, values, strict=True) if f.key != OFFSET]
    pairs = with_last_share(given, pairs)
    return scene_with(given, [key for key, _ in pairs], [value for _, value in pairs], path)


def with_last_share(given: TreeView, pairs: Sequence[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Return keys and values with the share of the last of Ogden's terms, if shares are free: it is what they leave."""
    terms, known = tree.value_at(given, _TERMS), dict(pairs)
    if not isinstance(terms, tuple) or not (shares := [f"{_TERMS}.{i}.0" for i in range(len(terms))]):
        return [*pairs]
    *others, last = shares
    if not known.keys() & {*others}:
        return [*pairs]
    return [*pairs, (last, 1.0 - sum(known.get(key, tree.value_at(given, key)) for key in others))]


def check_rows(legs: tuple[Leg, ...], free: Sequence[FreeKey], measured: MeasuredPress) -> None:
    """Raise an error for measured depths that the path of the scene does not have, before anything is solved."""
    if measured.index in CLOCKS or any(leg.is_under_force for leg in legs):
        return
    path = np.array([0.0, *(getattr(target, measured.index) for target in targets(legs))])
    _check_range(measured, max((f.high for f in free if f.key == OFFSET), default=0.0), path)
    if measured.index == "depth_mm" and measured.at[-1] < _SHORTEST * path[-1]:
        raise Finger3dError(
            f"{measured.path}: line {measured.lines[-1]}: depth_mm = {measured.at[-1]:g}: the path of the scene "
            f"ends at {path[-1]:g}; are the depths in mm? if so, lower press.depth_mm"
        )


def moving_part(path: Float, measured: MeasuredPress) -> slice:
    """Return the part of the path (n,) of a scene, given by its index, from where the index changes.

    Raises
    ------
    Finger3dError
        If the index then does not change in the direction of the measured rows until the end.
    """
    moves = measured.direction * np.diff(path)
    first = int(np.argmax(moves != 0.0))
    if (moves[first:] <= 0.0).any():
        other = "step" if measured.index == "time_s" else "time_s or step"
        verb = "rise" if measured.direction > 0.0 else "fall"
        raise Finger3dError(
            f"{measured.path}: {measured.index} does not {verb} throughout the path of the scene; give {other} "
            "instead, or a scene of the measured leg only"
        )
    return slice(first, None)


def _check_range(measured: MeasuredPress, offset: float, path: Float) -> None:
    """Raise an error for rows beyond the path (n,) of a scene, given by its index."""
    moving = path[moving_part(path, measured)]
    begin, end, direction = float(moving[0]), float(moving[-1]), measured.direction
    first, last, slack = float(measured.at[0]), float(measured.at[-1]), 1e-9 * abs(end)
    if measured.index in SLIDES and direction * (begin - first) > slack:
        raise Finger3dError(
            f"{measured.path}: line {measured.lines[0]}: {measured.index} = {first:g}: the scene slides from {begin:g}"
        )
    if direction * (last + offset - end) <= slack:
        return
    text = f"{measured.path}: line {measured.lines[-1]}: {measured.index} = {last:g}: "
    if direction * (last - end) > 0.0:
        raise Finger3dError(f"{text}the path of the scene ends at {end:g}")
    raise Finger3dError(
        f"{text}with {OFFSET} = {offset:g} it is {last + offset:g}, and the path of the scene ends at {end:g}; "
        f"free the offset up to {end - last:g} only, or raise press.depth_mm"
    )
