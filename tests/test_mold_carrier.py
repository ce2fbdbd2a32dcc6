"""The carrier: keyed holes, and the finger that stands on it."""

from __future__ import annotations

import math

import pytest

from finger3d.errors import Finger3dError
from finger3d.mold.carrier import LABEL, finger_on_carrier, key_solids, keys
from finger3d.mold.options import MoldOptions
from finger3d.mold.ports import ports
from finger3d.mold.regions import rectangle

BASE = rectangle((-20.0, -10.0), (20.0, 10.0))
OPTIONS = MoldOptions(carrier=True)


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
