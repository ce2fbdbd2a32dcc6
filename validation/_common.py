"""Tools of element and contact studies: graded boxes, consistent loads, full solutions, error norms, rates, axes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import roots_jacobi

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import SLIP, Coulomb
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh, boundary, quadratic, signed_volumes
from finger3d.fem.solvers.condense import Condensation, condense
from finger3d.fem.surface import BoundarySurface, local_rows, restrict, surface
from finger3d.mechanics.discretise.contact_points import contact_geometry
from finger3d.mechanics.discretise.problem import Problem, scatter_to_points
from finger3d.objects import ObjectPose, vertical_frame

Field = Callable[[Float], Float]

_DEGREE = 6  # integrates the square of a quadratic element's error, which is cubic, exactly


@cache
def product_rule(dim: int, degree: int) -> tuple[Float, Float]:
    """Barycentric points (q, dim + 1) and weights (q,) that sum to the reference simplex's volume 1/dim!.

    A Gauss-Jacobi product on the collapsed square or cube (Stroud 1971): positive weights, but not symmetric.
    """
    order = degree // 2 + 1
    rules = []
    for axis in range(dim):
        x, w = roots_jacobi(order, dim - 1 - axis, 0.0)
        rules.append(((x + 1.0) / 2.0, w / 2.0 ** (dim - axis)))
    grids = np.meshgrid(*[r[0] for r in rules], indexing="ij")
    weights = np.meshgrid(*[r[1] for r in rules], indexing="ij")
    coordinates, rest = [], np.ones(order**dim)
    for g in grids:
        coordinates.append(rest * g.ravel())
        rest = rest * (1.0 - g.ravel())
    return np.stack([rest, *coordinates], axis=1), np.prod([w.ravel() for w in weights], axis=0)


def graded(length: float, first: float, growth: float) -> Float:
    """Coordinates (n + 1,) from 0 to `length`, the first step near `first`, each next one `growth` times longer."""
    if growth == 1.0:
        return np.linspace(0.0, length, max(1, round(length / first)) + 1)
    count = max(1, round(np.log1p(length * (growth - 1.0) / first) / np.log(growth)))
    steps = growth ** np.arange(count)
    return np.concatenate([[0.0], np.cumsum(steps) * length / steps.sum()])


def halved(coordinates: Float) -> Float:
    """Coordinates with a new one in every middle: the nested refinement."""
    middle = 0.5 * (coordinates[1:] + coordinates[:-1])
    return np.insert(coordinates, np.arange(1, len(coordinates)), middle)


def box(axes: Sequence[Float]) -> Mesh:
    """Linear Kuhn mesh of a box with the given coordinates along each axis; sides labelled x-, x+, y-, ..."""
    d = len(axes)
    counts = [len(a) - 1 for a in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, d)
    strides = np.array([np.prod([n + 1 for n in counts[i + 1 :]]) for i in range(d)], dtype=np.int64)
    low = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, d) @ strides
    paths = [np.concatenate([[0], np.cumsum(strides[list(p)])]) for p in itertools.permutations(range(d))]
    cells = np.vstack([low[:, None] + p for p in paths])
    turned = signed_volumes(Mesh(points, cells, {})) < 0
    cells[turned] = cells[turned][:, [1, 0, *range(2, d + 1)]]
    outer = boundary(cells, d)
    facets = {}
    for axis, (sign, at) in itertools.product(range(d), (("-", 0), ("+", -1))):
        facets["xyz"[axis] + sign] = outer[np.all(points[outer][:, :, axis] == axes[axis][at], axis=1)]
    return Mesh(points, cells, facets)


def cube(dim: int, count: int) -> Mesh:
    """Linear mesh of the unit square or cube, `count` cells along each side."""
    return box([np.linspace(0.0, 1.0, count + 1)] * dim)


def shuffled(mesh: Mesh, share: float, seed: int = 0) -> Mesh:
    """The mesh with its inner vertices moved at random by up to a share of the cells' size (cells all alike)."""
    step = np.ptp(mesh.points[mesh.cells[0]], axis=0)
    inside = np.ones(len(mesh.points), dtype=bool)
    inside[nodes_of(mesh)] = False
    moves = np.random.default_rng(seed).uniform(-share, share, mesh.points.shape) * step
    return Mesh(mesh.points + moves * inside[:, None], mesh.cells, mesh.facets)


def mapped(mesh: Mesh, function: Field) -> Mesh:
    """Quadratic mesh with all its nodes moved by a function of the points (n, d)."""
    whole = mesh if mesh.element.is_quadratic else quadratic(mesh)
    return Mesh(function(whole.points), whole.cells, whole.facets)


def nodes_of(mesh: Mesh, *labels: str) -> NDArray[np.int64]:
    """Nodes of some sides, of all if none is named."""
    return np.unique(np.concatenate([f.ravel() for k, f in mesh.facets.items() if not labels or k in labels]))


def held_at(mesh: Mesh, sides: Mapping[str, Sequence[int]]) -> NDArray[np.bool_]:
    """Mask (n, d) of the components that are held, from side -> axes."""
    held = np.zeros(mesh.points.shape, dtype=bool)
    for side, axes in sides.items():
        held[np.ix_(nodes_of(mesh, side), list(axes))] = True
    return held


def body_load(mesh: Mesh, force: Field) -> Float:
    """Consistent nodal loads (n, d) N of a body force (q, d) N/mm3 at points (q, d)."""
    bary, w = product_rule(mesh.dim, _DEGREE)
    _, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    psi = mesh.element.shape(bary)
    at = np.einsum("qk,ekd->eqd", psi, mesh.points[mesh.cells])
    value = force(at.reshape(-1, mesh.dim)).reshape(at.shape)
    load = np.zeros_like(mesh.points)
    np.add.at(load, mesh.cells, np.einsum("eq,qk,eqd->ekd", det * w, psi, value))
    return load


def side_load(mesh: Mesh, label: str, traction: Field) -> Float:
    """Consistent nodal loads (n, d) N of a traction (q, d) MPa at points (q, d) of a side."""
    facets = mesh.facets[label]
    bary, w = product_rule(mesh.dim - 1, _DEGREE)
    weights = mesh.facet_element.surface_measure(mesh.points[facets], bary) * w
    psi = mesh.facet_element.shape(bary)
    at = np.einsum("qk,mkd->mqd", psi, mesh.points[facets])
    value = traction(at.reshape(-1, mesh.dim)).reshape(at.shape)
    load = np.zeros_like(mesh.points)
    np.add.at(load, facets, np.einsum("mq,qk,mqd->mkd", weights, psi, value))
    return load


@dataclass(frozen=True)
class Solution:
    """Displacements (n, d) mm, vertex pressures (n,) MPa of the mixed form, else 0, and reactions (n, d) N."""

    u: Float
    pressure: Float
    reaction: Float


def solve(
    mesh: Mesh, elastic: Elasticity, held: NDArray[np.bool_], value: Float | float = 0.0, load: Float | float = 0.0
) -> Solution:
    """Solve a body with nodal values prescribed where `held` (n, d), by the product's assembly and factorisation."""
    matrix = stiffness(mesh, elastic)
    upper = matrix.upper
    whole = upper + sparse.triu(upper, 1).T
    known = np.zeros(upper.shape[0])
    known[: mesh.points.size] = np.where(held, value, 0.0).ravel()
    outer = np.zeros(upper.shape[0])
    outer[: mesh.points.size] = np.broadcast_to(load, mesh.points.shape).ravel()
    right = sparse.csr_matrix((outer - whole @ known)[None])
    x = known + condense(matrix, np.flatnonzero(held.ravel()), right).unknowns(np.ones(1))
    pressure = np.zeros(len(mesh.points))
    pressure[matrix.pressure_vertices] = matrix.pressure_scale * x[mesh.points.size :]
    n = mesh.points.size
    return Solution(x[:n].reshape(held.shape), pressure, (whole @ x - outer)[:n].reshape(held.shape))


def error_norms(mesh: Mesh, u: Float, exact: Field, slope: Field) -> tuple[float, float]:
    """L2 norms of the error of u (n, d) and of its gradient; `slope` gives (q, d, d), first index the component."""
    bary, w = product_rule(mesh.dim, _DEGREE)
    gradients, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    psi = mesh.element.shape(bary)
    d = mesh.dim
    at = np.einsum("qk,ekd->eqd", psi, mesh.points[mesh.cells]).reshape(-1, d)
    value = np.einsum("qk,ekd->eqd", psi, u[mesh.cells]).reshape(-1, d)
    steep = np.einsum("ekj,eqki->eqji", u[mesh.cells], gradients, optimize=True).reshape(-1, d, d)
    weight = (det * w).ravel()
    return (
        float(np.sqrt(weight @ np.sum((value - exact(at)) ** 2, axis=1))),
        float(np.sqrt(weight @ np.sum((steep - slope(at)) ** 2, axis=(1, 2)))),
    )


def pressure_error(mesh: Mesh, pressure: Float, exact: Field) -> float:
    """L2 norm of the error of vertex pressures (n,), linear over each cell; `exact` gives (q,)."""
    bary, w = product_rule(mesh.dim, _DEGREE)
    _, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    at = np.einsum("qk,ekd->eqd", mesh.element.shape(bary), mesh.points[mesh.cells])
    value = pressure[mesh.cells[:, : mesh.dim + 1]] @ bary.T
    return float(np.sqrt(np.sum(det * w * (value - exact(at.reshape(-1, mesh.dim)).reshape(value.shape)) ** 2)))


def increment(start: ContactState, free: Float, compliance: Float, mu: float, scale: float) -> ContactSolution:
    """Solve one increment under Coulomb friction; `scale` (mm) is the length of the criterion of convergence."""
    return solve_increment(ContactProblem.of(start, free, compliance, Coulomb(mu), scale))


def marched(
    gap: Float, compliance: Float, mu: float, path: Iterable[tuple[float, float]], least: float = 0.0
) -> Iterator[tuple[ContactSolution, float]]:
    """Solutions, and energy lost so far (mJ), through (depth, slide along the first tangent), mm, from a gap (c,).

    Parameters
    ----------
    least : smallest length of the criterion of convergence, which else is the depth, mm
    """
    d, lost = compliance.shape[1], 0.0
    state = ContactState.at_rest(gap, d)
    for depth, slide in path:
        free = np.zeros((len(gap), d))
        free[:, 0], free[:, 1] = gap - depth, -slide
        found = increment(state, free, compliance, mu, max(depth, least))
        if not found.outcome.ok:
            raise AssertionError(f"mu = {mu:g}, depth {depth:g}, slide {slide:g}: {found.outcome}")
        slips, before, state = found.state.status == SLIP, state, found.state
        lost -= float((state.force[:, 1:] * (state.accumulated_slip - before.accumulated_slip))[slips].sum())
        yield found, lost


@dataclass(frozen=True)
class Body:
    """A body condensed to the contact points of one side, in the vertical frame.

    Attributes
    ----------
    dofs : (r,) components of the points that may move, to which the body is condensed
    """

    mesh: Mesh
    elastic: Elasticity
    stiffness: Stiffness
    surface: BoundarySurface
    dofs: NDArray[np.int64]
    condensed: Condensation

    @cached_property
    def compliance(self) -> Float:
        """Displacements (c, d) mm of the points per unit force (c, d) N: (c, d, c, d)."""
        return scatter_to_points(self.condensed.compliance, self.dofs, *self.surface.points.shape)

    def normal_force(self, gap: Float) -> Float:
        """Normal forces (c,) N under a rigid gap (c,) mm at rest without friction, negative where the object would
        overlap; NaN if that does not settle."""
        d = self.compliance.shape[1]
        start, free = ContactState.at_rest(np.maximum(gap, 0.0), d), np.zeros((len(gap), d))
        free[:, 0] = gap
        found = increment(start, free, self.compliance, 0.0, float(-gap.min()))
        return found.state.force[:, 0] if found.outcome.ok else np.full(len(gap), np.nan)

    def gap(self, height: Field) -> Float:
        """Weighted mean (c,) of a height above the surface, given at points (q, d)."""
        return np.asarray(self.surface.average @ height(self.surface.samples))


def body(
    mesh: Mesh,
    elastic: Elasticity,
    held: NDArray[np.bool_],
    label: str,
    keep: Callable[[Float], Any] = lambda points: np.ones(len(points), dtype=bool),
    solver: str | None = None,
) -> Body:
    """Condense to the points of a side where `keep` of their places (c, d) holds; normal -y."""
    face = surface(mesh, label)
    face = restrict(face, keep(face.points))
    rows = local_rows(face, vertical_frame(mesh.dim))
    matrix = stiffness(mesh, elastic)
    # a direction held at a point (a symmetry plane) cannot move: it is left out of the condensation
    dofs = np.flatnonzero(~held[face.nodes][:, [1, 0, 2][: mesh.dim]].ravel())
    small = condense(matrix, np.flatnonzero(held.ravel()), rows[dofs], solver)
    return Body(mesh, elastic, matrix, face, dofs, small)


def ellipse(x: Float, p: Float, reach: float) -> tuple[float, float]:
    """Half-width (mm; NaN if p does not fall) and peak (MPa) of Hertz's pressure by the line of p^2 over x^2 within
    |x| < `reach`.
    """
    inner = np.abs(x) < reach
    slope, top = np.polyfit(x[inner] ** 2, p[inner] ** 2, 1)
    return float(np.sqrt(-top / slope)) if slope < 0.0 else np.nan, float(np.sqrt(top))


def ellipse_error(x: Float, p: Float, a: float, peak: float) -> float:
    """L2 norm of the error of nodal pressures p (n,) at ascending x (n,) over that of the ellipse of half-width a."""
    fine = np.linspace(0.0, 1.3 * a, 8001)
    return distance(np.interp(fine, x, p), peak * np.sqrt(np.maximum(0.0, 1.0 - (fine / a) ** 2)))


def distance(got: Float, wanted: Float) -> float:
    """L2 norm of a difference at equidistant places over that of what is wanted."""
    return float(np.sqrt(np.sum((got - wanted) ** 2) / np.sum(wanted**2)))


def rate(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of the least-squares line through log(error) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


def convergence(
    axes: Any, sizes: Sequence[float], curves: Mapping[str, Sequence[float]], slope: float, xlabel: str, ylabel: str
) -> None:
    """Draw measured errors as solid points over the size, log-log, and a dashed line of the theoretical slope."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

    sizes = np.asarray(sizes, dtype=float)
    for (label, errors), marker in zip(curves.items(), itertools.cycle("osD^v")):
        axes.loglog(sizes, np.abs(errors), marker + "-", label=label, markersize=4.5)
    last = max(abs(errors[int(np.argmin(sizes))]) for errors in curves.values())
    axes.loglog(
        sizes,
        1.6 * last * (sizes / sizes.min()) ** slope,  # type: ignore[attr-defined]
        "k--",
        linewidth=1.0,
        label=f"slope {slope:.3g} (theory)",
    )
    axes.xaxis.set_major_locator(FixedLocator(list(sizes)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel=xlabel, ylabel=ylabel)


def ticks_at(axes: Any, places: Sequence[float]) -> None:
    """Put ticks on a logarithmic x axis at these places alone."""
    axes.set_xticks(places, [f"{place:g}" for place in places])
    axes.set_xticks([], minor=True)


def contact_axis(a: float, count: int, length: float, growth: float = 1.6) -> Float:
    """Coordinates from 0: steps a/count until a little beyond a, then growing to `length`."""
    step = a / count
    fine = np.arange(int(np.ceil(1.1 * count)) + 1) * step
    return np.concatenate([fine, fine[-1] + graded(length - fine[-1], step * growth, growth)[1:]])


def quarter_block(x: Float, depths: Float, nu: float, reach: float, plane: Sequence[int] = (0,)) -> Body:
    """Quarter of a square block on a fixed base, E = 1 MPa: coordinates along x and z, and depths from the top.

    Parameters
    ----------
    reach : largest distance of the contact points from the middle, mm
    plane : components that are held at x = 0
    """
    mesh = quadratic(box([x, depths[-1] - depths[::-1], x]))
    held = held_at(mesh, {"x-": plane, "z-": [2], "y-": [0, 1, 2]})
    return body(mesh, Elasticity.of(1.0, nu), held, "y+", lambda p: np.hypot(p[:, 0], p[:, 2]) < reach)


def ball_numbers(quarter: Body, force: Float, radius: float, modulus: float) -> tuple[float, float, float]:
    """Force (N) of a ball on the whole body, contact radius (mm) by the second moment of the pressure, and the L2 error
    of the pressure over that of Hertz at the same force, from the normal forces (c,) on a quarter."""
    square = quarter.gap(lambda p: p[:, 0] ** 2 + p[:, 2] ** 2)
    whole, area = 4.0 * force.sum(), quarter.surface.area
    a = (0.75 * whole * radius / modulus) ** (1.0 / 3.0)
    inside = np.maximum(0.0, 1.0 - (quarter.surface.points[:, [0, 2]] ** 2).sum(axis=1) / a**2)
    hertz = 1.5 * whole / (np.pi * a**2) * np.sqrt(inside)
    away = np.sqrt(area @ (force / area - hertz) ** 2 / (area @ hertz**2))
    return float(whole), float(np.sqrt(2.5 * (force @ square) / force.sum())), float(away)


def free_motion(problem: Problem, target: ObjectPose) -> Float:
    """Gap and tangential displacement (c, d), mm, of every point relative to a plane under no contact force."""
    geometry = contact_geometry(problem.placed(target).distance, problem.surface, axes=problem.axes)
    out = -(geometry.bases @ target.displacement[: problem.dim])
    out[:, 0] = geometry.gap
    return out
