"""Shape functions, quadrature and the inverse isoparametric map of every element."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.fem.mesh.elements import LINE2, LINE3, TET4, TET10, TRI3, TRI6, Element, quadrature
from tests.meshes import points_in

ELEMENTS = [LINE2, LINE3, TRI3, TRI6, TET4, TET10]


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: e.name)
def test_shape_functions_are_one_at_their_own_node_and_sum_to_one(element: Element) -> None:
    np.testing.assert_allclose(element.shape(element.nodes), np.eye(element.node_count), atol=1e-15)
    np.testing.assert_allclose(element.shape(points_in(element)).sum(axis=1), 1.0)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: e.name)
def test_gradient_is_the_difference_quotient_of_the_shape_functions(element: Element) -> None:
    bary, h = points_in(element), 1e-6
    for axis in range(element.dim):
        step = np.zeros(element.dim + 1)
        step[[0, axis + 1]] = -h, h
        slope = (element.shape(bary + step) - element.shape(bary - step)) / (2.0 * h)
        np.testing.assert_allclose(element.gradient(bary)[:, :, axis], slope, atol=1e-8)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: e.name)
def test_mirrored_nodes_keep_a_reflected_cell_positive(element: Element) -> None:
    assert element.mirrored.tolist() == element.mirrored[element.mirrored[element.mirrored]].tolist()
    nodes = element.nodes[:, 1:].copy()
    nodes[:, 0] *= -1.0
    jacobian = element.jacobians(nodes[element.mirrored][None], points_in(element))
    assert (np.linalg.det(jacobian) > 0.0).all()


@pytest.mark.parametrize("element", [TRI3, TET4, TRI6, TET10], ids=lambda e: e.name)
def test_facets_have_the_order_of_the_cell(element: Element) -> None:
    assert (element.facet.dim, element.facet.order) == (element.dim - 1, element.order)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("degree", [1, 2, 3, 5, 6])
def test_quadrature_is_exact_to_its_degree(dim: int, degree: int) -> None:
    bary, w = quadrature(dim, degree)
    # integral of a product of powers of barycentric coordinates: prod(a_i!) / (sum(a_i) + dim)!
    assert w @ bary[:, 1] ** degree == pytest.approx(math.factorial(degree) / math.factorial(degree + dim), rel=1e-12)
