"""Strain read by a foil bonded into a stretched infinite body: Prandtl's equation in the plane, graded meshes in 3D.

In the plane a foil with the axial force N obeys ``N/EA = e0 - K int N'(t)/(s - t) dt``, K = (1+nu')(3-nu')/(4 pi E'),
with E' and nu' of plane stress.  This is Prandtl's lifting-line equation, solved by its sine series (Glauert 1926).
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from finger3d._types import Float
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.fem.solvers.condense import condense, stiffened
from finger3d.fem.surface import displacement_row
from finger3d.mechanics.discretise.foils import discretised_foils
from finger3d.mechanics.model import Foils, Gauge

from ._common import box, graded, held_at, side_load

_FAR = 15.0  # half-size of the body in lengths of the foil


def wing(length: float, stiff: float, E: float, nu: float, terms: int = 200) -> float:
    """Mean strain of a foil over the free one, in plane strain; `stiff` is its E A per width, N/mm."""
    modulus, poisson = E / (1.0 - nu**2), nu / (1.0 - nu)
    kernel = (1.0 + poisson) * (3.0 - poisson) / (4.0 * math.pi * modulus)
    theta = (np.arange(terms) + 1.0) * math.pi / (terms + 1.0)
    n = np.arange(terms) + 1.0
    sine = np.sin(np.outer(theta, n))
    matrix = sine / stiff + kernel * 2.0 * math.pi / length * n * sine / np.sin(theta)[:, None]
    first = np.linalg.solve(matrix, np.ones(terms))[0]
    return float(0.25 * math.pi * first / stiff)  # mean of sum a_n sin(n theta) over s = cos(theta) length/2


def alone(length: float, foil: Foils, E: float, nu: float, dim: int) -> float:
    """The same by the product's own compliance of foils, on a mesh of one box, which has no say in it.

    A section is 1 mm wide, and the foil's width that of its share.
    """
    mesh = quadratic(box([np.array([0.0, length + foil.width_mm])] * dim))
    inlay = discretised_foils(foil, _model(length, E, nu, dim), mesh, ("x", "y", "z")[:dim])
    strain = np.linalg.solve(
        np.eye(len(inlay.bar_stiffness)) + inlay.self_compliance * inlay.bar_stiffness,
        np.ones(len(inlay.bar_stiffness)),
    )
    return float(inlay.gauge_weights[0] @ strain)


def by_mesh(length: float, foil: Foils, E: float, nu: float, dim: int, cells: int, below: float | None = None) -> float:
    """The same by a mesh alone, `cells` to half the foil and to half its width; planes are mirrors.

    `below` (mm): the foil's plane is so far under a free surface, and the body is as deep as else on its other side.
    """
    first, far = 0.5 * length / cells, _FAR * length
    thin = min(first, 0.5 * foil.width_mm / cells) if dim == 3 else first
    along, up = _axis(0.5 * length, first, far), _axis(0.0, thin, far)
    axes = ("x", "y", "z")[:dim]
    if below is not None:
        axes = ("x", "z")[: dim - 1]
        above = np.linspace(0.0, below, max(2, math.ceil(below / thin)) + 1)
        up = np.concatenate([-up[:0:-1], above])
    sides = [along, up] + ([_axis(0.5 * foil.width_mm, 0.5 * foil.width_mm / cells, far)] if dim == 3 else [])
    mesh = quadratic(box(sides))
    held = held_at(mesh, {f"{a}-": ("xyz".index(a),) for a in axes})
    if below is not None:
        held[np.flatnonzero((mesh.points[:, 0] == 0.0) & (mesh.points[:, 1] == up[0])), 1] = True
    return _read(mesh, held, length, foil, E, nu, cells, below is None)


def _axis(inner: float, first: float, far: float) -> Float:
    """Coordinates from 0: even cells a little beyond `inner`, then growing ones."""
    count = max(1, round(inner / first)) + (2 if inner else 0)
    even = first * np.arange(count + 1)
    return np.concatenate([even, even[-1] + graded(far, 1.6 * first, 1.6)[1:]])


def _model(length: float, E: float, nu: float, dim: int) -> Any:
    """As much of a model as foils ask for."""
    material = Isotropic(E, nu)
    return SimpleNamespace(
        gauges=(Gauge("g", 0.0, 0.0, 0.0, 0.0, length),), material=material, materials=lambda labels: (material,),
        domain="solid" if dim == 3 else "plane-strain", design=SimpleNamespace(width_mm=1.0),
    )  # fmt: skip


def _read(
    mesh: Mesh, held: NDArray[np.bool_], length: float, foil: Foils, E: float, nu: float, cells: int, mirrored: bool
) -> float:
    """Strain of the foil over the free one under a pull along x; three bars to a cell both ways."""
    rows, springs = _bars(mesh, length, foil, 3 * cells)
    pull = side_load(mesh, "x+", lambda p: np.eye(mesh.dim)[[0]].repeat(len(p), axis=0)).reshape(1, -1)
    mean = sparse.csr_matrix(springs / springs.sum()) @ rows
    both = sparse.vstack([sparse.csr_matrix(pull), mean, rows], format="csr")
    small = condense(stiffness(mesh, Elasticity.of(E, nu)), np.flatnonzero(held.ravel()), both).compliance
    return float(stiffened(small, springs / 2 if mirrored else springs)[1, 0] / small[1, 0])


def _bars(mesh: Mesh, length: float, foil: Foils, count: int) -> tuple[sparse.csr_matrix, Float]:
    """Strain rows and springs of even bars over the quarter x > 0, z > 0 of a foil (half of it in a plane)."""
    d = mesh.dim
    lines = count if d == 3 else 1
    width = 0.5 * foil.width_mm / lines if d == 3 else foil.width_mm
    step = 0.5 * length / count
    along = np.eye(d)[0]
    rows = []
    for z in (np.arange(lines) + 0.5) * width:
        places = [np.array([k * step, 0.0, z])[:d] for k in range(count + 1)]
        moved = [displacement_row(mesh, p, along) for p in places]
        rows += [(b - a) / step for a, b in zip(moved[:-1], moved[1:], strict=True)]
    stiff = foil.E_MPa * foil.thickness_mm * width * step
    return sparse.csr_matrix(sparse.vstack(rows, format="csr")), np.full(len(rows), stiff)
