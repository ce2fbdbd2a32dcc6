"""Solids, bodies, plane regions and booleans of triangles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection

from finger3d.errors import Finger3dError
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mold import regions
from finger3d.mold.body import Body, shell
from finger3d.mold.solids import Feature, between, common, cone, cylinder, hexagon, one, part
from tests.bodies import box
from tests.mold_cases import BODIES

# --- solids and features of molds ------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", ["y", "z", "-z"])
def test_solids_start_at_their_point_and_run_along_their_axis(axis) -> None:
    sign, i = (-1.0 if axis.startswith("-") else 1.0), "xyz".index(axis[-1])
    for solid in (
        cylinder((1.0, 2.0, 3.0), 2.0, 5.0, axis),
        cone((1.0, 2.0, 3.0), 2.0, 1.0, 5.0, axis),
        hexagon((1.0, 2.0, 3.0), 2.0, 5.0, axis),
    ):
        box = solid.bounding_box()
        low, high = [*box.min][i], [*box.max][i]
        start, end = (low, high) if sign > 0 else (high, low)
        assert start == pytest.approx((1.0, 2.0, 3.0)[i], abs=1e-6)
        assert end - start == pytest.approx(5.0 * sign, abs=1e-6)


def test_volumes() -> None:
    assert cone((0, 0, 0), 4.0, 2.0, 3.0, "y").volume == pytest.approx(math.pi * (4.0 + 2.0 + 1.0))
    assert hexagon((0, 0, 0), 2.0, 1.0, "z").volume == pytest.approx(2.0 * math.sqrt(3.0))
    assert common(between((0, 0, 0), (2, 2, 2)), between((1, 1, 1), (3, 3, 3))) == pytest.approx(1.0)
    assert common(between((0, 0, 0), (1, 1, 1)), between((2, 2, 2), (3, 3, 3))) == 0.0


def test_pieces_are_refused() -> None:
    with pytest.raises(Finger3dError, match="lid.*2 pieces"):
        one(between((0, 0, 0), (1, 1, 1)) + between((2, 2, 2), (3, 3, 3)), "lid")


def test_a_part_has_what_features_add_and_lacks_what_they_cut() -> None:
    """Cuts come last, and other parts' features do nothing."""
    a, b = between((1, 0, 0), (3, 1, 1)), between((2, 0, 0), (4, 1, 1))
    features = [Feature(cut={"lid": [b]}), Feature(add={"lid": [a]}, cut={"half_a": [a]})]
    made = part("lid", between((0, 0, 0), (1, 1, 1)), features, "lid_skin")
    assert made.volume == pytest.approx(2.0)
    assert part("half_b", b, features, "half_b").volume == pytest.approx(2.0)


# --- bodies of CAD and of triangles, and triangulated solids ---------------------------------------------------------


def test_the_tolerance_is_absolute(paper_finger) -> None:
    """Sag of a chord on R = 100 at most what was asked: every edge's middle is that near to the arc."""
    for tolerance in (0.05, 0.005):
        surface = shell(paper_finger.solid(), tolerance, "finger").surface
        middle = 0.5 * (surface.corners + np.roll(surface.corners, -1, axis=1)).reshape(-1, 3)
        centre = paper_finger.height_mm - 100.0
        arc = middle[:, 1] > 36.6 + 1e-6
        top = np.abs(middle[arc, 0]) < 50.0 - 1e-6
        sag = 100.0 - np.hypot(middle[arc, 0], middle[arc, 1] - centre)[top & (np.abs(middle[arc, 2]) > 9.999)]
        assert 0.2 * tolerance < sag.max() <= tolerance


@pytest.mark.parametrize("cad", [True, False])
def test_a_body_is_scaled_and_turned(cad) -> None:
    solid = between((-1.0, 0.0, -3.0), (1.0, 4.0, 3.0))
    body = Body.of(solid if cad else box(2.0, 4.0, 6.0, (0.0, 2.0, 0.0)), 0.1)
    found = body.scaled(2.0).opening_along_z("x")
    np.testing.assert_allclose(found.box[0], [-6.0, 0.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(found.box[1], [6.0, 8.0, 2.0], atol=1e-6)
    np.testing.assert_allclose(found.surface.low, found.box[0], atol=1e-6)
    assert found.volume_mm3 == pytest.approx(8.0 * 48.0)
    assert found.surface.volume == pytest.approx(8.0 * 48.0)
    # x of the body has become z, and not -z
    mark = Body.of(between((0.5, 0.0, 0.0), (1.0, 1.0, 1.0)), 0.1).opening_along_z("x")
    assert mark.box[0][2] == pytest.approx(0.5)
    assert mark.surface.low[2] == pytest.approx(0.5)


@pytest.mark.parametrize("cad", [True, False])
def test_shared_volumes(cad) -> None:
    body = Body.of(between((0, 0, 0), (2, 2, 2)) if cad else box(2.0, 2.0, 2.0, (1.0, 1.0, 1.0)), 0.1)
    assert body.shared(between((1, 1, 1), (3, 3, 3))) == pytest.approx(1.0)


def test_a_body_of_triangles_is_cut_from_a_part() -> None:
    ball = Body(shell(designs()["hemisphere"](**BODIES["hemisphere"]).solid(), 0.01, "ball").surface, None)
    block = shell(between((-10, 0, -10), (10, 10, 10)), 0.1, "block")
    assert ball.cut_from(block).surface.volume == pytest.approx(4000.0 - ball.volume_mm3, rel=1e-6)


# --- plane regions and booleans of triangles -------------------------------------------------------------------------


def test_the_base_is_x_and_z() -> None:
    x0, z0, x1, z1 = regions.base_region(box(2.0, 4.0, 6.0, (1.0, 0.0, 0.0))).bounds()
    assert (x0, x1, z0, z1) == pytest.approx((0.0, 2.0, -3.0, 3.0))


def test_a_widened_rectangle_has_round_corners() -> None:
    """Steiner's formula: area + perimeter d + pi d^2; chords lie up to 0.08 mm inside the 12.6 mm of arcs, 1 %."""
    found = regions.widened(CrossSection.square((10.0, 4.0)), 2.0).area()
    assert found == pytest.approx(40.0 + 28.0 * 2.0 + math.pi * 4.0, rel=1e-2)
    assert regions.disc((1.0, 1.0), 2.0).area() == pytest.approx(math.pi, rel=2e-3)


def test_points_inside_and_nearest_points() -> None:
    ring = regions.disc((0.0, 0.0), 4.0) - regions.disc((0.0, 0.0), 2.0)
    assert [regions.inside(ring, (x, 0.0)) for x in (0.0, 1.5, 3.0)] == [False, True, False]
    assert regions.nearest(ring, (3.0, 0.0)) == pytest.approx((2.0, 0.0), abs=1e-2)
    assert regions.nearest(ring, (1.5, 0.0)) == (1.5, 0.0)


def test_booleans_of_triangles() -> None:
    a, b = box(2.0, 2.0, 2.0), box(2.0, 2.0, 2.0, (1.0, 1.0, 1.0))
    assert regions.common(a, b) == pytest.approx(1.0)
    assert regions.difference(a, b).volume == pytest.approx(7.0)
    with pytest.raises(Finger3dError, match="closed"):
        regions.manifold(Triangles(a.points, a.faces[1:]))
