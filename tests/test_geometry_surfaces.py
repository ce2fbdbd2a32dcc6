"""Triangulated surfaces: distances, defects, patches, and the tessellation of CAD."""

from __future__ import annotations

import re

import numpy as np
import pytest

from finger3d.geometry.faceted import body as faceted_body
from finger3d.geometry.faceted import coarser
from finger3d.geometry.imported import of_surface
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import crossings, mistake
from finger3d.geometry.tessellate import Freeform, ImplicitCylinder, surface_of, tessellate
from finger3d.meshing.unstructured.snap import check_closed, project
from tests.bodies import ball, box, channel
from tests.cad_cases import EXACT, body_of, faces_of
from tests.designs import FIG9, HALF

# --- triangulated surfaces: heights, closest points, signed distances, their speed, and surfaces that are no body ----


@pytest.fixture(scope="module")
def large() -> Triangles:
    """A ball of 100 000 triangles, radius 10."""
    return ball(10.0, 251, 200)


def test_height_is_exact_on_the_triangles_and_nan_beside() -> None:
    surface = ball(10.0, 12, 16)
    weight = np.random.default_rng(1).dirichlet(np.ones(3), (20, len(surface.faces)))
    at = np.einsum("ntk,tkx->ntx", weight, surface.corners)
    down = surface.normals[:, 1] < -1e-6
    found = surface.height(at[:, down, 0], at[:, down, 2])
    assert np.abs(found - at[:, down, 1]).max() < 1e-13 * 10
    up = surface.normals[:, 1] > 1e-6
    assert np.abs(surface.height(at[:, up, 0], at[:, up, 2], lowest=False) - at[:, up, 1]).max() < 1e-13 * 10
    assert np.isnan(surface.height(np.array([10.5, 0.0]), np.array([0.0, -11.0]))).all()


def test_no_line_slips_through_between_triangles() -> None:
    surface = ball(10.0, 31, 37)
    nodes = surface.points[surface.points[:, 1] < -0.1]
    edges = surface.points[surface.faces[:, [0, 1]]].mean(axis=1)
    at = np.vstack([nodes, edges[edges[:, 1] < -0.1]])
    assert np.abs(surface.height(at[:, 0], at[:, 2]) - at[:, 1]).max() < 1e-9


def test_the_lowest_of_several_surfaces_is_met() -> None:
    upside_down = channel(10.0, 4.0, 2.0, 5.0)
    x = np.array([-6.0, 0.0, 6.0])
    np.testing.assert_allclose(upside_down.height(x, 0.0 * x), [0.0, 4.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(upside_down.height(x, 0.0 * x, lowest=False), 6.0, atol=1e-14)


def test_signed_distance_of_a_box_is_exact_near_faces_edges_and_corners() -> None:
    p = np.random.default_rng(2).uniform(-4, 4, (5000, 3))
    distance, normal = box(2, 3, 4).signed_distance(p)
    q = np.abs(p) - [1.0, 1.5, 2.0]
    outside = np.maximum(q, 0.0)
    exact = np.linalg.norm(outside, axis=1) + np.minimum(q.max(axis=1), 0.0)
    assert np.abs(distance - exact).max() < 1e-13
    far = np.linalg.norm(outside, axis=1) > 1e-6
    gradient = np.sign(p) * outside / np.linalg.norm(outside, axis=1, keepdims=True).clip(1e-300)
    assert np.abs(normal - gradient)[far].max() < 1e-9
    assert np.abs(np.linalg.norm(normal, axis=1) - 1.0).max() < 1e-12


def test_inside_and_outside_at_a_vertex_where_the_nearest_triangles_normal_errs() -> None:
    # A needle: beside its tip the nearest triangle may be one that faces away (Baerentzen and Aanaes 2005).
    points = np.array([[0.0, 0.0, 0.0], [1.0, 10.0, 0.0], [-0.5, 10.0, 0.8], [-0.5, 10.0, -0.8]])
    needle = Triangles(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    assert mistake(needle) == ""
    direction = np.random.default_rng(3).normal(size=(4000, 3))
    below = direction / np.linalg.norm(direction, axis=1)[:, None] * 0.05
    below = below[below[:, 1] < -0.01]
    distance, normal = needle.signed_distance(below)
    assert (distance > 0.0).all()
    nearest_is_tip = np.einsum("ij,kj->ik", below, points[1:]).max(axis=1) < 0.0
    assert nearest_is_tip.any()
    np.testing.assert_allclose(distance[nearest_is_tip], 0.05, rtol=1e-12)
    np.testing.assert_allclose(normal[nearest_is_tip], below[nearest_is_tip] / 0.05, atol=1e-9)
    on_the_tip = needle.signed_distance(points[:1])
    assert on_the_tip[0][0] == 0.0
    assert on_the_tip[1][0, 1] < -0.9


def test_distance_agrees_with_every_triangle_tried() -> None:
    surface = ball(3.0, 9, 11)
    big = box(40.0, 1.0, 40.0, (0.0, 6.0, 0.0))
    both = Triangles(
        np.vstack([surface.points, big.points]), np.vstack([surface.faces, big.faces + len(surface.points)])
    )
    p = np.random.default_rng(4).uniform(-8, 8, (300, 3))
    near = both.closest(p)[0]
    tried = np.min(
        [np.linalg.norm(p - Triangles(both.points, f[None]).closest(p)[0], axis=1) for f in both.faces], axis=0
    )
    assert np.abs(np.linalg.norm(p - near, axis=1) - tried).max() < 1e-12


def test_ten_thousand_points_on_a_hundred_thousand_triangles(large: Triangles) -> None:
    assert len(large.faces) >= 100_000
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(10_000, 3))
    p = direction / np.linalg.norm(direction, axis=1)[:, None] * rng.uniform(9.0, 11.0, (10_000, 1))
    distance, _ = large.signed_distance(p)
    height = large.height(p[:, 0], p[:, 2])
    assert np.abs(distance - np.linalg.norm(p, axis=1) + 10.0).max() < 2e-3
    inside = np.hypot(p[:, 0], p[:, 2]) < 9.0
    assert np.abs(height + np.sqrt(np.maximum(100.0 - p[:, 0] ** 2 - p[:, 2] ** 2, 0.0)))[inside].max() < 5e-3


# --- what keeps a surface from being a body --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("spoilt", "text"),
    [
        (lambda p, f: (p, f[1:]), "closed: 3"),
        (
            lambda p, f: (p, np.vstack([f[:1, ::-1], f[1:]])),
            "flipped",
        ),
        (lambda p, f: (p, f[:, ::-1]), "inside"),
        (lambda p, f: (p * [1, 0, 1], f), "flat"),
        (lambda p, f: (0 * p, f), "volume"),
        (lambda p, f: (np.where(np.arange(8)[:, None] == 3, np.nan, p), f), "number"),
        (lambda p, f: (np.where(np.arange(8)[:, None] == 3, np.inf, p), f), "number"),
        (lambda p, f: (np.vstack([p, p + 9]), np.vstack([f, f + 8])), "2 pieces"),
        (lambda p, f: (np.vstack([p, 0.5 * p]), np.vstack([f, f[:, ::-1] + 8])), "2 .*hollow"),
        (lambda p, f: (p, np.vstack([f, f[:2]])), "5 edges"),
        (lambda p, f: (p, f[:3]), "has 3 triangles"),
    ],
    ids=["hole", "flipped", "inward", "flat", "a point", "nan", "inf", "two", "hollow", "twice", "three"],
)
def test_what_keeps_a_surface_from_being_a_body(spoilt, text: str) -> None:
    cube = box(2, 2, 2)
    reason = mistake(Triangles(*spoilt(cube.points, cube.faces)))
    assert re.search(text, reason)
    assert "\n" not in reason


def test_a_surface_that_runs_through_itself_is_noticed() -> None:
    cube = box(2, 2, 2)
    assert not len(crossings(cube))
    assert not len(crossings(ball(3.0, 12, 16)))
    other = box(2, 2, 2, (1.0, 0.9, 1.1))
    both = Triangles(np.vstack([cube.points, other.points]), np.vstack([cube.faces, other.faces + 8]))
    assert len(crossings(both)) >= 4


# --- the bounding volume hierarchy finds what a comparison with every triangle finds ---------------------------------


# --- bodies of triangles: labels, and coarser triangles for the mesher -----------------------------------------------


def test_texture_is_taken_together_by_label() -> None:
    x, z = np.meshgrid(np.linspace(-5, 5, 61), np.linspace(-5, 5, 61), indexing="ij")
    bumps = 3.0 + 0.8 * np.maximum(0.0, np.sin(8.0 * x) * np.sin(8.0 * z))
    surface = height_field(x, z, bumps)
    assert mistake(surface) == ""
    body = faceted_body(of_surface(surface, "texture").surface)
    assert {f.label for f in body.faces} <= {"base", "contact", "ends", "walls"}
    assert len(body.faces) <= 150


def height_field(x: np.ndarray, z: np.ndarray, y: np.ndarray) -> Triangles:
    """A closed body under a height field (n, m)."""
    n, m = x.shape
    top = np.stack([x, y, z], axis=2).reshape(-1, 3)
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (number[i : n - 1 + i, j : m - 1 + j].ravel() for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))
    up = np.vstack([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    after = np.roll(rim, -1)
    skirt = np.vstack(
        [np.stack([rim, after, after + n * m], axis=1), np.stack([rim, after + n * m, rim + n * m], axis=1)]
    )
    return Triangles(np.vstack([top, top * [1.0, 0.0, 1.0]]), np.vstack([up, up[:, ::-1] + n * m, skirt]))


def test_fine_triangles_are_coarsened_for_the_mesher_only() -> None:
    half = ball(8.0, 80, 160)
    keep = half.corners[:, :, 1].max(axis=1) <= 1e-9
    rim = np.flatnonzero(np.abs(half.points[:, 1]) < 1e-9)
    rim = rim[np.argsort(np.arctan2(half.points[rim, 2], half.points[rim, 0]))]
    points = np.vstack([half.points, [[0.0, 0.0, 0.0]]])
    lid = np.stack([np.full(len(rim), len(half.points)), np.roll(rim, -1), rim], axis=1)
    bowl = of_surface(Triangles(points, np.vstack([half.faces[keep], lid])), "bowl", upside_down=True)
    body = faceted_body(bowl.surface)
    less = coarser(body, 2e-4)
    assert len(less.triangles) < 0.6 * len(body.triangles)
    found = Triangles(less.points, less.triangles)
    assert mistake(found) == ""
    assert np.abs(bowl.surface.signed_distance(found.corners.mean(axis=1))[0]).max() < 0.02
    assert less.faces is body.faces
    assert set(less.labels) == {"base", "contact"}


# --- implicit surfaces -----------------------------------------------------------------------------------------------


def test_free_form_surfaces_are_reached_by_projection() -> None:
    from build123d import Face, Vector

    # A patch of a cylinder through points, so that CAD knows it as a free form only.
    angles = np.linspace(-0.6, 0.6, 9)
    rows = [[(5 * np.sin(a), 5 * np.cos(a), z) for z in (-2.0, 0.0, 2.0, 4.0)] for a in angles]
    face = Face.make_surface_from_array_of_points([[Vector(*map(float, p)) for p in row] for row in rows], tol=1e-6)
    surface = surface_of(face)
    assert isinstance(surface, Freeform)
    points = np.array([[0.5, 5.3, 0.2], [-1.0, 4.6, 1.0]])
    distance, normal = surface.distance(points)
    exact, out = ImplicitCylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0).distance(points)
    np.testing.assert_allclose(np.abs(distance), np.abs(exact), atol=1e-4)
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", normal, out)), 1.0, atol=1e-4)
    moved, _ = project(points, np.ones((2, 1), dtype=bool), faces_of(surface))
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), 5.0, atol=1e-4)


# --- triangulated CAD faces ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tolerance", "volume_error"), [(0.1, 1e-3), (0.01, 1e-4), (1e-3, 1e-5)]
)  # measured on this body: 7e-4, 7.5e-5, 7.6e-6
def test_tessellation_is_closed_and_as_fine_as_asked(tolerance: float, volume_error: float) -> None:
    solid = FIG9.solid()
    body = tessellate(solid, tolerance, exact=EXACT)
    check_closed(body.triangles)
    assert 0.2 * volume_error < 1.0 - body.volume_mm3 / FIG9.volume_mm3 < volume_error
    # The triangulation kept on the shape must not be handed out again.
    assert len(tessellate(solid, 10.0 * tolerance).triangles) < len(body.triangles)
    assert len(body.corners) == 8
    assert {len(f) for f in body.corner_faces} == {3}


def test_every_triangle_lies_on_its_labelled_face() -> None:
    body = body_of(HALF, ("x",), 1e-3)
    assert sorted(f.label for f in body.faces) == ["base", "contact", "ends", "ends", "symmetry_x"]
    middle = body.points[body.triangles].mean(axis=1)
    for i, face in enumerate(body.faces):
        assert np.abs(face.surface.distance(middle[body.face == i])[0]).max() < 2e-3
    assert set(body.labels) == {"base", "contact", "ends", "symmetry_x"}
    assert body.labels.count("base") == 2
