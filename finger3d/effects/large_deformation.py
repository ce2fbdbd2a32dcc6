"""Finite strain: neo-Hookean body, gap and directions that follow the moved points.

Newton around the same contact solution: linearise elasticity and gap at the current state, condense,
let the contact rule solve contact exactly, repeat.  The multipliers are total: with internal forces R and tangent K,
``u + K^-1 (B^T f - R)`` is the next state, and the contact rule sees its part without f as the free motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d.contact.conditions import TOLERANCE, augmentation_parameters, residual
from finger3d.contact.state import ContactSolution, ContactState, next_state
from finger3d.effects.base import fill
from finger3d.errors import Outcome
from finger3d.fem.assembly import Pattern, Stiffness, on_places, pressure_scale
from finger3d.fem.condense import Condensation, condense
from finger3d.fem.finite_contact import DeformedContact, deformed_contact
from finger3d.fem.neo_hooke import InvertedError, NeoHooke, assemble, nodal_fields
from finger3d.fem.recover import displacement
from finger3d.fem.traces import BoundarySurface
from finger3d.mechanics.formulation import Workspace, length_scale, solve_contact
from finger3d.mechanics.history import ObjectPose
from finger3d.mechanics.model import Model
from finger3d.mechanics.problem import Problem, scatter_to_points

Float = NDArray[np.float64]

_ITERATIONS = 20
_SETTLED = 1e-9  # largest violation; round-off may leave as much as TOLERANCE
_SHARES = (1.0, 0.5, 0.25, 0.125)  # of a step that would turn a cell inside out

_SLOPE_STEP = 1e-5  # of the depth: central differences of the object's height, exact for planes
_BESIDE = 2.0  # gap beside an object, in heights of the finger


@dataclass(frozen=True)
class DeformedState(ContactState):
    """A contact state with the unknowns (N,) of the meshed part that go with it."""

    unknowns: Float | None = None


@dataclass(frozen=True)
class FiniteStrain:
    """Kinematics of a neo-Hookean body."""

    finite_strain: ClassVar[bool] = True
    is_linear_elastic: ClassVar[bool] = False
    refactorises: ClassVar[bool] = True
    supported_slots: ClassVar[frozenset[str]] = frozenset()

    def workspace(self) -> NewtonWorkspace:
        """Nothing assembled, nothing factored."""
        return NewtonWorkspace()

    def _law(self, problem: Problem) -> NeoHooke:
        material = problem.model.material.isotropic("effects.large_deformation")
        return NeoHooke.of(material.E_MPa, material.nu, problem.model.domain == "plane-stress")

    def start(self, problem: Problem) -> DeformedState:
        """At rest."""
        law, mesh = self._law(problem), problem.mesh
        unknowns = np.zeros(mesh.points.size + (len(mesh.vertices) if law.mixed else 0))
        frames = np.broadcast_to(problem.points.basis, (len(problem.surface.nodes), problem.dim, problem.dim))
        rest = ContactState.at_rest(problem.gap(problem.origin), problem.dim)
        return DeformedState(**(vars(rest) | {"bases": frames}), unknowns=unknowns)

    def increment(
        self,
        problem: Problem,
        state: ContactState,
        a: ObjectPose,
        b: ObjectPose,
        guess: Float | None,
        workspace: Workspace,
    ) -> ContactSolution:
        """Newton until all conditions hold where it has come to.

        It begins with the factor that the increment before ended with, which is that of the same place.
        """
        assert isinstance(state, DeformedState)
        assert isinstance(workspace, NewtonWorkspace)
        assert state.unknowns is not None
        law, scale = self._law(problem), length_scale(problem, a, b)
        c, d = problem.delassus.shape[:2]
        weights = augmentation_parameters(problem.delassus.reshape(c * d, c * d), d)
        place, body = self._begin(problem, law, state.unknowns, workspace)
        force, spent, found = state.force if guess is None else guess, 0, None
        error = size = np.inf
        for _ in range(_ITERATIONS):
            contact = _contact(problem, problem.surface, displacement(problem.mesh, place.x), b)
            if found is not None:
                moved = _moved_by(problem, state, contact, (state.unknowns, place.x, None), (a, b))
                last, error = error, _violation(problem, place, contact, found.state, moved, (scale, law.shear))
                if error <= _SETTLED or 0.3 * last < error <= TOLERANCE:
                    workspace.last = replace(place, tangent=None), body
                    after = vars(next_state(state, found.state.force, moved, found.state.status))
                    settled = DeformedState(**(after | {"bases": contact.bases}), unknowns=place.x)
                    return ContactSolution(settled, Outcome.CONVERGED, max(found.residual, error), spent, found.method)
            if place.tangent is not None:
                body = _factored(problem, place.tangent, contact, force[:, 0], body, workspace)
            assert body is not None
            relaxed = body.solve(-place.inner)
            free = _moved_by(problem, state, contact, (state.unknowns, place.x, relaxed), (a, b))
            free[:, 1:] += state.tangential_displacement
            compliance = scatter_to_points(body.compliance, problem.active_dofs, c, d)
            found = solve_contact(problem, state, free, compliance, scale, force, weights)
            spent += found.iterations
            if not found.outcome.ok:
                return replace(found, state=state, iterations=spent)
            force = found.state.force
            step = relaxed + body.unknowns(force.ravel()[problem.active_dofs])
            last, size = size, float(np.abs(step[: problem.mesh.points.size]).max()) / scale
            if not np.isfinite(size) or size > max(10.0, 1e3 * last):
                break
            onward = _onward(problem, law, place, step, workspace)
            if onward is None:
                return ContactSolution(state, Outcome.INVERTED, error, spent, "none")
            place = onward
        return ContactSolution(state, Outcome.NEWTON, error, spent, "none")

    def _begin(
        self, problem: Problem, law: NeoHooke, x: Float, workspace: NewtonWorkspace
    ) -> tuple[_Place, Condensation | None]:
        """The place of unknowns x without a tangent if its body is at hand; otherwise a body to overwrite."""
        kept, workspace.last = workspace.last, None
        place, body = kept or (None, None)
        return (place if place is not None and place.x is x else _Place.at(problem, law, x, workspace)), body

    def unknowns(self, problem: Problem, state: ContactState) -> Float:
        """Kept with the state."""
        assert isinstance(state, DeformedState)
        assert state.unknowns is not None
        return state.unknowns

    def all_unknowns(self, problem: Problem, states: Sequence[ContactState]) -> Iterator[Float]:
        """Those of each state."""
        return (self.unknowns(problem, state) for state in states)

    def gauges(self, problem: Problem, state: ContactState) -> dict[str, float]:
        """Relative elongation of a line along the gauge, at its point or between its ends."""
        mesh, axes = problem.mesh, problem.axes
        u = displacement(mesh, self.unknowns(problem, state))
        return {gauge.name: gauge.finite_strain(mesh, u, axes) for gauge in problem.model.gauges}

    def gaps(
        self, problem: Problem, states: Sequence[ContactState], targets: Sequence[ObjectPose], face: BoundarySurface
    ) -> list[Float]:
        """Gap of the moved points."""
        moved = (displacement(problem.mesh, unknowns) for unknowns in self.all_unknowns(problem, states))
        return [_contact(problem, face, u, target).gap for u, target in zip(moved, targets, strict=True)]

    def fields(self, problem: Problem, state: ContactState) -> tuple[Float, Float, Float]:
        """Displacement, Green-Lagrange strain and Cauchy stress."""
        unknowns, law = self.unknowns(problem, state), self._law(problem)
        strain, cauchy = nodal_fields(problem.mesh, law, unknowns)
        return displacement(problem.mesh, unknowns), strain, cauchy


@dataclass(frozen=True)
class _Place:
    """Unknowns x (N,), the internal forces (N,) and the tangent there; no tangent if it was factored before."""

    x: Float
    inner: Float
    tangent: Stiffness | None

    @classmethod
    def at(cls, problem: Problem, law: NeoHooke, x: Float, workspace: NewtonWorkspace) -> _Place:
        """Assemble; raises InvertedError."""
        pattern, _ = workspace.places(problem)
        tangent, inner = assemble(problem.mesh, law, x, pattern, problem.thickness)
        return cls(x, inner, tangent)


@dataclass
class NewtonWorkspace(Workspace):
    """Sparsity patterns of the tangent, and the place and factor that the last increment ended with."""

    last: tuple[_Place, Condensation | None] | None = None
    _patterns: tuple[Pattern, sp.csr_matrix] | None = None

    def places(self, problem: Problem) -> tuple[Pattern, sp.csr_matrix]:
        """Where entries of the tangent and of the contact rows (r, n d) may stand: the same in all iterations."""
        if self._patterns is None:
            face, d = problem.surface, problem.dim
            beside = sp.csr_matrix((face.average != 0).astype(float) @ (face.interpolate != 0).astype(float))
            pairs = (beside.T @ beside).tocoo()
            rows = sp.kron(beside, np.ones((d, d)), format="csr")[problem.active_dofs]
            rows.sort_indices()
            linked = pairs.row.astype(np.int64), pairs.col.astype(np.int64)
            self._patterns = Pattern.of(problem.mesh, problem.elastic.mixed, linked), rows
        return self._patterns


def _factored(
    problem: Problem,
    tangent: Stiffness,
    contact: DeformedContact,
    force: Float,
    spent: Condensation | None,
    workspace: NewtonWorkspace,
) -> Condensation:
    """The body condensed at a place, under normal forces (c,) N."""
    _, places = workspace.places(problem)
    rows = sp.csr_matrix(
        (on_places(contact.rows[problem.active_dofs], places), places.indices, places.indptr), places.shape
    )
    softened = tangent.less(contact.geometric_stiffness(problem.surface, force))
    body = condense(softened, problem.fixed_dofs, rows, spent=spent)
    workspace.factorizations += body.factorizations
    return body


def _onward(problem: Problem, law: NeoHooke, place: _Place, step: Float, workspace: NewtonWorkspace) -> _Place | None:
    """The place a step further on, or as much of it as turns no cell inside out."""
    for share in _SHARES:
        try:
            return _Place.at(problem, law, place.x + share * step, workspace)
        except InvertedError:
            continue
    return None


def _moved_by(
    problem: Problem, state: ContactState, contact: DeformedContact,
    motion: tuple[Float, Float, Float | None], path: tuple[ObjectPose, ObjectPose],
) -> Float:  # fmt: skip
    """Gap and change of tangential position (c, d) of a body that moved from `before` to x, and on by `relaxed`."""
    (before, x, relaxed), (a, b) = motion, path
    n, d = problem.mesh.points.size, problem.dim
    travel = (b.displacement - a.displacement)[:d]
    there = x if relaxed is None else x + relaxed
    out = np.empty((len(contact.gap), d))
    out[:, 0] = contact.gap + (0.0 if relaxed is None else (contact.rows @ relaxed[:n])[::d])
    since = problem.surface.trace @ (there - before)[:n].reshape(-1, d) - travel
    out[:, 1:] = np.einsum("ctk,ck->ct", contact.bases[:, 1:], since)
    # the tangent across a symmetry plane does not move, whatever the half hat's mean says
    out.ravel()[np.setdiff1d(np.arange(out.size), problem.active_dofs)] = 0.0
    return out


def _violation(
    problem: Problem, place: _Place, contact: DeformedContact, found: ContactState, moved: Float,
    scales: tuple[float, float],
) -> float:  # fmt: skip
    """Largest violation at a place: of contact (lengths by a scale), equilibrium (by the largest nodal force), and
    p = K (J - 1) (in J; p by the shear modulus).  The forces' own friction law holds as the rule left it."""
    n, force = problem.mesh.points.size, found.force
    normal, length = force[:, 0], np.linalg.norm(force[:, 1:], axis=1)
    mu = length / np.where(normal > 0.0, normal, 1.0)
    astray = place.inner.copy()
    astray[:n] -= contact.rows[problem.active_dofs].T @ force.ravel()[problem.active_dofs]
    astray[problem.fixed_dofs] = 0.0
    largest = float(np.linalg.norm(force, axis=1).max()) or float(np.abs(place.inner[:n]).max()) or 1.0
    unbalanced = float(np.abs(astray[:n]).max()) / largest
    mesh = problem.mesh
    volume = np.abs(np.linalg.det(np.diff(mesh.points[mesh.cells[:, : mesh.dim + 1]], axis=1))).mean()
    volume *= problem.thickness / math.factorial(mesh.dim) * pressure_scale(mesh, scales[1])
    swollen = float(np.abs(astray[n:]).max(initial=0.0)) / volume
    return max(residual(force, moved, found.status, mu, scales[0]), unbalanced, swollen)


def _contact(problem: Problem, face: BoundarySurface, u: Float, target: ObjectPose) -> DeformedContact:
    """Contact of a face displaced by u (n, d): gaps are means over the deformed area."""
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
    normal = np.where(usable[:, None], normal, problem.points.basis[0])
    length = np.linalg.norm(normal, axis=1)
    normal = normal / length[:, None]
    vertical = level + problem.first_contact_mm - target.depth_mm - at[:, 1]
    sampled = np.where(there, vertical / length, _BESIDE * model.design.height_mm)
    axes = problem.axes
    return deformed_contact(face, (problem.mesh.points, u), (sampled, normal), axes)


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.large_deformation]: none. Neo-Hookean, W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2."""

    slot: ClassVar[str] = "formulation"

    def apply(self, model: Model) -> Model:
        """Fill the kinematics slot."""
        model.material.isotropic("effects.large_deformation")
        return fill(model, "formulation", FiniteStrain(), "large_deformation")
