"""What else moves the strain: depth, material, tilt, and where the gauge really lies, by finite differences.

Gauges that are a little off are read beside the true one from the same presses.  All else is a difference between two
presses, of a fine mesh those of the coarser one that its error bar comes from: depth is another path of it, E another
scale of its compliance; nu, tilt and a foil that lies elsewhere are bodies of their own.  Differences are over one
tolerance, at a few mu; slopes in between are interpolated.  What the increments leave out is a difference to presses of
more or fewer of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from finger3d._ranges import LARGEST_SD
from finger3d._types import Float, Int
from finger3d.accuracy.companions import built_like, companion
from finger3d.accuracy.estimate import strain_error
from finger3d.analyses.calibrate.increments import Increments, increment_error
from finger3d.analyses.calibrate.presses import Like, presses
from finger3d.analyses.calibrate.tolerance_table import TOLERANCES
from finger3d.errors import Finger3dError
from finger3d.fem.condense import stiffened
from finger3d.fem.material import MIXED_FROM
from finger3d.mechanics.build import build
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.problem import Problem, scatter_to_points
from finger3d.objects import Plane
from finger3d.sensor.curve import Tolerance

_ENOUGH = {2: 150, 3: 500}  # contact points that make a coarser body's differences good to a fifth of the largest
_LEFT = {2: 100, 3: 500}  # contact points that a tilted body is left with
_PLACES = ("gauge_x_mm", "gauge_y_mm", "gauge_angle_deg")


def chosen(given: Mapping[str, float] | None) -> dict[str, float]:
    """The tolerances (standard deviations) by name: the defaults, changed by what is given; 0 leaves one out."""
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
    """The same gauge laid a little off, by `step` of one tolerance's unit, under another name."""

    tolerance: str
    step: float
    gauge: Gauge


def moved_gauges(model: Model, gauge: Gauge, tolerances: Mapping[str, float]) -> list[DisplacedGauge]:
    """The gauge off by plus and minus each tolerance of place; sides that leave the body are left out."""
    found = []
    for name in (n for n in _PLACES if n in tolerances):
        for sign in (1.0, -1.0):
            step = sign * tolerances[name]
            off = replace(_off(gauge, name, step), name=f"{gauge.name} {name} {sign:+g}")
            if _inside(model, off):
                found.append(DisplacedGauge(name, step, off))
    return found


def _off(gauge: Gauge, name: str, step: float) -> Gauge:
    if name == "gauge_x_mm":
        return replace(gauge, x_mm=gauge.x_mm + step)
    if name == "gauge_y_mm":
        return replace(gauge, y_mm=gauge.y_mm + step)
    return replace(gauge, angle=gauge.angle + math.radians(step))


def _inside(model: Model, gauge: Gauge) -> bool:
    at = np.array([gauge.middle, *gauge.ends])
    top = model.design.top(at[:, 0], at[:, 2])
    return bool(np.isfinite(top).all() and (at[:, 1] > 0.0).all() and (at[:, 1] < top - 1e-6).all())


@dataclass(frozen=True)
class ReferenceReadings:
    """Presses of the nominal body.

    Attributes
    ----------
    mu, strain : (n,), and (n,) of every gauge by name
    few : numbers of the mu at which other bodies and paths are pressed
    frame : the last one of any press
    pressed : presses that others may start from
    """

    mu: Float
    strain: Mapping[str, Float]
    few: Int
    frame: StepResult
    pressed: Like


@dataclass(frozen=True)
class ReferenceBody:
    """The body that others are compared with: strain (m,) of the gauge at mu (m,), and presses they may start from."""

    problem: Problem
    gauge: Gauge
    mu: Float
    strain: Float
    pressed: Like

    def change(self, problem: Problem, like: Like | None = None) -> Float:
        """Return the change of the strain (m,) in another body or path; `like` gives initial guesses."""
        return np.asarray(read(problem, (self.gauge.name,), self.mu, like or self.pressed)[0] - self.strain)

    def rebuilt(self, **changes: Any) -> Problem:
        """The body with another model, without the gauges that nobody reads; all of them where they stiffen it."""
        model = self.problem.model
        alone = model if model.inclusions else replace(model, gauges=(self.gauge,))
        return built_like(self.problem, replace(alone, **changes))


def read(problem: Problem, names: tuple[str, ...], mu: Float, like: Like | None = None) -> Float:
    """Strain (g, m) of some gauges at mu (m,), nan where a press failed."""
    frames = [p.frame for p in presses(problem, mu.tolist(), like)]
    return np.array([[_strain(f, n) for f in frames] for n in names])


def _strain(frame: StepResult, name: str) -> float:
    return frame.gauges[name] if frame.outcome.ok else math.nan


def slopes(
    problem: Problem,
    gauge: Gauge,
    tolerances: Mapping[str, float],
    base: ReferenceReadings,
    increments: Increments,
    say: Callable[[str], None],
) -> Iterator[Tolerance]:
    """Every tolerance with its slope at all mu of `base`; those between the few are interpolated.

    Parameters
    ----------
    problem : the condensed body
    increments : of its path; presses that are only compared with each other may have fewer
    base : strains of its gauges, those a little off among them unless it has inclusions
    say : told which tolerance is being tried; a press that fails is passed over
    """
    at = base.few
    own = base.strain[gauge.name][at]
    body = ReferenceBody(problem, gauge, base.mu[at], own, base.pressed)
    others = set(tolerances) - {*_PLACES, "increments"}
    if others and increments.light != problem.model.legs:
        body = _body(replace(problem, model=replace(problem.model, legs=increments.light)), gauge, base.mu[at])
    enough = len(problem.points.nodes) >= 2 ** (problem.dim - 1) * _ENOUGH[problem.dim]
    coarse = None
    if "mesh" in tolerances or (enough and others):
        say("a coarser body")
        coarse = _beside_mesh(body, say)
    for name, sd in tolerances.items():
        say(f"tolerance {name}")
        beside = _beside(problem.model, gauge, name, sd, base)
        where = np.arange(len(base.mu)) if beside else at
        if name == "mesh":
            steps = [(sd, sd * _mesh_error(body, coarse, base.frame))] if coarse else []
        elif name == "increments":
            left = increment_error(
                problem, own, increments.chosen, lambda other: read(other, (gauge.name,), base.mu[at])[0]
            )
            steps = [(sd, sd * left)]
        else:
            steps = beside or list(_steps(coarse if coarse and enough else body, name, sd))
        if not steps:
            continue
        steps = [(step, _between(base.mu, base.mu[where], effect)) for step, effect in steps]
        if not all(np.isfinite(effect).all() for _, effect in steps):
            continue
        # a step may be cut short, for instance at the body's edge: its effect is scaled to one sd
        effects = np.array([effect * sd / step for step, effect in steps])
        (a, at_a), (b, at_b) = [*steps, (0.0, np.zeros(len(base.mu)))][:2]
        yield Tolerance(
            name=name,
            unit=TOLERANCES[name][1],
            sd=sd,
            slope=(at_a - at_b) / (a - b),
            spread=np.sqrt(np.mean(effects**2, axis=0)),
        )


def _between(mu: Float, at: Float, values: Float) -> Float:
    """Values (n,) at mu (n,) by PCHIP of those (m,) at some that are known, constant beyond; nan where none is."""
    good = np.isfinite(values)
    if good.sum() < 2:
        return np.full(len(mu), values[good][0] if good.any() else math.nan)
    at, values = at[good], values[good]
    return np.asarray(PchipInterpolator(at, values)(np.clip(mu, at[0], at[-1])))


def _beside(model: Model, gauge: Gauge, name: str, sd: float, base: ReferenceReadings) -> list[tuple[float, Float]]:
    """Steps of a gauge's place, and what they change, read from the same presses."""
    if model.inclusions:
        return []
    off = [m for m in moved_gauges(model, gauge, {name: sd}) if m.gauge.name in base.strain]
    return [(m.step, base.strain[m.gauge.name] - base.strain[gauge.name]) for m in off]


def _steps(body: ReferenceBody, name: str, sd: float) -> Iterator[tuple[float, Float]]:
    """One or two steps of a tolerance, and what they change the strain (m,) by."""
    problem, gauge = body.problem, body.gauge
    model = problem.model
    if name == "depth_mm":
        shallowest = min(leg.depth_mm for leg in model.legs if leg.depth_mm > 0.0)
        for step in (sd, -min(sd, 0.5 * shallowest)):
            legs = tuple(replace(leg, depth_mm=leg.depth_mm + step * (leg.depth_mm > 0.0)) for leg in model.legs)
            yield step, body.change(replace(problem, model=replace(model, legs=legs)), _along(body, legs))
    elif name == "E_percent":
        alone = model.inclusions is None and model.object_compliance is None
        # strains do not know the modulus unless something else in the scene has a stiffness too
        yield sd, np.zeros(len(body.mu)) if alone else body.change(with_modulus(problem, 1.0 + 0.01 * sd))
    elif name == "nu":
        material = model.material.isotropic("the tolerance of nu")
        step = _step_of_nu(material.nu, sd)
        yield step, body.change(body.rebuilt(material=replace(material, nu=material.nu + step)))
    elif name == "tilt_deg":
        yield from _tilted(body, sd)
    elif name in _PLACES and model.inclusions:  # a foil stiffens the body where it lies
        off = _off(gauge, name, sd)
        if _inside(model, off):
            gauges = tuple(off if g.name == gauge.name else g for g in model.gauges)
            yield sd, body.change(body.rebuilt(gauges=gauges))


def _along(body: ReferenceBody, legs: tuple[Leg, ...]) -> Like:
    """The body's presses as they may be on other legs: forces go on with the depth at the pace of each increment."""
    own = [t.depth_mm for t in targets(body.problem.model.legs)]
    strides = np.diff([0.0, *own])
    change = np.subtract([t.depth_mm for t in targets(legs)], own)
    share = np.divide(change, strides, out=np.zeros(len(own)), where=strides != 0.0)

    def moved(forces: tuple[Float, ...]) -> tuple[Float, ...]:
        before = (np.zeros_like(forces[0]), *forces)
        return tuple(f + s * (f - last) for f, last, s in zip(forces, before, share, strict=False))

    return {mu: replace(one, forces=moved(one.forces)) for mu, one in body.pressed.items()}


def _step_of_nu(nu: float, sd: float) -> float:
    """Down, unless that leaves the range or the element that the body is made of."""
    other_side = nu - sd < MIXED_FROM <= nu
    return sd if nu - sd < 0.0 or (other_side and nu + sd <= 0.5) else -sd


def with_modulus(problem: Problem, times: float) -> Problem:
    """The problem with its Young's modulus multiplied, in small strain from the same condensation."""
    if not problem.model.formulation.is_linear_elastic:
        material = problem.model.material.isotropic("the tolerance of E_MPa")
        return build(replace(problem.model, material=replace(material, E_MPa=material.E_MPa * times)))
    c, d = problem.delassus.shape[:2]

    def soft(one: Problem) -> Problem:
        own = stiffened(one.part.condensed.compliance, one.inclusions.bar_stiffness)
        active, gauges = one.system.active_dofs, len(one.system.gauge_rows)
        rest = one.delassus - scatter_to_points(own, active, c, d)  # of the object
        changed = stiffened(one.part.condensed.compliance / times, one.inclusions.bar_stiffness)
        rows = np.zeros_like(one.system.gauge_rows)
        rows[:, active] = changed[len(active) : len(active) + gauges, : len(active)]
        delassus = scatter_to_points(changed, active, c, d) + rest
        return replace(one, system=replace(one.system, delassus=delassus, gauge_rows=rows))

    changed = soft(problem)
    return (
        replace(changed, without_inclusions=soft(problem.without_inclusions)) if problem.without_inclusions else changed
    )


def _beside_mesh(body: ReferenceBody, say: Callable[[str], None]) -> ReferenceBody | None:
    """The same on the coarser mesh that the error bar comes from; none of a mesh that has no coarser one."""
    try:
        return _body(companion(body.problem, say), body.gauge, body.mu)
    except Finger3dError:
        return None


def _body(problem: Problem, gauge: Gauge, mu: Float) -> ReferenceBody:
    """A body pressed at mu (m,), to compare others with."""
    pressed = {p.mu: p for p in presses(problem, mu.tolist())}
    strain = np.array([_strain(p.frame, gauge.name) for p in pressed.values()])
    return ReferenceBody(problem, gauge, mu, strain, pressed)


def _mesh_error(body: ReferenceBody, coarse: ReferenceBody, frame: StepResult) -> Float:
    """Error bar (m,) of the strain, by its grain in a last frame at any mu.

    Nowhere below its root mean square: errors of a mesh are much alike at all mu, and where the two curves cross they
    agree by chance.
    """
    found = strain_error(body.problem, frame, coarse.problem, body.strain, coarse.strain)
    known = found[np.isfinite(found)]
    return np.maximum(found, math.sqrt(float(np.mean(known**2)))) if len(known) else found


def _coarser(problem: Problem) -> MeshOptions:
    """Edge lengths of a tilted body, which is compared with its own mirror image: longer, with some points left to
    touch; structured where the design allows, so that nothing is meshed for long.
    """
    options, left = problem.model.mesh, len(problem.points.nodes) / _LEFT[problem.dim]
    times = min(2.0, max(1.0, left)) if problem.dim == 2 else min(1.5, max(1.25, math.sqrt(left)))
    mesher: Any = "swept" if problem.model.design.section() is not None else options.mesher
    return replace(options, size_mm=times * options.size_mm, base_size_mm=times * options.base_size_mm, mesher=mesher)


def _tilted(body: ReferenceBody, sd: float) -> Iterator[tuple[float, Float]]:
    """A plane that is not level; of a scene that is its own mirror image one tilt gives both, by the mirrored gauge."""
    problem, gauge, model = body.problem, body.gauge, body.problem.model
    thing = model.object
    if not isinstance(thing, Plane):
        return
    step, mesh = math.radians(sd), _coarser(problem)
    if "x" in problem.axes and not model.inclusions:
        image = replace(gauge, name=f"{gauge.name} mirrored", x_mm=-gauge.x_mm, angle=math.pi - gauge.angle)
        other = body.rebuilt(mesh=mesh, object=replace(thing, tilt=step), gauges=(gauge, image), symmetry=None)
        there, back = read(other, (gauge.name, image.name), body.mu)
    else:
        tilted = [
            body.rebuilt(mesh=mesh, object=replace(thing, tilt=thing.tilt + sign * step), symmetry=None)
            for sign in (1.0, -1.0)
        ]
        there, back = (read(one, (gauge.name,), body.mu)[0] for one in tilted)
    # the body's mesh is another one, whole: it is compared with itself
    half = 0.5 * (there - back)
    yield sd, half
    yield -sd, -half
