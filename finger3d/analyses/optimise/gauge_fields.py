"""Strain at any place of a body, for several mu, and how the tolerances change it.

The displacement of each press gives the strain of a gauge at any place along any direction, so that all candidates
share the presses.  The tolerances are those of a calibration, each a finite difference over one standard deviation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float
from finger3d.accuracy.richardson import gain
from finger3d.analyses.calibrate.variations import deeper, poisson_steps, tilted_mesh, with_modulus
from finger3d.analyses.pressed_body import PressedBody, presses, under
from finger3d.fem.recovery.recover import displacement
from finger3d.fem.recovery.strain_reader import StrainReader
from finger3d.mechanics.discretise.companions import built_like, companion, edge_ratio
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import with_steps
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import Kind
from finger3d.objects import Plane
from finger3d.progress import Progress
from finger3d.sensor.likelihood import ReadingEffects
from finger3d.sensor.model import SHARED

_STEPS, _STEPS_OF_SECTION = 20, 80
"""Number of increments of a leg with automatic increments; few suffice, as places are only compared.  In a section in
small strain they cost little, and twenty lead to other places: in the finger of Fig. 9 two gauges then tell mu to 0.016
in place of 0.014."""


@dataclass(frozen=True)
class StrainField:
    """Strain of a body pressed with several mu (m).

    Attributes
    ----------
    u : (m, n, d) displacements of the meshed part, mm
    """

    problem: Problem
    u: Float

    @classmethod
    def of(cls, problem: Problem, mus: Sequence[float]) -> StrainField:
        """Press a body; a press that fails is an error."""
        found = sorted(presses(problem, list(mus)), key=lambda p: p.mu)
        return cls.of_frames(problem, [p.frame for p in found], mus)

    @classmethod
    def of_frames(cls, problem: Problem, frames: Sequence[StepResult], mus: Sequence[float]) -> StrainField:
        """Return the field of the last increments of presses."""
        for mu, frame in zip(mus, frames, strict=True):
            frame.check(f"optimise: mu = {mu:g}")
        unknowns = formulation_of(problem.model).unknowns(problem, [f.meshed_state for f in frames])
        return cls(problem, np.array([displacement(problem.mesh, x) for x in unknowns]))

    def strain(self, points: Float, angles: Float) -> Float:
        """Return the strain (p, a, m) at points (p, 3) along directions (a,), rad; NaN outside the body."""
        d, finite = self.problem.dim, self.problem.model.finite_strain
        reader = StrainReader.at(self.problem.mesh, points[:, :d], self.problem.axes)
        every = np.stack([reader.green_lagrange(u) if finite else reader.strain(u) for u in self.u], axis=-1)
        c, s = np.cos(angles), np.sin(angles)
        along = np.einsum("pkm,ka->pam", every, np.stack([c * c, s * s, 2.0 * s * c]))
        return np.asarray(np.sqrt(1.0 + 2.0 * along) - 1.0 if finite else along)


@dataclass(frozen=True)
class GaugeFields:
    """Strain fields of a body and of those that its tolerances make of it.

    Attributes
    ----------
    mus : (m,) ascending
    noise : standard deviation of a strain reading
    tolerances : standard deviation by name
    shared : for each tolerance that changes all gauges together, its effect (p, a, m) at given points and angles
    coarse, gain : field on the companion mesh, and its change over the error of the mesh
    """

    nominal: StrainField
    mus: tuple[float, ...]
    noise: float
    tolerances: Mapping[str, float]
    shared: Mapping[str, Callable[[Float, Float], Float]]
    coarse: StrainField | None = None
    gain: float = 1.0

    @classmethod
    def of(
        cls, model: Model, mus: Sequence[float], noise: float, tolerances: Mapping[str, float], report: Progress
    ) -> GaugeFields:
        """Press the body of a model, and those that its tolerances make of it."""
        model = replace(model, gauges=(), markers=(), taxels=())
        report.stage("pressing the body")
        body = PressedBody(model, report)
        is_quick = body.problem.dim == 2 and not model.finite_strain
        legs = with_steps(body.problem, _STEPS_OF_SECTION if is_quick else _STEPS).model.legs
        ends = body.ends(list(mus), legs)
        nominal = StrainField.of_frames(under(body.problem, legs=legs), ends, mus)
        problem, shared = nominal.problem, {}
        for name in SHARED:
            if name in tolerances:
                report.stage(f"tolerance {name}")
                if (found := _effect(nominal, name, mus, tolerances[name])) is not None:
                    shared[name] = found
        coarse, ratio = None, 1.0
        if "mesh" in tolerances:
            report.stage("tolerance mesh")
            beside = companion(problem)
            coarse, ratio = StrainField.of(beside, mus), gain(edge_ratio(problem, beside), Kind.STRAIN.order)
        return cls(nominal, tuple(mus), noise, tolerances, shared, coarse, ratio)

    def effects(self, points: Float, angles: Float) -> ReadingEffects:
        """Return slopes, effects and variances of gauges at points (p, 3) along angles (a,), a candidate for each pair.

        Values are NaN for a candidate outside the body, or displaced out of it by a tolerance.
        """
        strain = self.nominal.strain(points, angles)
        slope = np.gradient(strain, np.array(self.mus), axis=-1)
        effects = [slope, *(effect(points, angles) for effect in self.shared.values())]
        variance = np.full(strain.shape, self.noise**2)
        for axis, name in enumerate(("gauge_x_mm", "gauge_y_mm")):
            if name in self.tolerances:
                variance = variance + self._displaced(points, angles, axis, self.tolerances[name]) ** 2
        if "gauge_angle_deg" in self.tolerances:
            turn = math.radians(self.tolerances["gauge_angle_deg"])
            turned = self.nominal.strain(points, angles + turn) - self.nominal.strain(points, angles - turn)
            variance = variance + (0.5 * turned) ** 2
        if self.coarse is not None:
            variance = variance + self.tolerances["mesh"] ** 2 * self._mesh_error(points, angles) ** 2
        return ReadingEffects(
            np.stack(effects, axis=-1).reshape(-1, len(self.mus), len(effects)), variance.reshape(-1, len(self.mus))
        )

    def _mesh_error(self, points: Float, angles: Float) -> Float:
        """Return the error (p, a, m) of the strain due to the mesh, the root mean square around each point.

        The strains of two meshes agree by chance at some points, as they do at some mu, so that the error is also
        nowhere below its root mean square over mu, as in a calibration.
        """
        assert self.coarse is not None
        radius = 0.5 * self.nominal.problem.model.mesh.base_size_mm
        squares = []
        for step in radius * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]):
            change = self.coarse.strain(points + step, angles) - self.nominal.strain(points + step, angles)
            squares.append((change / self.gain) ** 2)
        with np.errstate(invalid="ignore"):
            known = np.isfinite(squares)
            square = np.where(known, squares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        return np.asarray(np.sqrt(np.maximum(square, square.mean(axis=-1, keepdims=True))))

    def _displaced(self, points: Float, angles: Float, axis: int, sd: float) -> Float:
        step = sd * np.eye(3)[axis]
        return 0.5 * (self.nominal.strain(points + step, angles) - self.nominal.strain(points - step, angles))


Effect = Callable[[Float, Float], Float]


def _effect(nominal: StrainField, name: str, mus: Sequence[float], sd: float) -> Effect | None:
    """Return the effect of a tolerance that all gauges share, None if it has none.

    The press goes deeper, and the modulus or Poisson's ratio is raised; where all forces are proportional to the
    modulus, no strain depends on it.
    """
    problem, model, sign = nominal.problem, nominal.problem.model, 1.0
    if name == "tilt_deg":
        return _tilt(nominal, mus, sd)
    if name == "depth_mm":
        changed = under(problem, legs=deeper(model.legs, sd))
    elif name == "nu":
        material = model.material
        step, _ = poisson_steps(material.nu, sd)
        changed = built_like(problem, replace(model, material=replace(material, nu=material.nu + step)))
        sign = math.copysign(1.0, step)
    elif model.forces_scale_with_modulus:
        return None
    else:
        changed = with_modulus(problem, 1.0 + 0.01 * sd)
    other = StrainField.of(changed, mus)
    return lambda points, angles: sign * (other.strain(points, angles) - nominal.strain(points, angles))


def _tilt(nominal: StrainField, mus: Sequence[float], sd: float) -> Effect | None:
    """Tilt a plane by plus and minus one standard deviation; by symmetry, a mirrored gauge replaces the second tilt."""
    problem = nominal.problem
    plane = problem.model.object
    if not isinstance(plane, Plane):
        return None

    def tilted(sign: float) -> StrainField:
        changed = replace(plane, tilt=plane.tilt + sign * math.radians(sd))
        model = replace(problem.model, mesh=tilted_mesh(problem), object=changed, symmetry=None)
        return StrainField.of(built_like(problem, model), mus)

    plus = tilted(1.0)
    if "x" in problem.axes:
        mirror = np.array([-1.0, 1.0, 1.0])
        return lambda points, angles: (
            0.5 * (plus.strain(points, angles) - plus.strain(points * mirror, math.pi - angles))
        )
    minus = tilted(-1.0)
    return lambda points, angles: 0.5 * (plus.strain(points, angles) - minus.strain(points, angles))
