"""Finite strain: neo-Hookean body, gap and directions that follow the moved points.

Newton around the same contact solution (design.md sec. 6): linearise elasticity and gap at the current state, condense,
let the contact rule solve contact exactly, repeat.  The multipliers are total: with internal forces R and tangent K,
``u + K^-1 (B^T f - R)`` is the next state, and the contact rule sees its part without f as the free motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d.contact.conditions import stiffness_weights
from finger3d.contact.state import ContactState, Increment
from finger3d.effects.base import fill
from finger3d.errors import Outcome
from finger3d.fem.assembly import Pattern
from finger3d.fem.condense import condense
from finger3d.fem.hyperelastic import InvertedError, NeoHooke, assemble, nodal_fields, stretch
from finger3d.fem.recover import displacement
from finger3d.fem.surface import Surface
from finger3d.kinematics import RULES
from finger3d.mesh import Mesh
from finger3d.model import Model
from finger3d.problem import at_points, folded

Float = NDArray[np.float64]

_ITERATIONS = 20
_SETTLED = 1e-9
"""Largest last correction of a displacement, in depths; Newton's next one would be its square."""

_SLOPE_STEP = 1e-5  # of the depth: central differences of the object's height, exact for planes
_BESIDE = 2.0  # gap beside an object, in heights of the finger


@dataclass(frozen=True)
class DeformedState(ContactState):
    """A contact state with the unknowns (N,) of the meshed part that go with it."""

    unknowns: Float | None = None


@dataclass(frozen=True)
class FiniteStrain:
    """Kinematics of a neo-Hookean body."""

    def _law(self, problem: Any) -> NeoHooke:
        material = problem.model.material
        return NeoHooke.of(material.E_MPa, material.nu, problem.model.domain == "plane-stress")

    def start(self, problem: Any) -> DeformedState:
        """At rest."""
        law, mesh = self._law(problem), problem.mesh
        unknowns = np.zeros(mesh.points.size + (len(mesh.vertices) if law.mixed else 0))
        frames = np.broadcast_to(problem.points.frame, (len(problem.surface.nodes), problem.dim, problem.dim))
        rest = ContactState.at_rest(problem.gap(problem.origin), problem.dim)
        return DeformedState(**(vars(rest) | {"frames": frames}), unknowns=unknowns)

    def increment(self, problem: Any, state: ContactState, a: Any, b: Any, guess: Float | None) -> Increment:
        """Newton until the correction is below 1e-9 depths; a cell turned inside out ends it."""
        assert isinstance(state, DeformedState)
        assert state.unknowns is not None
        mesh, law, scale = problem.mesh, self._law(problem), max(a.depth_mm, b.depth_mm)
        c, d = problem.compliance.shape[:2]
        rule, weights = RULES[problem.model.rule], stiffness_weights(problem.compliance.reshape(c * d, c * d), d)
        pattern, before = Pattern.of(mesh), displacement(mesh, state.unknowns)
        x, force, spent = state.unknowns, state.force if guess is None else guess, 0
        error = np.inf
        for _ in range(_ITERATIONS):
            try:
                tangent, inner = assemble(mesh, law, x, pattern, problem.thickness)
            except InvertedError:
                return Increment(state, Outcome.INVERTED, error, spent, "none")
            geometry = _contact(problem, problem.surface, displacement(mesh, x), b)
            body = condense(tangent, problem.held, geometry[1][problem.kept])
            problem.later.factorizations += body.factorizations
            compliance = at_points(body.compliance, problem.kept, c, d)
            relaxed = body.solve(-inner)
            free = self._free(problem, state, geometry, (before, x, relaxed), (a, b))
            found = rule(state, free, compliance, problem.model.friction, scale, force, weights)
            spent += found.iterations
            if not found.outcome.ok:
                return replace(found, state=state, iterations=spent)
            force = found.state.force
            step = relaxed + body.unknowns(force.ravel()[problem.kept])
            x = x + step
            last, error = error, float(np.abs(step[: mesh.points.size]).max()) / scale
            if error <= _SETTLED:
                after = DeformedState(**(vars(found.state) | {"frames": geometry[2]}), unknowns=x)
                return Increment(after, Outcome.CONVERGED, max(found.residual, error), spent, found.method)
            if not np.isfinite(error) or error > max(10.0, 1e3 * last):
                break
        return Increment(state, Outcome.NEWTON, error, spent, "none")

    def _free(
        self, problem: Any, state: ContactState, geometry: tuple[Float, sp.csr_matrix, Float],
        motion: tuple[Float, Float, Float], path: tuple[Any, Any],
    ) -> Float:  # fmt: skip
        """Gap and tangential position (c, d) if the body moved from x by `relaxed`, under no contact force."""
        (gap, rows, frames), (before, x, relaxed), (a, b) = geometry, motion, path
        n, d = before.size, problem.dim
        moved = np.array([b.slide_x_mm - a.slide_x_mm, a.depth_mm - b.depth_mm, b.slide_z_mm - a.slide_z_mm])[:d]
        free = np.empty((len(gap), d))
        free[:, 0] = gap + (rows @ relaxed[:n]).reshape(-1, d)[:, 0]
        since = problem.surface.trace @ ((x + relaxed)[:n].reshape(-1, d) - before) - moved
        free[:, 1:] = state.position + np.einsum("ctk,ck->ct", frames[:, 1:], since)
        # the tangent across a symmetry plane does not move, whatever the half hat's mean says
        across = np.setdiff1d(np.arange(free.size), problem.kept)
        free.ravel()[across] = np.hstack([gap[:, None], state.position]).ravel()[across]
        return free

    def unknowns(self, problem: Any, state: ContactState) -> Float:
        """Kept with the state."""
        assert isinstance(state, DeformedState)
        assert state.unknowns is not None
        return state.unknowns

    def gauges(self, problem: Any, state: ContactState) -> dict[str, float]:
        """Relative elongation of a line along the gauge, at its point or between its ends."""
        mesh, axes = problem.mesh, problem.axes
        u = displacement(mesh, self.unknowns(problem, state))
        out = {}
        for gauge in problem.model.gauges:
            if gauge.length_mm == 0.0:
                out[gauge.name] = stretch(mesh, u, *folded(gauge.middle, gauge.direction, axes, mesh.dim))
                continue
            ends = [_moved(mesh, u, end, axes) for end in gauge.ends]
            out[gauge.name] = float(np.linalg.norm(ends[1] - ends[0])) / gauge.length_mm - 1.0
        return out

    def gap(self, problem: Any, state: ContactState, target: Any, face: Surface) -> Float:
        """Gap of the moved points."""
        return _contact(problem, face, displacement(problem.mesh, self.unknowns(problem, state)), target)[0]

    def fields(self, problem: Any, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement, Green-Lagrange strain and Cauchy stress."""
        unknowns, law = self.unknowns(problem, state), self._law(problem)
        strain, cauchy = nodal_fields(problem.mesh, law, unknowns)
        return displacement(problem.mesh, unknowns), strain, cauchy


def _moved(mesh: Mesh, u: Float, place: Float, axes: tuple[str, ...]) -> Float:
    """Where a material point (3,) went (d,), seen in the whole finger."""
    from finger3d.fem.elements import shape
    from finger3d.fem.surface import locate

    d = mesh.dim
    inside, ones = folded(place, np.ones(3), axes, d)
    cell, bary = locate(mesh, inside)[0]
    return place[:d] + ones * (shape(bary[None], mesh.is_quadratic)[0] @ u[mesh.cells[cell]])


def _contact(problem: Any, face: Surface, u: Float, target: Any) -> tuple[Float, sp.csr_matrix, Float]:
    """Gap (c,), rows (c d, n d) and directions (c, d, d) of points of a face displaced by u (n, d)."""
    model, d = problem.model, problem.dim
    at = face.samples + face.interpolate @ u
    z = at[:, 2] - target.slide_z_mm if d == 3 else np.zeros(len(at))
    x, step = at[:, 0] - target.slide_x_mm, _SLOPE_STEP * max(target.depth_mm, 1e-3)
    level = model.object.height(x, z)
    there = np.isfinite(level)
    slope_x = (model.object.height(x + step, z) - model.object.height(x - step, z)) / (2.0 * step)
    slope_z = (model.object.height(x, z + step) - model.object.height(x, z - step)) / (2.0 * step)
    normal = np.stack([slope_x, np.full(len(x), -1.0), slope_z], axis=1)[:, :d]
    usable = there & np.isfinite(normal).all(axis=1)
    normal = np.where(usable[:, None], normal, problem.points.frame[0])
    length = np.linalg.norm(normal, axis=1)
    normal = normal / length[:, None]
    vertical = level + problem.touch_mm - target.depth_mm - at[:, 1]
    gap = face.average @ np.where(there, vertical / length, _BESIDE * model.design.height_mm)
    mean = face.average @ normal
    for axis in problem.axes:
        k = "xyz".index(axis)
        mean[face.points[:, k] == 0.0, k] = 0.0
    frames = _frames(mean)
    parts = [face.average @ sp.diags_array(normal[:, k]) @ face.interpolate for k in range(d)]
    blocks = [sp.hstack(parts, format="csr")]
    blocks += [
        sp.hstack([sp.diags_array(frames[:, t, k]) @ face.trace for k in range(d)], format="csr") for t in range(1, d)
    ]
    c, n = len(face.nodes), len(u)
    rows = sp.vstack(blocks, format="csr")[np.arange(c * d).reshape(d, c).T.ravel()]
    return gap, sp.csr_matrix(rows[:, np.arange(n * d).reshape(d, n).T.ravel()]), frames


def _frames(normal: Float) -> Float:
    """Directions (c, d, d) with the given normals (c, d): the first tangent is +x laid into the plane."""
    d = normal.shape[1]
    n = normal / np.linalg.norm(normal, axis=1)[:, None]
    along = np.eye(d)[0] - n[:, :1] * n
    along /= np.linalg.norm(along, axis=1)[:, None]
    rows = [n, along] if d == 2 else [n, along, np.cross(n, along)]
    return np.stack(rows, axis=1)


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.large_deformation]: none. Neo-Hookean, W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2."""

    def apply(self, model: Model) -> Model:
        """Fill the kinematics slot."""
        return fill(model, "kinematics", FiniteStrain(), "large_deformation")
