"""Pour holes and vents."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection

from finger3d.errors import Finger3dError
from finger3d.mold.cover import openings, ports
from finger3d.mold.options import MoldOptions
from finger3d.mold.regions import disc, inside, widened

BASE = CrossSection.square((40.0, 20.0), center=True)


def test_a_funnel_and_two_vents_go_through_the_lid() -> None:
    found = ports(BASE, MoldOptions())
    assert (found.pour_mm, found.pour, found.vent_mm) == (6.0, (0.0, 0.0), 2.0)
    assert [math.copysign(1.0, x) for x, _ in found.vents] == [-1.0, 1.0]
    solids = openings(found, 4.0)
    assert sum(solid.volume for solid in solids) == pytest.approx(found.volume_mm3(4.0), rel=1e-9)
    for solid in solids:
        assert (solid.bounding_box().min.Y, solid.bounding_box().max.Y) == pytest.approx((-4.0, 0.0), abs=1e-9)


def test_two_pieces_of_a_base_have_a_vent_each() -> None:
    """A base on both sides of a core: the pour hole is on one, and every piece lets its air out."""
    piece = CrossSection.square((14.0, 20.0), center=True)
    found = ports(piece.translate((-13.0, 0.0)) + piece.translate((13.0, 0.0)), MoldOptions())
    assert abs(found.pour[0]) - found.pour_mm / 2.0 >= 6.0 - 1e-6
    assert sorted(x > 0.0 for x, _ in found.vents) == [False, True]


@pytest.mark.parametrize("wide", [8.0, 3.0, 1.5])
def test_openings_of_a_ring_are_as_narrow_as_it_asks(wide) -> None:
    """The base of a hollow dome of 30 mm: every opening is inside the ring, with a rim between them."""
    ring = disc((0.0, 0.0), 30.0) - disc((0.0, 0.0), 30.0 - 2.0 * wide)
    found = ports(ring, MoldOptions())
    for place, size in ((found.pour, found.pour_mm), *((vent, found.vent_mm) for vent in found.vents)):
        assert inside(widened(ring, -size / 2.0 + 0.1), np.array([place]))[0]
    for vent in found.vents:
        assert math.dist(vent, found.pour) >= (found.pour_mm + found.vent_mm) / 2.0 + 1.2 - 1e-2


@pytest.mark.parametrize("options", [{"pour_mm": 30.0}, {"vent_mm": 25.0}, {"pour_mm": 18.0, "vent_mm": 15.0}])
def test_holes_that_do_not_fit_are_refused(options) -> None:
    with pytest.raises(Finger3dError, match=r"--pour-mm .*--vent-mm .*40 x 20 mm"):
        ports(BASE, MoldOptions(**options))
