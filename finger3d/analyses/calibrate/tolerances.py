"""Effect of tolerances on readings: depth, material, tilt, places of gauges, mesh and increments.

Each effect is a finite difference over one standard deviation, of second order where both signs are tried.  A displaced
gauge is read in the same presses as the nominal one.  Other quantities are varied in a further series of presses at
some values of mu, on the coarser mesh that the error bar comes from if that has enough contact points: the depth on
another path, Young's modulus with a scaled compliance, and Poisson's ratio, the tilt and the place of a stiff gauge on
a body of their own.  Between these values of mu the effect is interpolated.  The error of the increments follows from
presses with more or fewer of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from scipy.interpolate import PchipInterpolator

from finger3d._types import Float
from finger3d.accuracy.error_bars import gain
from finger3d.accuracy.estimate import times_modulus
from finger3d.analyses.calibrate import GAUGE_PLACES, TOLERANCES
from finger3d.analyses.calibrate.curve_points import CurvePoints, error_of_increments
from finger3d.analyses.calibrate.settings import CalibratedReading, CalibrationSettings
from finger3d.analyses.pressed_body import presses, under
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import MIXED_FROM
from finger3d.mechanics.discretise.build import changed
from finger3d.mechanics.discretise.companions import built_like, companion, edge_ratio
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import with_few_increments
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.readings import Column, Gauge, Quantity
from finger3d.objects import Plane
from finger3d.progress import Progress
from finger3d.sensor.curve import LARGEST_SD, Tolerance


@dataclass(frozen=True)
class ReferenceBody:
    """Body that others are compared with: readings (k, m) by names (k) at mu (m,)."""

    problem: Problem
    names: tuple[str, ...]
    mu: Float
    readings: Float

    @classmethod
    def of(cls, problem: Problem, names: tuple[str, ...], mu: Float) -> ReferenceBody:
        """Press a problem at mu (m,)."""
        return cls(problem, names, mu, read(problem, names, mu))

    def change(self, problem: Problem) -> Float:
        """Return the changes (k, m) of the readings in another body or path."""
        return np.asarray(read(problem, self.names, self.mu) - self.readings)

    def rebuilt(self, margin: float = MARGIN, **changes: Any) -> Problem:
        """Build the body with a changed model; other readings are omitted, except gauges that stiffen the body."""
        model = replace(reading_only(self.problem.model, self.names), **changes)
        return built_like(self.problem, model, margin=margin)


def reading_only(model: Model, names: Sequence[str]) -> Model:
    """Return the model without readings of other names; gauges that stiffen the body are kept."""
    dim = 3 if model.domain == "solid" else 2
    wanted = set(names)
    return replace(
        model,
        gauges=model.gauges if model.inclusions else tuple(g for g in model.gauges if g.name in wanted),
        markers=tuple(m for m in model.markers if wanted & {column.name for column in m.columns(dim)}),
        taxels=tuple(t for t in model.taxels if t.name in wanted),
    )


def read(problem: Problem, names: Sequence[str], mu: Float) -> Float:
    """Return readings (k, m) by names (k) at mu (m,), NaN where a press failed."""
    frames = [p.frame for p in sorted(presses(problem, mu.tolist()), key=lambda p: p.mu)]
    every = [frame.named_readings if frame.outcome.ok else {} for frame in frames]
    return np.array([[one.get(name, math.nan) for one in every] for name in names])


_TILTED_POINTS = {2: 100, 3: 500}
"""Contact points, by dimension, that the mesh of a tilted body has about."""


def deeper(legs: tuple[Leg, ...], step: float) -> tuple[Leg, ...]:
    """Return the legs with a step (mm) added to every depth but that of first touch."""
    return tuple(replace(leg, depth_mm=leg.depth_mm + step * (leg.depth_mm > 0.0)) for leg in legs)


def poisson_steps(nu: float, step: float) -> tuple[float, float]:
    """Return two steps of Poisson's ratio of the same element: to both sides, or one and two to the side with room."""
    low, high = (MIXED_FROM, 0.5) if nu >= MIXED_FROM else (0.0, MIXED_FROM - 1e-9)
    if low <= nu - step and nu + step <= high:
        return -step, step
    room = max(high - nu, low - nu, key=abs)
    step = math.copysign(min(step, 0.5 * abs(room)), room)
    return step, 2.0 * step


def with_modulus(problem: Problem, factor: float) -> Problem:
    """Return the problem with Young's moduli of all parts multiplied."""
    return changed(problem, times_modulus(problem.model, factor))


def tilted_mesh(problem: Problem) -> MeshOptions:
    """Return the mesh options of a tilted body: longer edges, and a structured mesh where the design allows one."""
    options, left = problem.model.mesh, len(problem.points.nodes) / _TILTED_POINTS[problem.dim]
    factor = min(2.0, max(1.0, left)) if problem.dim == 2 else min(1.5, max(1.25, math.sqrt(left)))
    mesher: Any = "swept" if problem.model.design.section() is not None else options.mesher
    return replace(options, size_mm=factor * options.size_mm, base_size_mm=factor * options.base_size_mm, mesher=mesher)


_FEW = 20
"""Most increments of a leg in which the effect of a tolerance is pressed, if they are chosen: it is a difference, and
within 2 % of that in 160 in the section of Fig. 9, 0.3 % where mu is found best."""

_LEAST_POINTS = {2: 150, 3: 500}
"""Least number of contact points, by dimension, for which differences on the coarser mesh are accurate enough: within a
fifth of the largest."""

_NODE = math.sqrt(3.0)
"""Step of a difference over the standard deviation: a node of Gauss-Hermite quadrature of three points, with which a
parabola has the mean and variance of the reading to fourth order, and contact points that close one by one matter
little."""

_SAMPLES = {False: 7, True: 3}
"""Values of mu at which tolerances are evaluated, in small and at finite strain."""

_CLEAR_MM = 1e-6
"""Distance from the border at which a displaced gauge is certainly in the mesh."""

Effect: TypeAlias = tuple[float, Float]
"""Step of a quantity in its unit, and the changes (k, m) of readings at several mu that it causes."""


def with_defaults(given: Mapping[str, float] | None, spread: float | None = None) -> dict[str, float]:
    """Return the standard deviations by name: the defaults, updated with the given ones, without those that are zero.

    Parameters
    ----------
    given : standard deviations by name
    spread : relative standard deviation of Young's modulus, which takes the place of the default of E_percent

    Raises
    ------
    Finger3dError
        If a name is unknown or a number out of range.
    """
    from difflib import get_close_matches

    found = {name: sd for name, (sd, _) in TOLERANCES.items()}
    if spread is not None:
        found["E_percent"] = 100.0 * spread
    for name, sd in (given or {}).items():
        if name not in TOLERANCES:
            near = get_close_matches(name, TOLERANCES, n=1, cutoff=0.0)[0]
            raise Finger3dError(f'tolerance {name}: there is none; did you mean "{near}"? ({", ".join(TOLERANCES)})')
        if not 0.0 <= sd <= LARGEST_SD:
            raise Finger3dError(f"tolerance {name} = {sd}: must be a finite number from 0 up to {LARGEST_SD:g}")
        found[name] = float(sd)
    return {name: sd for name, sd in found.items() if sd > 0.0}


@dataclass(frozen=True)
class DisplacedGauge:
    """A gauge that is displaced by `step`, in the unit of a tolerance; it has a name of its own."""

    tolerance: str
    step: float
    gauge: Gauge


def displaced_gauges(model: Model, gauge: Gauge, tolerances: Mapping[str, float]) -> list[DisplacedGauge]:
    """Return the gauge displaced by plus and minus each tolerance of its place, as far as it stays in the body.

    A gauge on the border may stay there: a displaced one need not be farther inside than the gauge itself.
    """
    found, least = [], min(_depth_inside(model, gauge), _CLEAR_MM)
    for name in (n for n in GAUGE_PLACES.values() if n in tolerances):
        for sign in (1.0, -1.0):
            step = sign * tolerances[name]
            displaced = replace(_displaced(gauge, name, step), name=f"{gauge.name} {name} {sign:+g}")
            if _depth_inside(model, displaced) >= least:
                found.append(DisplacedGauge(name, step, displaced))
    return found


def _displaced(gauge: Gauge, name: str, step: float) -> Gauge:
    if name == "gauge_x_mm":
        return replace(gauge, x_mm=gauge.x_mm + step)
    if name == "gauge_y_mm":
        return replace(gauge, y_mm=gauge.y_mm + step)
    return replace(gauge, angle=gauge.angle + math.radians(step))


def _depth_inside(model: Model, gauge: Gauge) -> float:
    """Return the least vertical distance, mm, of the gauge from base and contact surface; negative outside."""
    at = np.array([gauge.middle, *gauge.ends])
    inside = np.minimum(at[:, 1], model.design.top(at[:, 0], at[:, 2]) - at[:, 1])
    return float(np.nan_to_num(inside, nan=-np.inf).min())


def evaluate_tolerances(
    curve: CurvePoints, settings: CalibrationSettings, report: Progress
) -> Iterator[tuple[str, Tolerance]]:
    """Yield the name of a reading and a tolerance, with its effect at all values of mu of the presses.

    Parameters
    ----------
    curve : presses of the nominal body; without inclusions its readings include those of displaced gauges
    settings : the calibrated readings, and standard deviations by name
    report : receives the messages

    Notes
    -----
    A tolerance is left out if the presses that it needs fail.
    """
    problem, increments, tolerances = curve.problem, curve.increments, settings.tolerances
    readings, names = settings.readings, settings.names
    sample = np.linspace(0, len(curve.mu) - 1, _SAMPLES[problem.model.finite_strain]).round().astype(int)
    sample = np.unique(sample)
    mu, own = curve.mu[sample], np.array([curve.reading(name)[sample] for name in names])
    if increments.chosen and max(int(leg.steps) for leg in problem.model.legs) > _FEW:
        report.stage(f"{_FEW} increments")
        body = ReferenceBody.of(with_few_increments(problem, _FEW), names, mu)
    else:
        body = ReferenceBody(problem, names, mu, own)
    others = set(tolerances) - {*GAUGE_PLACES.values(), "increments"}
    coarse_suffices = len(problem.points.nodes) >= 2 ** (problem.dim - 1) * _LEAST_POINTS[problem.dim]
    coarse = None
    if "mesh" in tolerances or (coarse_suffices and others):
        report.stage("a coarser body")
        with suppress(Finger3dError):  # where there is no coarser mesh
            coarse = ReferenceBody.of(companion(body.problem, report), names, mu)
    varied = coarse if coarse and coarse_suffices else body
    for name, sd in tolerances.items():
        report.stage(f"tolerance {name}")
        known = mu
        if name == "mesh":
            effects = [(sd, sd * _mesh_errors(body, coarse, readings))] if coarse else []
        elif name == "increments":
            error = error_of_increments(problem, own, increments.chosen, lambda other: read(other, names, mu))
            effects = [(sd, sd * error)]
        elif name in GAUGE_PLACES.values() and not problem.model.inclusions:
            known = curve.mu
            effects = _effects_of_displaced_gauges(curve, readings, name, sd)
        else:
            effects = list(_VARIATIONS[name](varied, readings, sd))
        yield from _tolerances(readings, name, sd, effects, known, curve.mu)


def _tolerances(
    readings: Sequence[CalibratedReading], name: str, sd: float, effects: list[Effect], known: Float, mu: Float
) -> Iterator[tuple[str, Tolerance]]:
    """Yield the tolerance of every reading that has one, from changes (k, m) at mu (m,), interpolated to mu (n,)."""
    for i, reading in enumerate(readings):
        found = [(step, _interpolated(mu, known, change[i])) for step, change in effects]
        own = [(step, change) for step, change in found if np.isfinite(change).all()]
        if own:
            yield reading.name, tolerance_of(name, sd, own)


def tolerance_of(name: str, sd: float, effects: list[Effect]) -> Tolerance:
    """Return a tolerance from the change of a reading at one step, or the parabola through those at two."""
    step, change = effects[0]
    slope, curvature = change / step, np.zeros(len(change))
    for other, changes in effects[1:]:
        curvature = 2.0 * (change / step - changes / other) / (step - other)
        slope = slope - 0.5 * curvature * step
    return Tolerance(name=name, unit=TOLERANCES[name][1], sd=sd, slope=slope, curvature=curvature)


def _interpolated(mu: Float, known: Float, values: Float) -> Float:
    """Return values (n,) at mu (n,) by monotone cubic interpolation, constant outside; NaN if none is known."""
    good = np.isfinite(values)
    if good.sum() < 2:
        return np.full(len(mu), values[good][0] if good.any() else math.nan)
    known, values = known[good], values[good]
    return np.asarray(PchipInterpolator(known, values)(np.clip(mu, known[0], known[-1])))


def _effects_of_displaced_gauges(
    curve: CurvePoints, readings: Sequence[CalibratedReading], name: str, sd: float
) -> list[Effect]:
    """Return the effects of displaced gauges, read in the presses of the nominal ones; NaN where one leaves the body.

    Only gauges have a tolerance of place: a camera sees where a marker is at rest.
    """
    model, found = curve.problem.model, dict[float, Float]()
    for i, gauge in _gauges(model, readings):
        for d in displaced_gauges(model, gauge, {name: sd}):
            change = found.setdefault(d.step, np.full((len(readings), len(curve.mu)), math.nan))
            change[i] = curve.reading(d.gauge.name) - curve.reading(gauge.name)
    return list(found.items())


def _gauges(model: Model, readings: Sequence[CalibratedReading]) -> list[tuple[int, Gauge]]:
    """Return the gauges among the readings, with their numbers."""
    known = {g.name: g for g in model.gauges}
    return [(i, known[r.name]) for i, r in enumerate(readings) if r.name in known]


def _vary_depth(body: ReferenceBody, readings: Sequence[CalibratedReading], sd: float) -> Iterator[Effect]:
    """Press deeper, and less deep by at most half the depth of the shallowest leg."""
    problem, model = body.problem, body.problem.model
    shallowest, node = min(leg.depth_mm for leg in model.legs if leg.depth_mm > 0.0), _NODE * sd
    for step in (node, -min(node, 0.5 * shallowest)):
        yield step, body.change(under(problem, legs=deeper(model.legs, step)))


def _vary_modulus(body: ReferenceBody, readings: Sequence[CalibratedReading], sd: float) -> Iterator[Effect]:
    """Raise and lower Young's modulus; where all forces are proportional to it, pressures alone depend on it."""
    if body.problem.model.forces_scale_with_modulus:
        is_pressure = np.array([r.kind == "taxel" for r in readings])
        yield sd, 0.01 * sd * np.where(is_pressure[:, None], body.readings, 0.0)
    else:
        for step in (_NODE * sd, -min(_NODE * sd, 50.0)):
            yield step, body.change(with_modulus(body.problem, 1.0 + 0.01 * step))


def _vary_poisson(body: ReferenceBody, readings: Sequence[CalibratedReading], sd: float) -> Iterator[Effect]:
    """Lower and raise Poisson's ratio."""
    material = body.problem.model.material
    for step in poisson_steps(material.nu, _NODE * sd):
        yield step, body.change(body.rebuilt(material=replace(material, nu=material.nu + step)))


def _vary_tilt(body: ReferenceBody, readings: Sequence[CalibratedReading], sd: float) -> Iterator[Effect]:
    """Tilt a plane to both sides.

    Readings are compared on one mesh without symmetry, whose candidate points suffice for both tilts.
    """
    problem, plane = body.problem, body.problem.model.object
    if not isinstance(plane, Plane):
        return
    node = math.copysign(_NODE * sd, plane.tilt)
    step = math.radians(node)
    lifted = 2.0 * abs(step) * float(np.abs(problem.points.points[:, 0]).max())
    tilted = body.rebuilt(
        margin=MARGIN + lifted / problem.model.largest_depth_mm,
        mesh=tilted_mesh(problem),
        object=replace(plane, tilt=plane.tilt + step),
        symmetry=None,
    )
    planes = (replace(plane, tilt=plane.tilt + turn) for turn in (step, 0.0, -step))
    models = [replace(tilted.model, object=one) for one in planes]
    away, own, back = (read(changed(tilted, model), body.names, body.mu) for model in models)
    yield node, away - own
    yield -node, back - own


def _vary_stiff_gauge(
    name: str, body: ReferenceBody, readings: Sequence[CalibratedReading], sd: float
) -> Iterator[Effect]:
    """Displace each gauge that stiffens the body, unless it would leave it; only its own reading is compared."""
    model = body.problem.model
    for i, gauge in _gauges(model, readings):
        for d in displaced_gauges(model, gauge, {name: sd})[:1]:
            moved = tuple(replace(d.gauge, name=g.name) if g.name == gauge.name else g for g in model.gauges)
            change = np.full((len(readings), len(body.mu)), math.nan)
            change[i] = body.change(body.rebuilt(gauges=moved))[i]
            yield d.step, change


_VARIATIONS: dict[str, Callable[[ReferenceBody, Sequence[CalibratedReading], float], Iterator[Effect]]] = {
    "depth_mm": _vary_depth,
    "E_percent": _vary_modulus,
    "nu": _vary_poisson,
    "tilt_deg": _vary_tilt,
    **{name: partial(_vary_stiff_gauge, name) for name in GAUGE_PLACES.values()},
}
"""By tolerance, the function that yields its effects on a reference body for one standard deviation."""


def _mesh_errors(body: ReferenceBody, coarse: ReferenceBody, readings: Sequence[CalibratedReading]) -> Float:
    """Return the error bars (k, m) of readings due to the mesh, nowhere below their root mean square over mu.

    The error depends little on mu, and where the readings of the two meshes cross they agree by chance.
    """
    found, ratio = [], edge_ratio(body.problem, coarse.problem)
    for own, other, reading in zip(body.readings, coarse.readings, readings, strict=True):
        error = np.abs(own - other) / gain(ratio, Quantity.of(Column("", reading.kind)).kind.order)
        known = error[np.isfinite(error)]
        found.append(np.maximum(error, math.sqrt(float(np.mean(known**2)))) if len(known) else error)
    return np.array(found)
