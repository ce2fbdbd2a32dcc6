"""Recovered strains: exact for polynomials, and as good an estimate of the error as theory says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.fem.recovery.patch_recovery import PatchRecovery, RecoveredErrors
from finger3d.fem.solids.material import Elasticity
from tests.meshes import grid

NU = {"displacement form": 0.3, "mixed form": 0.49}


def box(dim: int, count: int) -> Mesh:
    return quadratic(grid((count,) * dim, shuffle=0.1))


def errors(mesh: Mesh, nu: float, u: np.ndarray, p: np.ndarray | None = None) -> RecoveredErrors:
    elastic = Elasticity.of(1.0, nu)
    matrix: Stiffness = stiffness(mesh, elastic, 1.0)
    unknowns = [u.ravel()] if p is None else [u.ravel(), p[mesh.vertices] / matrix.pressure_scale]
    return RecoveredErrors(PatchRecovery.of(mesh), elastic, matrix, 1.0, np.concatenate(unknowns)[:, None])


def smooth(x: np.ndarray) -> np.ndarray:
    """A divergence-free displacement in the x-y plane."""
    u = np.zeros_like(x)
    u[:, 0], u[:, 1] = np.sin(x[:, 0]) * np.cos(x[:, 1]), -np.cos(x[:, 0]) * np.sin(x[:, 1])
    return u


def strain_of_smooth(x: np.ndarray) -> np.ndarray:
    e = np.zeros((*x.shape, x.shape[-1]))
    e[..., 0, 0] = np.cos(x[..., 0]) * np.cos(x[..., 1])
    e[..., 1, 1] = -e[..., 0, 0]
    return e


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("form", NU)
def test_a_quadratic_displacement_has_no_error(dim: int, form: str) -> None:
    mesh = box(dim, 3)
    x = mesh.points
    u = np.stack([x[:, 0] ** 2 - x[:, 1] * x[:, 0], 0.3 * x[:, 1] ** 2, *[x[:, 0] * x[:, 1]] * (dim - 2)], axis=1)
    p = None
    elastic = Elasticity.of(1.0, NU[form])
    if elastic.mixed:
        p = elastic.pressure_modulus * (2.0 * x[:, 0] - x[:, 1] + 0.6 * x[:, 1])
    found = errors(mesh, NU[form], u, p).products(slice(0, 1), slice(0, 1))
    energy = float(np.linalg.norm(u) ** 2)
    assert np.abs(found).max() <= 1e-18 * energy * max(1.0, elastic.pressure_modulus**2)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_energy_of_the_error_is_estimated_to_a_few_per_cent(dim: int) -> None:
    # interpolation of a smooth field: Zienkiewicz and Zhu's estimate is asymptotically exact
    ratios = []
    for n in (4, 8) if dim == 2 else (3, 5, 7):
        mesh = box(dim, n)
        nu = 0.0
        found = errors(mesh, nu, smooth(mesh.points)).products(slice(0, 1), slice(0, 1)).sum()
        bary, weights = quadrature(dim, 6)
        nodes = mesh.points[mesh.cells]
        gradients, determinant = mesh.element.physical_gradients(nodes, bary)
        slope = np.einsum("eki,eqkj->eqij", smooth(mesh.points)[mesh.cells], gradients)
        strain = 0.5 * (slope + np.swapaxes(slope, 2, 3))
        off = strain_of_smooth(mesh.element.shape(bary) @ nodes) - strain
        exact = float((np.einsum("eqij,eqij->eq", off, off) * determinant * weights).sum())  # E = 1, nu = 0
        ratios.append(found / exact)
    assert abs(ratios[-1] - 1.0) < 0.15


def test_products_are_bilinear() -> None:
    mesh = box(2, 3)
    u = np.stack([smooth(mesh.points).ravel(), (mesh.points**3).ravel()], axis=1)
    one = errors(mesh, 0.3, smooth(mesh.points))
    both = replace(one, unknowns=np.concatenate([u, u @ [[2.0], [-1.0]]], axis=1))
    products = both.products(slice(0, 3), slice(0, 3))
    np.testing.assert_allclose(products[:, 2, :2], 2.0 * products[:, 0, :2] - products[:, 1, :2], atol=1e-15)
    np.testing.assert_allclose(products, np.swapaxes(products, 1, 2), atol=1e-15)


def test_the_error_along_a_direction_is_recovered_minus_own_strain() -> None:
    mesh = box(2, 3)
    found = errors(mesh, 0.3, smooth(mesh.points))
    bary = np.array([[0.2, 0.3, 0.5]])
    direction = np.array([0.6, 0.8])
    cells = np.array([4])
    along = found.strain_along(np.ones(1), direction, cells, bary)[0, 0]
    place = (mesh.element.shape(bary) @ mesh.points[mesh.cells[cells]])[0]
    exact = direction @ strain_of_smooth(place)[0] @ direction
    gradients, _ = mesh.element.physical_gradients(mesh.points[mesh.cells[cells]], bary)
    slope = np.einsum("ki,kj->ij", smooth(mesh.points)[mesh.cells[4]], gradients[0, 0])
    own = direction @ slope @ direction
    # the recovered strain is nearer to the exact one than the strain of the cell
    assert abs(own + along - exact) < abs(own - exact)
