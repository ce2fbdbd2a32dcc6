"""A mold for each pour."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Gauge
from finger3d.mold.foils import foils
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import mold
from finger3d.mold.pours import pour_order
from finger3d.mold.solids import between, common, cone, cylinder
from tests.mold_cases import BODIES

if TYPE_CHECKING:
    from build123d import Solid

TIP = designs()["fingertip"](**BODIES["fingertip"])


def test_each_lid_leaves_room_for_its_pour(molds) -> None:
    """Cavity less the positive of a lid and what was cast before: the solid of that pour, and the clearance."""
    made = molds["pours"]
    assert [(pour.name, pour.lid) for pour in made.pours] == [
        ("skin", "lid_skin"), ("body", "lid_body"), ("core", "lid_core")
    ]  # fmt: skip
    solids = {label or "body": solid for label, solid in TIP.solids().items()}
    before = 0.0
    low, high = made.body.box
    # walls of the positive stand 0.2 mm off the walls of the cavity: at most the area of the walls times 0.2
    flash = 0.2 * 2.0 * (high[1] * (high[2] - low[2]) + high[1] * (high[0] - low[0]))
    for pour in made.pours:
        shared = made.parts[pour.lid] & made.body.cad
        inside = sum(s.volume for s in shared.solids()) if shared is not None else 0.0
        room = made.body.volume_mm3 - inside - before
        assert pour.silicone_mm3 == pytest.approx(solids[pour.name].volume, rel=1e-9)
        assert pour.silicone_mm3 - 1e-6 <= room <= pour.silicone_mm3 + flash
        before += pour.silicone_mm3
    assert before == pytest.approx(made.silicone_mm3, rel=1e-9)
    # the skin does not reach the base: it is poured before its lid; the body around the core is poured beside it
    assert made.pours[0].ports is None
    x, _ = made.pours[1].ports.pour
    assert abs(x) - made.pours[1].ports.pour_mm / 2.0 >= 5.0 - 1e-6


def test_an_insert_stands_on_pegs_and_fills_the_core(molds) -> None:
    made = molds["insert"]
    assert [pour.name for pour in made.pours] == ["skin", "body"]
    core = TIP.solids()["core"]
    holes = core.volume - made.parts["insert_core"].volume
    assert 0.0 < holes < 0.2 * core.volume
    assert common(made.parts["insert_core"], made.parts["lid_body"]) == pytest.approx(0.0, abs=1e-6)
    assert made.parts["insert_core"].distance_to(made.parts["lid_body"]) == pytest.approx(0.0, abs=1e-6)
    assert made.silicone_mm3 == pytest.approx(made.body.volume_mm3 - core.volume, rel=1e-9)


def pad(*rods: Solid) -> dict[str, Solid]:
    """A carrier of 20 x 3 x 16 mm under 5 mm of silicone, which fills what the rods cut out of it."""
    carrier = between((-10, 0, -8), (10, 3, 8))
    silicone = between((-10, 3, -8), (10, 8, 8))
    return {"": silicone.fuse(*rods).solids()[0] if rods else silicone, "carrier": (carrier - [*rods]).solids()[0]}


def test_a_carrier_is_an_insert_that_is_pushed_into_the_silicone() -> None:
    """Under the whole base: channels lead through lid and carrier, which is 0.2 mm away from the walls."""
    solids = pad()
    made = mold(between((-10, 0, -8), (10, 8, 8)), (), MoldOptions(), solids, ["carrier"])
    (pour,) = made.pours
    assert pour.ports is None
    assert made.silicone_mm3 == pytest.approx(20.0 * 5.0 * 16.0)
    carrier = made.parts["insert_carrier"]
    assert [*carrier.bounding_box().size] == pytest.approx([19.6, 3.0, 15.6])
    wide = 0.1 * 15.6
    for x in (-9.8 + 0.3 * wide, 9.8 - 0.3 * wide):
        assert common(cylinder((x, -4.0, 0.0), wide, 7.0, "y"), made.parts["lid"].fuse(carrier)) == pytest.approx(0.0)


def test_silicone_is_poured_through_the_holes_of_a_carrier() -> None:
    """Holes of 5 mm, wider outside so that silicone grips: pour hole and vents open into them, and pegs keep off."""
    rods = [cone((x, 0.0, z), 6.0, 5.0, 3.0, "y") for x in (-6.0, 6.0) for z in (-4.0, 4.0)]
    solids = pad(*rods)
    made = mold(between((-10, 0, -8), (10, 8, 8)), (), MoldOptions(peg_mm=3.0), solids, ["carrier"])
    ports = made.pours[0].ports
    assert made.silicone_mm3 == pytest.approx(1600.0 + 4.0 * math.pi * (9.0 + 7.5 + 6.25), rel=1e-6)
    assert len(ports.vents) == 4
    for place in (ports.pour, *ports.vents):
        assert min(math.dist(place, (x, z)) for x in (-6.0, 6.0) for z in (-4.0, 4.0)) < 3.0


@pytest.mark.parametrize(
    ("options", "rigid", "told"),
    [
        ({"pour_order": "skin,core"}, (), "--pour-order skin,core: .*body"),
        ({"pour_order": "skin,bone,body"}, (), "bone.*body"),
        ({"pour_order": "skin,body,core"}, ("core",), "--pour-order .*: body, skin$"),
        ({"pour_order": "body,skin,core"}, (), "lid_body.*--pour-order.*rigid"),
        ({}, ("skin",), r"\[parts.skin\] rigid"),
        ({}, ("", "skin", "core"), "all parts of the finger are rigid"),
    ],
)
def test_orders_and_inserts_that_cannot_be(options, rigid, told) -> None:
    with pytest.raises(Finger3dError, match=told) as error:
        mold(TIP.solid(), (), MoldOptions(parts=True, **options), TIP.solids(), rigid)
    assert "\n" not in str(error.value)


def test_silicone_in_two_pieces_is_refused_with_advice() -> None:
    """A rigid wall from the base to the top has silicone on both sides."""
    from build123d import Compound

    block, wall = between((-10, 0, -8), (10, 8, 8)), between((-1, 0, -8), (1, 8, 8))
    solids = {"": Compound((block - wall).solids()), "wall": wall}
    for parts in (False, True):
        with pytest.raises(Finger3dError, match="silicone of body falls into 2 pieces; .*--parts"):
            mold(block, (), MoldOptions(parts=parts), solids, ["wall"])


def test_one_solid_needs_no_parts() -> None:
    with pytest.raises(Finger3dError, match="--parts"):
        pour_order({"": TIP.solid()}, (), MoldOptions(parts=True))


@pytest.mark.parametrize("rigid", [(), ("core",)])
def test_a_strip_through_a_positive_or_an_insert_is_refused(rigid) -> None:
    """A gauge in the body whose strip is long enough to reach into the core."""
    o = MoldOptions(parts=True, foil_length_mm=5.0)
    gauge = Gauge("through", 6.5, 4.0)
    with pytest.raises(Finger3dError, match='gauge "through".*lid_body'):
        mold(TIP.solid(), foils((gauge,), o, None), o, TIP.solids(), rigid)


def test_the_lid_of_a_hollow_dome_is_pushed_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ring of 1.5 mm as a base has channels; a pour hole that does not fit is refused before undercuts are sought."""
    from build123d import Rot, Sphere

    ball = Rot(90, 0, 0) * (Sphere(10.0) - Sphere(8.5))
    dome = (ball & between((-10, 0, -10), (10, 10, 10))).solids()[0]
    made = mold(dome, (), MoldOptions())
    assert made.pours[0].ports is None
    assert made.silicone_mm3 == pytest.approx(2.0 / 3.0 * math.pi * (10.0**3 - 8.5**3), rel=1e-6)
    monkeypatch.setattr("finger3d.mold.parts.check_opening", lambda *arguments, **options: pytest.fail("too late"))
    with pytest.raises(Finger3dError, match="--pour-mm 3 .*20 x 20 mm"):
        mold(dome, (), MoldOptions(pour_mm=3.0))
