"""Effect of tolerances on the strain of a gauge: depth, material, tilt, place of the gauge, mesh and increments.

Each effect is a finite difference over one standard deviation.  A displaced gauge is read in the same presses as the
nominal one.  Other quantities are varied in a further series of presses at some values of mu, on the coarser mesh
that the error bar comes from if that has enough contact points: the depth on another path, Young's modulus with a
scaled compliance, and Poisson's ratio, the tilt and the place of a stiff gauge on a body of their own.  Between these
values of mu the effect is interpolated.  The error of the increments follows from presses with more or fewer of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from scipy.interpolate import PchipInterpolator

from finger3d._types import Float, Int
from finger3d.accuracy.companions import built_like, companion
from finger3d.accuracy.estimate import strain_error
from finger3d.analyses.calibrate.increments import Increments, strain_error_of_increments
from finger3d.analyses.calibrate.presses import PressesByMu, presses
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.errors import Finger3dError
from finger3d.fem.condense import stiffened
from finger3d.fem.material import MIXED_FROM
from finger3d.mechanics.build import build
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.problem import Problem, object_share, scatter_to_points
from finger3d.objects import Plane
from finger3d.sensor.curve import LARGEST_SD, Tolerance

_LEAST_POINTS = {2: 150, 3: 500}
"""Contact points, by dimension, from which differences on the coarser mesh are good to a fifth of the largest."""

_TILTED_POINTS = {2: 100, 3: 500}
"""Contact points, by dimension, that the mesh of a tilted body has about."""

_GAUGE_PLACES = ("gauge_x_mm", "gauge_y_mm", "gauge_angle_deg")

Effect: TypeAlias = tuple[float, Float]
"""Step of a quantity in its unit, and the change (m,) of the strain that it causes."""


def with_defaults(given: Mapping[str, float] | None) -> dict[str, float]:
    """Return the standard deviations by name: the defaults, updated with the given ones, without those that are zero.

    Raises
    ------
    Finger3dError
        If a name is unknown or a number out of range.
    """
    from difflib import get_close_matches

    found = {name: sd for name, (sd, _) in TOLERANCES.items()}
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
    """Return the gauge displaced by plus and minus each tolerance of its place, as far as it stays in the body."""
    found = []
    for name in (n for n in _GAUGE_PLACES if n in tolerances):
        for sign in (1.0, -1.0):
            step = sign * tolerances[name]
            displaced = replace(_displaced(gauge, name, step), name=f"{gauge.name} {name} {sign:+g}")
            if _is_inside(model, displaced):
                found.append(DisplacedGauge(name, step, displaced))
    return found


def _displaced(gauge: Gauge, name: str, step: float) -> Gauge:
    if name == "gauge_x_mm":
        return replace(gauge, x_mm=gauge.x_mm + step)
    if name == "gauge_y_mm":
        return replace(gauge, y_mm=gauge.y_mm + step)
    return replace(gauge, angle=gauge.angle + math.radians(step))


def _is_inside(model: Model, gauge: Gauge) -> bool:
    at = np.array([gauge.middle, *gauge.ends])
    top = model.design.top(at[:, 0], at[:, 2])
    return bool(np.isfinite(top).all() and (at[:, 1] > 0.0).all() and (at[:, 1] < top - 1e-6).all())


@dataclass(frozen=True)
class ReferenceReadings:
    """Readings of the nominal body.

    Attributes
    ----------
    mu : (n,) array
    strain : strain (n,) by gauge
    sample : (m,) array
        Indices of the values of mu at which other bodies and paths are pressed.
    frame : the last increment of any press
    pressed : presses by mu
    """

    mu: Float
    strain: Mapping[str, Float]
    sample: Int
    frame: StepResult
    pressed: PressesByMu


@dataclass(frozen=True)
class ReferenceBody:
    """Body that others are compared with: strain (m,) of the gauge at mu (m,), and its presses by mu."""

    problem: Problem
    gauge: Gauge
    mu: Float
    strain: Float
    pressed: PressesByMu

    @classmethod
    def of(cls, problem: Problem, gauge: Gauge, mu: Float) -> ReferenceBody:
        """Press a problem at mu (m,)."""
        pressed = {p.mu: p for p in sorted(presses(problem, mu.tolist()), key=lambda p: p.mu)}
        strain = np.array([_strain(p.frame, gauge.name) for p in pressed.values()])
        return cls(problem, gauge, mu, strain, pressed)

    def change(self, problem: Problem, initial: PressesByMu | None = None) -> Float:
        """Return the change (m,) of the strain in another body or path; `initial` has the initial guesses."""
        return np.asarray(read(problem, (self.gauge.name,), self.mu, initial or self.pressed)[0] - self.strain)

    def rebuilt(self, **changes: Any) -> Problem:
        """Return the body with a changed model, and without the other gauges unless they stiffen it."""
        model = self.problem.model
        alone = model if model.inclusions else replace(model, gauges=(self.gauge,))
        return built_like(self.problem, replace(alone, **changes))


def read(problem: Problem, names: tuple[str, ...], mu: Float, initial: PressesByMu | None = None) -> Float:
    """Return the strain (g, m) of gauges at mu (m,), NaN where a press failed."""
    frames = [p.frame for p in sorted(presses(problem, mu.tolist(), initial), key=lambda p: p.mu)]
    return np.array([[_strain(f, n) for f in frames] for n in names])


def _strain(frame: StepResult, name: str) -> float:
    return frame.gauges[name] if frame.outcome.ok else math.nan


def evaluate_tolerances(
    problem: Problem,
    gauge: Gauge,
    tolerances: Mapping[str, float],
    base: ReferenceReadings,
    increments: Increments,
    say: Callable[[str], None],
) -> Iterator[Tolerance]:
    """Yield every tolerance with its effect at all values of mu of `base`.

    Parameters
    ----------
    problem : the condensed body
    gauge : Gauge
    tolerances : standard deviations by name
    base : readings of its gauges; without inclusions the displaced gauges are among them
    increments : of its path
    say : receives a line about each tolerance

    Notes
    -----
    A tolerance is left out if a press that it needs fails.
    """
    mu = base.mu[base.sample]
    own = base.strain[gauge.name][base.sample]
    body = ReferenceBody(problem, gauge, mu, own, base.pressed)
    others = set(tolerances) - {*_GAUGE_PLACES, "increments"}
    if others and increments.comparison_legs != problem.model.legs:
        legs = increments.comparison_legs
        body = ReferenceBody.of(replace(problem, model=replace(problem.model, legs=legs)), gauge, mu)
    coarse_suffices = len(problem.points.nodes) >= 2 ** (problem.dim - 1) * _LEAST_POINTS[problem.dim]
    coarse = None
    if "mesh" in tolerances or (coarse_suffices and others):
        say("a coarser body")
        coarse = _on_coarser_mesh(body, say)
    varied = coarse if coarse and coarse_suffices else body
    for name, sd in tolerances.items():
        say(f"tolerance {name}")
        effects = _effects_of_displaced_gauge(problem.model, gauge, name, sd, base)
        known = base.mu if effects else mu
        if name == "mesh":
            effects = [(sd, sd * _mesh_error(body, coarse, base.frame))] if coarse else []
        elif name == "increments":
            error = strain_error_of_increments(
                problem, own, increments.chosen, lambda other: read(other, (gauge.name,), mu)[0]
            )
            effects = [(sd, sd * error)]
        elif not effects:
            effects = list(_VARIATIONS[name](varied, sd))
        effects = [(step, _interpolated(base.mu, known, change)) for step, change in effects]
        if effects and all(np.isfinite(change).all() for _, change in effects):
            yield _tolerance(name, sd, effects)


def _tolerance(name: str, sd: float, effects: list[Effect]) -> Tolerance:
    """Return a tolerance from its effects, each scaled to one standard deviation."""
    scaled = np.array([change * sd / step for step, change in effects])
    (a, change_a), (b, change_b) = [*effects, (0.0, np.zeros(scaled.shape[1]))][:2]
    return Tolerance(
        name=name,
        unit=TOLERANCES[name][1],
        sd=sd,
        slope=(change_a - change_b) / (a - b),
        spread=np.sqrt(np.mean(scaled**2, axis=0)),
    )


def _interpolated(mu: Float, known: Float, values: Float) -> Float:
    """Return values (n,) at mu (n,) by monotone cubic interpolation, constant outside; NaN if none is known."""
    good = np.isfinite(values)
    if good.sum() < 2:
        return np.full(len(mu), values[good][0] if good.any() else math.nan)
    known, values = known[good], values[good]
    return np.asarray(PchipInterpolator(known, values)(np.clip(mu, known[0], known[-1])))


def _effects_of_displaced_gauge(
    model: Model, gauge: Gauge, name: str, sd: float, base: ReferenceReadings
) -> list[Effect]:
    """Return the effects of a displaced gauge, read in the presses of the nominal one; none if it stiffens the body."""
    if model.inclusions:
        return []
    displaced = [d for d in displaced_gauges(model, gauge, {name: sd}) if d.gauge.name in base.strain]
    return [(d.step, base.strain[d.gauge.name] - base.strain[gauge.name]) for d in displaced]


def _vary_depth(body: ReferenceBody, sd: float) -> Iterator[Effect]:
    """Press deeper, and less deep by at most half the depth of the shallowest leg."""
    problem, model = body.problem, body.problem.model
    shallowest = min(leg.depth_mm for leg in model.legs if leg.depth_mm > 0.0)
    for step in (sd, -min(sd, 0.5 * shallowest)):
        legs = tuple(replace(leg, depth_mm=leg.depth_mm + step * (leg.depth_mm > 0.0)) for leg in model.legs)
        yield step, body.change(replace(problem, model=replace(model, legs=legs)), _scaled_to_path(body, legs))


def _vary_modulus(body: ReferenceBody, sd: float) -> Iterator[Effect]:
    """Raise Young's modulus; strains depend on it only if something else in the scene has a stiffness."""
    model = body.problem.model
    alone = model.inclusions is None and model.object_compliance is None
    yield sd, np.zeros(len(body.mu)) if alone else body.change(with_modulus(body.problem, 1.0 + 0.01 * sd))


def _vary_poisson(body: ReferenceBody, sd: float) -> Iterator[Effect]:
    """Lower Poisson's ratio, or raise it if lowering leaves its range or changes the element."""
    material = body.problem.model.material.isotropic("the tolerance of nu")
    nu = material.nu
    changes_element = nu - sd < MIXED_FROM <= nu
    step = sd if nu - sd < 0.0 or (changes_element and nu + sd <= 0.5) else -sd
    yield step, body.change(body.rebuilt(material=replace(material, nu=nu + step)))


def _vary_tilt(body: ReferenceBody, sd: float) -> Iterator[Effect]:
    """Tilt a plane by plus and minus `sd`; of a symmetric scene the mirrored gauge gives the second reading.

    The mesh is another one, without symmetry, so that the two tilted bodies are compared with each other.
    """
    problem, gauge, model = body.problem, body.gauge, body.problem.model
    if not isinstance(model.object, Plane):
        return
    plane, step, mesh = model.object, math.radians(sd), _coarser(problem)
    if "x" in problem.axes and not model.inclusions:
        image = replace(gauge, name=f"{gauge.name} mirrored", x_mm=-gauge.x_mm, angle=math.pi - gauge.angle)
        tilted = body.rebuilt(mesh=mesh, object=replace(plane, tilt=step), gauges=(gauge, image), symmetry=None)
        plus, minus = read(tilted, (gauge.name, image.name), body.mu)
    else:
        plus, minus = (
            read(
                body.rebuilt(mesh=mesh, object=replace(plane, tilt=plane.tilt + sign * step), symmetry=None),
                (gauge.name,),
                body.mu,
            )[0]
            for sign in (1.0, -1.0)
        )
    half = 0.5 * (plus - minus)
    yield sd, half
    yield -sd, -half


def _vary_stiff_gauge(name: str, body: ReferenceBody, sd: float) -> Iterator[Effect]:
    """Displace a gauge that stiffens the body, as far as it stays inside."""
    model = body.problem.model
    displaced = _displaced(body.gauge, name, sd)
    if model.inclusions and _is_inside(model, displaced):
        gauges = tuple(displaced if g.name == body.gauge.name else g for g in model.gauges)
        yield sd, body.change(body.rebuilt(gauges=gauges))


_VARIATIONS: dict[str, Callable[[ReferenceBody, float], Iterator[Effect]]] = {
    "depth_mm": _vary_depth,
    "E_percent": _vary_modulus,
    "nu": _vary_poisson,
    "tilt_deg": _vary_tilt,
    **{name: partial(_vary_stiff_gauge, name) for name in _GAUGE_PLACES},
}
"""By tolerance, the function that yields its effects on a reference body for one standard deviation."""


def _scaled_to_path(body: ReferenceBody, legs: tuple[Leg, ...]) -> PressesByMu:
    """Return the presses of a body with forces extrapolated to the depths of another path, as initial guesses."""
    own = [t.depth_mm for t in targets(body.problem.model.legs)]
    strides = np.diff([0.0, *own])
    change = np.subtract([t.depth_mm for t in targets(legs)], own)
    share = np.divide(change, strides, out=np.zeros(len(own)), where=strides != 0.0)

    def extrapolated(forces: tuple[Float, ...]) -> tuple[Float, ...]:
        before = (np.zeros_like(forces[0]), *forces)
        return tuple(f + s * (f - last) for f, last, s in zip(forces, before, share, strict=False))

    return {mu: replace(press, forces=extrapolated(press.forces)) for mu, press in body.pressed.items()}


def with_modulus(problem: Problem, factor: float) -> Problem:
    """Return the problem with Young's modulus multiplied; in small strain the condensation is reused."""
    model = problem.model
    if not model.formulation.is_linear_elastic:
        material = model.material.isotropic("the tolerance of E_MPa")
        return build(replace(problem.model, material=replace(material, E_MPa=material.E_MPa * factor)))
    c, d = problem.delassus.shape[:2]

    def scaled(one: Problem) -> Problem:
        own = stiffened(one.part.condensed.compliance, one.inclusions.bar_stiffness)
        active, readings = one.system.active_dofs, len(one.system.reading_rows)
        of_object = one.delassus - scatter_to_points(own, active, c, d)
        changed = stiffened(one.part.condensed.compliance / factor, one.inclusions.bar_stiffness)
        rows = np.zeros_like(one.system.reading_rows)
        rows[:, active] = changed[len(active) : len(active) + readings, : len(active)]
        rows[len(rows) - len(model.gauges) - len(model.taxels) : len(rows) - len(model.gauges)] *= factor  # of forces
        finger = scatter_to_points(changed, active, c, d)
        share = None if one.system.object_share is None else object_share(one.surface, finger, of_object)
        system = replace(one.system, delassus=finger + of_object, reading_rows=rows, object_share=share)
        return replace(one, system=system)

    changed, bare = scaled(problem), problem.without_inclusions
    return replace(changed, without_inclusions=scaled(bare)) if bare else changed


def _on_coarser_mesh(body: ReferenceBody, say: Callable[[str], None]) -> ReferenceBody | None:
    """Return the body on the coarser mesh that the error bar comes from; None if there is no coarser mesh."""
    try:
        return ReferenceBody.of(companion(body.problem, say), body.gauge, body.mu)
    except Finger3dError:
        return None


def _mesh_error(body: ReferenceBody, coarse: ReferenceBody, frame: StepResult) -> Float:
    """Return the error bar (m,) of the strain due to the mesh, nowhere below its root mean square.

    The error depends little on mu, and where the strains of the two meshes cross they agree by chance.  `frame` is the
    last increment at any mu.
    """
    found = strain_error(body.problem, frame, coarse.problem, body.strain, coarse.strain)
    known = found[np.isfinite(found)]
    return np.maximum(found, math.sqrt(float(np.mean(known**2)))) if len(known) else found


def _coarser(problem: Problem) -> MeshOptions:
    """Return the mesh options of a tilted body: longer edges, and a structured mesh where the design allows one."""
    options, left = problem.model.mesh, len(problem.points.nodes) / _TILTED_POINTS[problem.dim]
    factor = min(2.0, max(1.0, left)) if problem.dim == 2 else min(1.5, max(1.25, math.sqrt(left)))
    mesher: Any = "swept" if problem.model.design.section() is not None else options.mesher
    return replace(options, size_mm=factor * options.size_mm, base_size_mm=factor * options.base_size_mm, mesher=mesher)
