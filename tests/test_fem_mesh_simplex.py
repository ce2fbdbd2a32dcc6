"""Simplex meshes: facets, mid-edge nodes, mirror images."""

from dataclasses import replace

import numpy as np
import pytest

from finger3d.fem.mesh.elements import EDGES, TET4
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh, boundary, quadratic, reflected, signed_volumes, unfold

TRIANGLE = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]), {})
TET = Mesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]), {})


def _labelled(mesh: Mesh) -> Mesh:
    """Facets on x = 0 and z = 0 as symmetry planes, the others as walls."""
    facets = boundary(mesh.cells, mesh.dim)
    at = mesh.points[facets]
    on_x = (at[..., 0] == 0.0).all(axis=1)
    on_z = (at[..., -1] == 0.0).all(axis=1) & ~on_x if mesh.dim == 3 else np.zeros_like(on_x)
    named = {"symmetry_x": facets[on_x], "symmetry_z": facets[on_z], "walls": facets[~on_x & ~on_z]}
    return Mesh(mesh.points, mesh.cells, named)


@pytest.mark.parametrize("mesh", [TRIANGLE, TET], ids=["triangle", "tet"])
def test_boundary_facets_look_outward(mesh: Mesh) -> None:
    facets = mesh.points[boundary(mesh.cells, mesh.dim)]
    assert len(facets) == mesh.dim + 1
    centre = mesh.points.mean(axis=0)
    for f in facets:
        edges = f[1:] - f[:1]
        normal = np.array([edges[0, 1], -edges[0, 0]]) if mesh.dim == 2 else np.cross(*edges)
        assert normal @ (f.mean(axis=0) - centre) > 0.0


def test_inner_facets_are_no_boundary() -> None:
    cells = np.array([[0, 1, 2], [1, 3, 2]])
    assert {tuple(sorted(f)) for f in boundary(cells, 2).tolist()} == {(0, 1), (0, 2), (1, 3), (2, 3)}


@pytest.mark.parametrize("mesh", [TRIANGLE, TET], ids=["triangle", "tet"])
def test_quadratic_puts_nodes_in_the_middle_of_edges_and_facets_share_them(mesh: Mesh) -> None:
    fine = quadratic(_labelled(mesh))
    d = mesh.dim
    middle = fine.points[fine.cells[0, EDGES[d]]].mean(axis=1)
    np.testing.assert_allclose(fine.points[fine.cells[0, d + 1 :]], middle, atol=1e-15)
    for facets in fine.facets.values():
        np.testing.assert_allclose(fine.points[facets[:, d:]], fine.points[facets[:, EDGES[d - 1]]].mean(axis=2))
    assert curved_volume(fine) == pytest.approx(signed_volumes(mesh).sum(), rel=1e-14)
    np.testing.assert_array_equal(fine.vertices, np.arange(d + 1))


@pytest.mark.parametrize("linear", [True, False], ids=["linear", "quadratic"])
@pytest.mark.parametrize(("mesh", "axes"), [(TRIANGLE, (0,)), (TET, (0,)), (TET, (2,)), (TET, (0, 2))])
def test_unfolded_cells_are_positive_and_facets_are_the_whole_boundary(
    mesh: Mesh, axes: tuple[int, ...], linear: bool
) -> None:
    part = _labelled(mesh) if linear else quadratic(_labelled(mesh))
    whole, parent, sign = unfold(part, axes)
    d = mesh.dim
    assert (signed_volumes(whole) > 0.0).all()
    assert signed_volumes(whole).sum() == pytest.approx(2 ** len(axes) * signed_volumes(mesh).sum(), rel=1e-14)
    np.testing.assert_array_equal(whole.points, part.points[parent] * sign)
    outer = {tuple(f) for f in np.sort(boundary(whole.cells[:, : d + 1], d), axis=1).tolist()}
    listed = [tuple(f) for facets in whole.facets.values() for f in np.sort(facets[:, :d], axis=1).tolist()]
    assert len(listed) == len(set(listed))
    assert set(listed) == outer


def test_unfolded_mid_edge_nodes_stay_in_the_middle_of_their_edges() -> None:
    whole = unfold(quadratic(_labelled(TET)), (0, 2))[0]
    np.testing.assert_allclose(whole.points[whole.cells[:, 4:]], whole.points[whole.cells[:, TET4.edges]].mean(axis=2))


@pytest.mark.parametrize("axes", [(0,), (0, 2)])
def test_cells_keep_their_part_in_quadratic_and_unfolded_meshes(axes: tuple[int, ...]) -> None:
    cube = replace(_labelled(TET), part=np.array([1]), part_labels=("core",))
    whole, _, _ = unfold(quadratic(cube), axes)
    assert whole.part_labels == ("core",)
    np.testing.assert_array_equal(whole.part, np.ones(2 ** len(axes)))
    np.testing.assert_array_equal(reflected(cube, 0).part, [1])
