"""Surfaces: their traces, and contact of deformed ones."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh import Mesh, quadratic, reflected, signed_volumes
from finger3d.fem.surface import (
    BoundarySurface,
    DeformedContact,
    deformed_contact,
    displacement_row,
    facing_trace,
    strain_row,
    surface,
    values_over,
)
from finger3d.geometry.design import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.swept import mesh_section
from tests.meshes import grid


@pytest.mark.parametrize("dim", [2, 3])
def test_traces_and_strains_read_a_linear_field_exactly(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))
    slope = np.random.default_rng(1).normal(size=(dim, dim))
    u = mesh.points @ slope.T
    top = surface(mesh, "y+", thickness=2.0)
    assert top.area.sum() == pytest.approx(2.0, rel=1e-13)
    centre = top.average @ top.samples  # the hat's centre of gravity, where a weighted mean of a linear field is read
    assert np.abs(top.trace @ u - centre @ slope.T).max() < 1e-13
    direction = np.eye(dim)[0] * 0.6 + np.eye(dim)[1] * 0.8
    point = np.full(dim, 1 / 3)  # on a shared facet
    assert (strain_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ direction, abs=1e-12
    )
    assert (displacement_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ point, abs=1e-12
    )


DESIGNS = designs()


def faced(dim: int) -> tuple[Mesh, Mesh]:
    """A block's mesh, and another, finer one of a round body upside down over it."""
    block = DESIGNS["block"](half_length_mm=3.0, height_mm=2.0, width_mm=4.0)
    round_ = DESIGNS["half_cylinder"](radius_mm=5.0, width_mm=4.0)
    make = mesh_solid if dim == 3 else mesh_section
    below = make(block, MeshOptions(0.7, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    above = make(round_, MeshOptions(0.45, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    return below, reflected(above, 1)


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_are_read_over_the_points_though_meshes_do_not_match(dim: int) -> None:
    below, above = faced(dim)
    assert (signed_volumes(above) > 0.0).all()
    face = surface(below, "contact")
    values, there = values_over(above, above.facets["contact"], face.samples)
    assert there.all()
    across = [0] if dim == 2 else [0, 2]
    # the place itself, curved facets included, and a linear field
    np.testing.assert_allclose(values @ above.points[:, across], face.samples[:, across], atol=1e-10)
    height = values @ above.points[:, 1]
    np.testing.assert_allclose(height, -np.sqrt(25.0 - face.samples[:, 0] ** 2), atol=1e-4)
    trace = facing_trace(face, above, "contact")
    assert np.abs(trace @ np.ones(len(above.points)) - 1.0).max() < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_reach_the_object_undiminished(dim: int) -> None:
    below, above = faced(dim)
    face = surface(below, "contact")
    trace = facing_trace(face, above, "contact")
    force = np.random.default_rng(0).normal(size=(len(face.nodes), dim))
    reached = trace.T @ force
    assert np.abs(reached.sum(axis=0) - force.sum(axis=0)).max() < 1e-10 * np.abs(force).sum()
    # and their moment, as far as samples stand for the hats
    across = np.cross(face.points, force) if dim == 3 else face.points[:, 0] * force[:, 1]
    moment = np.cross(above.points * [1, 0, 1], reached * [0, 1, 0]) if dim == 3 else above.points[:, 0] * reached[:, 1]
    samples = face.average @ face.samples
    wanted = np.cross(samples * [1, 0, 1], force * [0, 1, 0]) if dim == 3 else samples[:, 0] * force[:, 1]
    assert np.abs(moment.sum(axis=0) - wanted.sum(axis=0)).max() < 1e-9 * np.abs(across).sum()


def test_points_with_nothing_over_them_get_no_object() -> None:
    below, _ = faced(2)
    narrow = DESIGNS["half_cylinder"](radius_mm=1.0, width_mm=4.0)
    above = reflected(mesh_section(narrow, MeshOptions(0.3, 0.5), (-1.0, 1.0, -2.0, 2.0))[0], 1)
    face = surface(below, "contact")
    rows = np.asarray(facing_trace(face, above, "contact").sum(axis=1)).ravel()
    inside = np.abs(face.points[:, 0]) < 0.5
    outside = np.abs(face.points[:, 0]) > 1.5
    assert np.abs(rows[inside] - 1.0).max() < 1e-12
    assert np.abs(rows[outside]).max() == 0.0


def made(d: int) -> tuple[Mesh, BoundarySurface, np.ndarray]:
    mesh = quadratic(grid((2,) * d))
    return mesh, surface(mesh, "y+"), np.random.default_rng(d).normal(0.0, 0.05, mesh.points.shape)


def contact(mesh: Mesh, face: BoundarySurface, u: np.ndarray, share: float | None = None) -> DeformedContact:
    """With a tilted plane, whose normal does not turn; it is elastic if it has a share of the compliance."""
    normal = np.array([0.2, -1.0, 0.1])[: mesh.dim]
    normal = normal / np.linalg.norm(normal)
    at = face.samples + face.interpolate @ u
    return touched(mesh, face, u, at @ normal + 1.2, np.broadcast_to(normal, at.shape), share)


def under_ball(
    mesh: Mesh, face: BoundarySurface, u: np.ndarray, radius: float, share: float | None = None
) -> DeformedContact:
    """With a ball, whose normals turn along the face."""
    away = face.samples + face.interpolate @ u - np.array([0.4, 1.0 + radius, 0.6])[: mesh.dim]
    distance = np.linalg.norm(away, axis=1)
    return touched(mesh, face, u, distance - radius, away / distance[:, None], share)


def touched(
    mesh: Mesh, face: BoundarySurface, u: np.ndarray, gap: np.ndarray, normal: np.ndarray, share: float | None
) -> DeformedContact:
    object_share = None if share is None else np.full(len(face.nodes), share)
    return deformed_contact(face, mesh.points, u, (gap, normal), (), object_share)


@pytest.mark.parametrize("d", [2, 3])
def test_rows_are_the_derivative_of_the_gap(d: int) -> None:
    mesh, face, u = made(d)
    way = np.random.default_rng(7).normal(size=u.shape)
    h = 1e-6
    slope = (contact(mesh, face, u + h * way).gap - contact(mesh, face, u - h * way).gap) / (2 * h)
    rows = contact(mesh, face, u).rows
    assert rows[::d] @ way.ravel() == pytest.approx(slope, rel=1e-7, abs=1e-8)  # central: error h^2


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("share", [None, 0.4])
def test_displacements_are_those_along_the_rows(d: int, share: float | None) -> None:
    mesh, face, u = made(d)
    motions = np.random.default_rng(7).normal(size=(u.size, 3))
    there = contact(mesh, face, u, share=share)
    np.testing.assert_allclose(there.displacement(motions), there.rows @ motions, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_gap_rows_are_the_derivative_of_the_gap_along_a_normal_that_turns_with_the_body(d: int) -> None:
    mesh, face, u = made(d)
    random = np.random.default_rng(7)
    way, moved, h = random.normal(size=u.shape), random.normal(size=(len(face.nodes), d)), 1e-6

    def gap(u: np.ndarray) -> np.ndarray:
        there = contact(mesh, face, u, share=0.4)
        return there.gap + np.einsum("ck,ck->c", there.bases[:, 0], moved)

    slope = (gap(u + h * way) - gap(u - h * way)) / (2 * h)
    rows = contact(mesh, face, u, share=0.4).gap_rows(moved)
    assert rows @ way.ravel() == pytest.approx(slope, rel=1e-7, abs=1e-8)  # central: error h^2


@pytest.mark.parametrize("d", [2, 3])
def test_softening_is_the_derivative_of_the_rows(d: int) -> None:
    mesh, face, u = made(d)
    random = np.random.default_rng(8)
    way, force = random.normal(size=u.shape), random.uniform(0.0, 2.0, len(face.nodes))
    h = 1e-6
    ends = [contact(mesh, face, u + s * h * way).rows[::d].T @ force for s in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2 * h)
    second = contact(mesh, face, u).geometric_stiffness(force)
    assert abs(second - second.T).max() <= 1e-12 * abs(second).max()
    assert second @ way.ravel() == pytest.approx(slope, rel=1e-6, abs=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("d", [2, 3])
def test_curvature_of_the_object_is_part_of_the_derivative(d: int) -> None:
    mesh, face, u = made(d)
    radius, random = 2.0, np.random.default_rng(8)
    way, force = random.normal(size=u.shape), random.uniform(0.0, 2.0, len(face.nodes))
    here, h = under_ball(mesh, face, u, radius), 1e-6
    distance = here.samples_gap + radius
    normal = here.samples_normal
    curvature = (np.eye(d) - normal[:, :, None] * normal[:, None, :]) / distance[:, None, None]
    there = [under_ball(mesh, face, u + s * h * way, radius) for s in (1.0, -1.0)]
    ends = [end.rows[::d].T @ (force * end.slope / here.slope) for end in there]  # at a constant mean slope
    slope = (ends[0] - ends[1]) / (2 * h)
    second = here.geometric_stiffness(force, curvature)
    assert second @ way.ravel() == pytest.approx(slope, rel=1e-6, abs=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("share", [None, 0.4])
def test_nodal_forces_add_up_to_those_of_the_points_on_a_ball_smaller_than_a_hat(share: float | None) -> None:
    mesh, face, u = made(3)
    at, force = under_ball(mesh, face, u, 0.2, share), np.random.default_rng(9).normal(size=(len(face.nodes), 3))
    assert at.slope.min() < 0.9
    total = np.einsum("ca,cak->k", force, at.bases)
    assert at.nodal_forces(force).sum(axis=0) == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_a_point_on_a_symmetry_plane_between_two_walls_has_the_normal_of_an_upright_object(d: int) -> None:
    mesh, face, u = made(d)
    away = -np.sign(face.samples[:, :1]) * np.eye(d)[0]  # walls at x = -2 and 2
    at = deformed_contact(face, mesh.points, u, (2.0 + (face.samples * away).sum(axis=1), away), ("x",))
    on_plane = face.points[:, 0] == 0.0
    assert on_plane.any()
    assert at.bases[on_plane, 0] == pytest.approx(np.tile(-np.eye(d)[1], (on_plane.sum(), 1)))
    assert np.abs(at.bases[~on_plane, 0]) == pytest.approx(np.tile(np.eye(d)[0], ((~on_plane).sum(), 1)))
    assert np.isfinite(at.rows.data).all()
