"""Pour holes, vents and risers; the carrier, and the finger that stands on it."""

from __future__ import annotations

import math

import pytest

from finger3d.errors import Finger3dError
from finger3d.mold.cover import LABEL, base_region, finger_on_carrier, key_solids, keys, openings, ports, riser_cup
from finger3d.mold.options import MoldOptions
from finger3d.mold.regions import rectangle
from tests.bodies import box

BASE = rectangle((-20.0, -10.0), (20.0, 10.0))
OPTIONS = MoldOptions(carrier=True)


def test_the_riser_holds_its_share_of_the_cavity() -> None:
    """Volume of what stands above the sensor in the pour hole, measured on the parts: cup, spigot and hole."""
    for share in (0.03, 0.05):
        o = MoldOptions(riser=share)
        found = ports(BASE, 40_000.0, o)
        cup = riser_cup(found, 0.0, o)
        (hole, socket, *_) = openings(found, 0.0, o)
        assert found.riser.volume_mm3 == pytest.approx(share * 40_000.0, rel=1e-9)
        # the cup as a solid block, without the cup itself
        outer = found.riser.radius_mm + found.riser.wall_mm
        block = math.pi * outer**2 * found.riser.height_mm
        length = found.riser.spigot_mm - o.gap_mm
        spigot = math.pi * ((found.pour_mm / 2.0 + found.riser.wall_mm) ** 2) * length
        inside = block + spigot - cup.volume
        below = math.pi * found.pour_mm**2 / 4.0 * (o.lid_mm - length)
        assert inside + below == pytest.approx(found.riser.volume_mm3, rel=1e-6)
        assert socket.volume > 0.0
        assert hole.bounding_box().max.Y == pytest.approx(0.0, abs=1e-9)


def test_a_cup_keeps_off_the_vents() -> None:
    """A large riser over a short base is narrow and high."""
    o = MoldOptions(riser=0.1)
    found = ports(rectangle((-10.0, -10.0), (10.0, 10.0)), 20_000.0, o)
    for vent in found.vents:
        assert math.dist(vent, found.pour) >= found.riser.radius_mm + found.riser.wall_mm + found.vent_mm / 2.0 - 1e-9
    assert found.riser.volume_mm3 == pytest.approx(2000.0, rel=1e-9)
    assert found.riser.height_mm > found.riser.radius_mm


def test_two_pieces_of_a_base_have_a_vent_each() -> None:
    """A base on both sides of a core: the pour hole is on one, and every piece lets its air out."""
    base = rectangle((-20.0, -10.0), (-6.0, 10.0)) + rectangle((6.0, -10.0), (20.0, 10.0))
    found = ports(base, 5000.0, MoldOptions())
    assert abs(found.pour[0]) - found.pour_mm / 2.0 >= 6.0 - 1e-6
    assert sorted(x > 0.0 for x, _ in found.vents) == [False, True]


def test_the_base_of_a_body_is_found() -> None:
    assert base_region(box(40.0, 12.0, 20.0, (0.0, 6.0, 0.0))).area() == pytest.approx(800.0, rel=1e-6)


def test_holes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(Finger3dError, match="--pour-mm 30.*40 x 20 mm"):
        ports(BASE, 1000.0, MoldOptions(pour_mm=30.0))


def test_holes_grip_and_are_open_to_the_air() -> None:
    """Each is narrower at the sensor than outside, runs through the carrier, and keeps a rim from its neighbours."""
    found = keys(BASE, ports(BASE, 9600.0, OPTIONS, vented=False), OPTIONS)
    assert found.head_mm == pytest.approx(1.7 * found.neck_mm)
    assert len(found.places) >= 4
    for i, a in enumerate(found.places):
        assert (-a[0], a[1]) in found.places  # symmetric
        for b in found.places[:i]:
            assert math.dist(a, b) >= found.head_mm + 2.0 * OPTIONS.rim_mm - 1e-9
    held = sum(solid.volume for solid in key_solids(found, 0.0, OPTIONS))
    assert held == pytest.approx(found.volume_mm3(OPTIONS.carrier_mm), rel=1e-9)


def test_the_silicone_cannot_be_pulled_out(molds) -> None:
    """Lifted off the carrier by a millimetre, the finger with its rods would run into the carrier."""
    from build123d import Pos

    made = molds["carrier"]
    rods = key_solids(made.keys, 0.0, made.options)
    parts = finger_on_carrier(made.body.cad, made.parts["carrier"], rods, made.options.carrier_mm)
    silicone, carrier = parts[""], parts[LABEL]
    assert silicone.volume == pytest.approx(made.body.volume_mm3 + made.keys.volume_mm3(5.0), rel=1e-9)
    touching = silicone & carrier
    assert touching is None or sum(s.volume for s in touching.solids()) == pytest.approx(0.0, abs=1e-6)
    lifted = (Pos(0, 1.0, 0) * silicone) & carrier
    necks_mm2 = len(made.keys.places) * math.pi * made.keys.neck_mm**2 / 4.0
    assert sum(s.volume for s in lifted.solids()) > 0.1 * necks_mm2
    # they share the interface: necks and base; the carrier's outer face is the base of both
    assert carrier.bounding_box().min.Y == pytest.approx(0.0, abs=1e-6)
    assert silicone.bounding_box().min.Y == pytest.approx(0.0, abs=1e-6)


def test_a_base_without_room_is_refused() -> None:
    small = rectangle((-4.0, -4.0), (4.0, 4.0))
    with pytest.raises(Finger3dError, match="--key-mm 3.*8 x 8 mm"):
        keys(small, ports(small, 500.0, OPTIONS, vented=False), OPTIONS)
