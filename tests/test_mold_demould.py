"""Molds open: no undercuts."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mold.demould import undercuts
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import mold, overlaps
from tests.mold_cases import BODIES


@pytest.mark.parametrize("name", ["block", "half_cylinder", "hemisphere"])
@pytest.mark.parametrize("split", ["z", "x"])
def test_every_design_has_a_mold(name, split) -> None:
    solid = designs()[name](**BODIES[name]).solid()
    found = mold(solid, (), MoldOptions(split=split))
    assert max(overlaps(found).values()) <= 1e-6 * found.silicone_mm3
    assert found.silicone_mm3 == pytest.approx(solid.volume, rel=1e-9)


def test_halves_slide_off_along_z(paper_mold) -> None:
    """Half A drawn off along z by several steps shares no volume with what was cast."""
    from build123d import Pos

    for step in (0.5, 5.0, 15.0):
        for name, sign in (("half_a", 1.0), ("half_b", -1.0)):
            shared = (Pos(0, 0, sign * step) * paper_mold.parts[name]) & paper_mold.body
            assert shared is None or sum(s.volume for s in shared.solids()) <= 1e-6 * paper_mold.silicone_mm3


def test_a_body_that_would_be_locked_is_refused_with_the_split_that_does() -> None:
    ball = designs()["hemisphere"](8.0).solid()
    assert undercuts(ball, "z", 0.0) == ""
    assert "-z" in undercuts(ball, "z", 1.0)
    with pytest.raises(Finger3dError, match="--split x"):
        mold(ball, (), MoldOptions(split_mm=1.0))
    half = designs()["half_cylinder"](**BODIES["half_cylinder"]).solid()
    with pytest.raises(Finger3dError, match="locked .*--split z"):
        mold(half, (), MoldOptions(split="x", split_mm=1.0))


def test_a_mushroom_is_refused_whatever_the_split() -> None:
    """A stem with a wide ring around it and another above: no line of sight along x or z."""
    from build123d import Align, Cylinder, Pos, Rot

    lying = (Align.CENTER, Align.CENTER, Align.MIN)
    stem, ring = Cylinder(5, 20, align=lying), Cylinder(8, 4, align=lying)
    # bored along a slant, so that both halves are hooked
    body = Rot(-90, 0, 0) * (stem + Pos(0, 0, 10) * ring)
    body -= Pos(0, 8, 0) * Rot(0, 45, 0) * Cylinder(1.5, 40)
    with pytest.raises(Finger3dError, match="halves"):
        mold(body.solids()[0], (), MoldOptions())
