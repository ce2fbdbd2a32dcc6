"""Molds open: undercuts and draft."""

from __future__ import annotations

import math

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mold.body import Body
from finger3d.mold.demould import check_opening, draft, undercut_depth
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import mold
from tests.mold_cases import BODIES


def body(name: str) -> Body:
    return Body.of(designs()[name](**BODIES[name]).solid(), 0.01)


@pytest.mark.parametrize("name", ["block", "half_cylinder", "hemisphere"])
@pytest.mark.parametrize("split", ["z", "x"])
def test_every_design_opens(name, split) -> None:
    assert draft(body(name), split, 0.0).undercut_mm == 0.0


def test_halves_slide_off_along_z(paper_mold) -> None:
    """Half A drawn off along z by several steps shares no volume with what was cast."""
    from build123d import Pos

    for step in (0.5, 5.0, 15.0):
        for name, sign in (("half_a", 1.0), ("half_b", -1.0)):
            shared = (Pos(0, 0, sign * step) * paper_mold.parts[name]) & paper_mold.body.cad
            assert shared is None or sum(s.volume for s in shared.solids()) <= 1e-6 * paper_mold.silicone_mm3


def test_walls_without_draft_are_measured() -> None:
    """An extruded block: its top and both sides are parallel to z, over half the width in each half."""
    found = draft(body("block"), "z", 0.0)
    assert found.angle_deg == 0.0
    # top 40 x 20, and two sides 20 x 20, all parallel to z; the base is closed by the lid
    assert found.wall_mm2 == pytest.approx(40.0 * 20.0 + 2.0 * 20.0 * 20.0, rel=1e-9)
    assert found.wall_mm == pytest.approx(10.0, rel=1e-9)


def test_the_depth_of_an_undercut_is_that_of_a_ball_cut_beside_its_middle() -> None:
    """A ball of radius r cut 1 mm beside its middle: its rim is r - sqrt(r^2 - 1) inside its outline.

    Heights are 24 steps apart, of which one is within 0.4 mm of the cut: (0.4 + 1)^2 / 2 r bounds the error.
    """
    found = draft(body("hemisphere"), "z", 1.0)
    assert found.undercut_mm == pytest.approx(8.0 - math.sqrt(63.0), abs=2e-3)
    assert " -z " in found.where


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_groove_is_as_deep_as_it_was_cut(axis) -> None:
    """A cylinder of radius 5 with a groove 0.7 mm deep around it, along each axis."""
    from build123d import Cylinder, Pos, Rot

    turned = Rot(0, 90, 0) if axis == 0 else Rot(-90, 0, 0) if axis == 1 else Rot(0, 0, 0)
    plain, ring = Cylinder(5.0, 20.0), Pos(0, 0, 2.0) * (Cylinder(6.0, 3.0) - Cylinder(4.3, 3.0))
    grooved = Body.of((turned * (plain - ring)).solids()[0], 0.005)
    assert undercut_depth(grooved.surface, axis, 1.0) == pytest.approx(0.7, abs=0.02)
    smooth = Body.of((turned * plain).solids()[0], 0.005)
    assert undercut_depth(smooth.surface, axis, 1.0) == 0.0


def test_a_body_that_would_be_locked_is_refused_with_the_split_that_does() -> None:
    ball = body("hemisphere")
    told = r"0.06\d mm.*--split x.*--undercut-mm 0.06\d"
    with pytest.raises(Finger3dError, match=told):
        check_opening(ball, MoldOptions(split_mm=1.0), may_turn=True)
    assert check_opening(ball, MoldOptions(split_mm=1.0, undercut_mm=0.07), may_turn=True).undercut_mm > 0.06
    with pytest.raises(Finger3dError, match="--split x .*--split z"):
        check_opening(body("half_cylinder"), MoldOptions(split="x", split_mm=1.0), may_turn=True)


def test_a_smooth_body_of_triangles_is_not_refused() -> None:
    """Facets beside the widest place of a ball face the wrong way by less than a printer resolves."""
    ball = body("hemisphere")
    assert draft(Body(ball.surface, None), "z", 0.0).undercut_mm == 0.0
    assert draft(Body(ball.surface, None), "z", 1.0).undercut_mm == pytest.approx(8.0 - np.sqrt(63.0), abs=5e-3)


def test_a_mushroom_is_refused_whatever_the_split() -> None:
    """A stem with a wide ring around it and another above: no line of sight along x or z."""
    from build123d import Align, Cylinder, Pos, Rot

    lying = (Align.CENTER, Align.CENTER, Align.MIN)
    stem, ring = Cylinder(5, 20, align=lying), Cylinder(8, 4, align=lying)
    # bored along a slant, so that both halves are hooked
    shape = Rot(-90, 0, 0) * (stem + Pos(0, 0, 10) * ring)
    shape -= Pos(0, 8, 0) * Rot(0, 45, 0) * Cylinder(1.5, 40)
    with pytest.raises(Finger3dError, match="halves"):
        mold(shape.solids()[0], (), MoldOptions())


def test_an_undercut_that_no_printer_resolves_is_accepted() -> None:
    from build123d import Box, Pos

    gel = (Pos(0.0, 2.0, 0.0) * Box(20.0, 4.0, 20.0)).solids()[0]
    for depth, accepted in ((0.008, True), (0.05, False)):
        groove = Pos(0.0, 2.0, 9.0) * Box(20.0, 1.0, 1.0)  # open along x, 0.5 mm inside the end
        lip = Pos(0.0, 2.0 - depth, 9.75) * Box(20.0, 1.0, 0.5)
        body = Body.of((gel - groove - lip).solids()[0], 0.02)
        if accepted:
            assert check_opening(body, MoldOptions(), may_turn=True).undercut_mm == pytest.approx(depth, rel=0.2)
        else:
            with pytest.raises(Finger3dError, match="undercut of 0.05 mm"):
                check_opening(body, MoldOptions(), may_turn=True)
