"""Error bars of a press in small strain from its own condensed body, without a second mesh.

Two errors are independent of each other and add as squares:

- that of the body's mesh, by dual-weighted residuals (`finger3d.accuracy.weighted_residuals`);
- that of the contact discretisation, from the same press with every second multiplier
  (`finger3d.accuracy.coarse_multipliers`), and from the resolution of the contact by its points.

Lengths and areas of the zones of contact and stick follow from the places of the contact points alone.
``validation/error_bars.py`` measures how often the true error lies within twice the bar.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d.accuracy.coarse_multipliers import with_coarse_multipliers
from finger3d.accuracy.point_resolution import PointResolution
from finger3d.accuracy.richardson import UNRESOLVED_DISSIPATION, Kind, kinds_of, largest_readings
from finger3d.accuracy.weighted_residuals import BodyErrors, body_errors
from finger3d.contact.acceleration import threads_for
from finger3d.errors import Finger3dError
from finger3d.fem.mesh.simplex import part_of_facets
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import Run
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import RESULTANTS, by_key, pressure_column
from finger3d.mechanics.results.history import StepResult, measure


@dataclass(frozen=True)
class _Shares:
    """Calibrated factors of the error estimates of one kind of number.

    Attributes
    ----------
    change : change of the number with every second multiplier, over the error of the contact discretisation
    body : error of the body's mesh over its estimate, in sections and in solids; without the cells around a gauge
    points : relative error over (h/a)^power, h the distance of points and a the half-length of contact; readings are
        relative to the largest of their kind
    """

    change: float = math.inf
    body: tuple[float, float] = (1.0, 1.0)
    points: float = 0.0
    power: int = 1


_SHARES = {
    # on coarse meshes recovery underestimates the error at bonded corners, by a factor of 2 to 4
    Kind.NORMAL_FORCE: _Shares(body=(2.0, 1.5), points=0.07, power=2),
    Kind.FRICTION_SUM: _Shares(change=1.5, points=0.08),
    Kind.FORCE: _Shares(change=2.0, body=(2.0, 1.5), points=0.02),
    Kind.MOMENT: _Shares(change=1.5, body=(2.0, 1.5), points=0.06),
    Kind.WORK: _Shares(change=2.0, body=(1.5, 1.5), points=0.03, power=2),
    Kind.DISSIPATION: _Shares(change=2.72, points=0.05),
    Kind.STRAIN: _Shares(change=2.0, body=(1.5, 1.5)),
    Kind.DISPLACEMENT: _Shares(change=2.0, points=0.003),
    # recovery is poor where a taxel ends, and at the corners of the base
    Kind.BASE_PRESSURE: _Shares(change=2.0, body=(1.5, 1.5), points=0.01),
    Kind.OTHER_READING: _Shares(change=2.0, body=(1.5, 1.5), points=0.01),
}
"""Calibrated on the sections of validation/error_bars.py; the normal force hardly changes with the multipliers."""

_UNDER_CURVED = {Kind.FRICTION_SUM: 3.0, Kind.DISSIPATION: 5.0}
"""Relative errors in a section under a curved object over (h/a)^2: presses with every second multiplier have the
normals of this one, and do not see how few points follow the object's surface."""

_BASE_SHARE = 0.035
"""Relative error of the pressure on a taxel over the edge length of the base divided by its shorter side: of a solid,
and where parts of other stiffness stand on the base, at whose foot the stress is singular."""

_MOST_INCREMENTS = 10
"""Largest number of increments in a leg for the errors of mesh and contact, which hardly depend on this number."""


@dataclass(frozen=True)
class AdjointBars:
    """Discretisation errors by name.

    Attributes
    ----------
    bars : magnitudes, in the units of the numbers
    parts : of forces, energies and readings, the errors that the body's mesh and the contact discretisation cause
    body : signed errors that the mesh of the body causes, and the shares of its cells
    coarse : the press with every second multiplier
    kinds : of the numbers
    contact_half_length_mm : of the last increment
    """

    bars: Mapping[str, float]
    parts: Mapping[str, tuple[float, float]]
    body: BodyErrors
    coarse: Problem
    kinds: Mapping[str, Kind]
    contact_half_length_mm: float

    def body_share(self, name: str, dim: int) -> float:
        """Return the error of the body's mesh over its estimate, without the cells around a gauge."""
        return _SHARES[self.kinds[name]].body[dim - 2]

    def contact_order(self, name: str) -> int:
        """Return the order in the edge length at the contact of the contact discretisation's error of a number."""
        return _SHARES[self.kinds[name]].power


class NoAdjointBarsError(Finger3dError):
    """The condensed body gives no error bars; a companion mesh is needed."""


def applies(model: Model) -> bool:
    """Whether the error bars of a model follow from its own condensed body.

    The body must be linear elastic without inclusions, the object rigid, and every leg given by its depth.
    """
    plain = model.is_linear_elastic and model.inclusions is None and model.object_compliance is None
    as_given = model.rule == "projection" and not model.is_under_force
    return plain and as_given


def adjoint_bars(problem: Problem, steps: Sequence[StepResult], runs: Sequence[Run] = ()) -> AdjointBars:
    """Estimate the discretisation errors of the last increment.

    Parameters
    ----------
    problem : one whose model `applies`
    steps : all increments, converged
    runs : known runs with other numbers of increments in every leg

    Raises
    ------
    NoAdjointBarsError
        If the active set of an increment is singular, so that the contact forces are not unique, or if no press with
        fewer multipliers converges.
    """
    c, d = problem.delassus.shape[:2]
    with threads_for(c * d):
        return _bars(problem, steps, runs)


def _bars(problem: Problem, steps: Sequence[StepResult], runs: Sequence[Run]) -> AdjointBars:
    short, few = _with_few_increments(problem, steps, runs)
    try:
        numbers, body = _numbers(short, few[-1]), body_errors(short, few)
    except np.linalg.LinAlgError as error:
        raise NoAdjointBarsError(f"the contact forces are not unique: {error}") from error
    presses = list(with_coarse_multipliers(short, few))
    changes: dict[str, list[float]] = {name: [] for name in numbers}
    ends = [(press, list(march(press))[-1]) for press in presses]
    if not any(end.outcome.ok for _, end in ends):
        raise NoAdjointBarsError(f"no press with fewer multipliers converges: {ends[0][1].outcome}")
    for press, end in ends:
        if end.outcome.ok:
            for name, value in _numbers(press, end).items():
                changes[name].append(abs(value - numbers[name]))
    resolution = PointResolution.of(problem, steps[-1])
    kinds = kinds_of(few[-1].readings)
    # outward friction is a sum of either sign, which may cancel
    scales = largest_readings(numbers, kinds) | {Kind.FRICTION_SUM: abs(numbers["friction_sum_N"])}
    parts = {}
    for name, value in numbers.items():
        kind = kinds[name]
        shares = _SHARES[kind]
        # contact does not end within the width, so that the normal force does not depend on the spacing along z
        spacing = resolution.along if kind in (Kind.NORMAL_FORCE, Kind.WORK) else resolution.share
        relative = shares.points * spacing**shares.power * scales.get(kind, abs(value))
        if kind is Kind.FRICTION_SUM:
            relative = math.hypot(relative, resolution.few_N)
        if kind is Kind.DISSIPATION and problem.dim == 3:
            relative = math.hypot(relative, spacing * _unused_friction(problem.model, numbers) * abs(value))
        if kind in _UNDER_CURVED and problem.dim == 2 and not problem.model.object.is_flat:
            relative = math.hypot(relative, _UNDER_CURVED[kind] * resolution.along**2 * scales.get(kind, abs(value)))
        contact = math.hypot(max(changes[name]) / shares.change, relative)
        parts[name] = body.bar(name, shares.body[problem.dim - 2]), contact
    bars = {name: math.hypot(*both) for name, both in parts.items()}
    for name, relative in _unresolved_by_base(problem):
        bars[name] = math.hypot(bars[name], relative * numbers[name])
    unresolved = UNRESOLVED_DISSIPATION * resolution.share * abs(numbers["external_work_mJ"])
    bars["dissipation_mJ"] = math.hypot(bars["dissipation_mJ"], unresolved)
    zones = resolution.zone_bars
    if problem.dim == 2:
        zones |= _stick_that_comes_and_goes(zones, short, few[-1], ends, resolution.spacing_mm)
    reach = measure(problem.points, steps[-1])["contact_half_length_mm"]
    return AdjointBars(bars | zones, parts, body, presses[0], kinds, float(reach))


def _stick_that_comes_and_goes(
    bars: Mapping[str, float],
    problem: Problem,
    step: StepResult,
    coarse: Sequence[tuple[Problem, StepResult]],
    spacing_mm: float,
) -> dict[str, float]:
    """Return the error bars of the length of stick, no less than its change with every second multiplier.

    Under a wave a whole crest may stick or slip.  A change below the distance of the points does not count.

    Parameters
    ----------
    coarse : presses with every second multiplier, and their last increments
    """
    presses = [(problem, step), *(both for both in coarse if both[1].outcome.ok)]
    own, *others = (measure(press.points, end)["stick_half_length_mm"] for press, end in presses)
    half = max(bars["stick_half_length_mm"], max(abs(other - own) for other in others) - spacing_mm)
    return {"stick_half_length_mm": half, "stick_length_mm": 2.0 * half}


def _unused_friction(model: Model, numbers: Mapping[str, float]) -> float:
    """Return the share of the limit of friction that is not used: zero where all points slip.

    The less of the contact slips, the larger is the relative error of the dissipation: in random solids some four times
    this share times that of the spacing of points (validation/error_bars.py).
    """
    limit = model.friction.largest * abs(numbers["normal_force_N"])
    return max(0.0, 1.0 - numbers["friction_sum_N"] / limit) if limit > 0.0 else 0.0


def _unresolved_by_base(problem: Problem) -> list[tuple[str, float]]:
    """Return the name of every taxel and the relative error that the edges of the base leave in it."""
    mesh, facets = problem.mesh, problem.mesh.facets["base"]
    if mesh.dim == 2 and not part_of_facets(mesh, facets).any():
        return []
    corners = mesh.points[facets[:, : mesh.dim]]
    edge = float(np.median(np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)))
    sides = {t.name: min(t.length_mm, t.width_mm or t.length_mm) for t in problem.model.taxels}
    return [(pressure_column(name).key, _BASE_SHARE * edge / side) for name, side in sides.items()]


def short_press(problem: Problem, runs: Sequence[Run] = ()) -> tuple[Problem, Sequence[StepResult]]:
    """Return the press with at most `_MOST_INCREMENTS` increments in a leg, and its steps, from a run that has them."""
    known = {count: results for count, results in runs if count <= _MOST_INCREMENTS}
    most = max(known, default=_MOST_INCREMENTS)
    legs = tuple(
        replace(leg, steps=min(leg.steps, most) if isinstance(leg.steps, int) else most) for leg in problem.model.legs
    )
    short = replace(problem, model=replace(problem.model, legs=legs))
    return short, known[most] if known else list(march(short))


def _with_few_increments(
    problem: Problem, steps: Sequence[StepResult], runs: Sequence[Run]
) -> tuple[Problem, Sequence[StepResult]]:
    """Return the press with few increments, and its steps: as it is if it has few, or if the short one fails."""
    if all(isinstance(leg.steps, int) and leg.steps <= _MOST_INCREMENTS for leg in problem.model.legs):
        return problem, steps
    short, found = short_press(problem, runs)
    return (short, found) if found[-1].outcome.ok else (problem, steps)


def _numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    """Return forces, energies and readings by name."""
    numbers = measure(problem.points, step)
    main = ("normal_force_N", "friction_sum_N", *RESULTANTS[problem.dim], "external_work_mJ", "dissipation_mJ")
    return {name: float(numbers[name]) for name in main} | by_key(step.readings)
