"""Molds: bodies, solids, parts, pours, and how they open."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from manifold3d import CrossSection

from finger3d.errors import Finger3dError
from finger3d.geometry.design import designs
from finger3d.mechanics.model import Gauge
from finger3d.mold.body import Body, shell
from finger3d.mold.cover import foils, openings, ports, slot
from finger3d.mold.demould import check_opening, undercut, undercut_depth
from finger3d.mold.fasteners import THIN, bolts, half_pegs, layout_of, lid_pegs, screws
from finger3d.mold.options import SCREWS, MoldOptions
from finger3d.mold.parts import mold
from finger3d.mold.regions import disc, inside, widened
from finger3d.mold.solids import LEAD_IN, between, common, cone, cylinder
from tests.mold_cases import BODIES, GAUGES, made, overlaps

if TYPE_CHECKING:
    from build123d import Solid

# --- options of a mold, and lengths of screws ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"clearance_mm": -0.1}, "--clearance-mm -0.1"),
        ({"shrinkage": 1.0}, "--shrinkage 1.0"),
        ({"pour_mm": -1.0}, "--pour-mm -1.0"),
        ({"pour_mm": 1e4}, "--pour-mm 10000.0 .* at most 100"),
        ({"printer": "laser"}, "--printer laser"),
        ({"screw": "M7"}, "--screw M7"),
    ],
)
def test_choices_that_make_no_mold(options, told) -> None:
    with pytest.raises(Finger3dError) as error:
        MoldOptions(**options)
    head, _, tail = told.partition(" .* ")
    assert str(error.value).startswith(head)
    assert tail in str(error.value)
    assert "\n" not in str(error.value)


# --- pegs and screws -------------------------------------------------------------------------------------------------


AT = layout_of(np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0]), MoldOptions())


def test_one_peg_is_thin_and_all_have_a_lead_in_and_clearance() -> None:
    """Volume of a cylinder whose tip is a frustum of 0.7 times the diameter, 0.15 diameters high; holes are longer and
    wider by 0.2 mm."""
    for found in (half_pegs(AT, MoldOptions()), lid_pegs(AT, MoldOptions())):
        (made,), holes = found.add.values(), next(iter(found.cut.values()))
        for peg, hole, d in zip(made, holes, [4.0 * THIN, 4.0, 4.0, 4.0], strict=True):
            tip = LEAD_IN * d
            r, end = d / 2.0, 0.35 * d
            wanted = math.pi * (r**2 * (4.0 - tip) + tip / 3.0 * (r**2 + r * end + end**2))
            assert peg.volume == pytest.approx(wanted, rel=1e-9)
            assert hole.volume == pytest.approx(math.pi * (r + 0.2) ** 2 * 4.2, rel=1e-9)


def test_a_screw_of_standard_length_ends_in_its_nut() -> None:
    """The nut lies as deep as the screw reaches: length plus trap, less the nut, is the thickness of the mold."""
    o = MoldOptions()
    found = bolts(AT, o)
    thick = AT.outer_high[2] - AT.outer_low[2]
    assert found.length_mm + found.trap_mm - SCREWS["M3"].nut_mm == pytest.approx(thick)
    assert found.trap_mm >= SCREWS["M3"].nut_mm + 0.2
    cut = screws(AT, o).cut
    holes, traps = cut["half_a"][: found.number], cut["half_a"][found.number :]
    assert all(h.volume == pytest.approx(math.pi * 3.4**2 / 4.0 * thick, rel=1e-6) for h in holes)
    # hexagon: area sqrt(3) / 2 times the width across flats squared; ISO 4032: 5.5 mm
    area = math.sqrt(3.0) / 2.0 * (5.5 + 0.4) ** 2
    assert all(t.volume == pytest.approx(area * found.trap_mm, rel=1e-6) for t in traps)
    assert bolts(AT, MoldOptions(screw="none")) is None
    assert screws(AT, MoldOptions(screw="none")).add == {}


# --- slots of gauges' strips -----------------------------------------------------------------------------------------


def test_every_slot_is_at_its_gauges_place_and_angle(paper_mold) -> None:
    """The strip's section: centre times the scale, the foil with its gaps along the gauge and across."""
    slots = [slot(foil, paper_mold.layout, paper_mold.options) for foil in paper_mold.foils]
    assert len(slots) == 2  # two gauges share a strip
    for found, gauge, length in zip(slots, GAUGES, (5.0, 4.0), strict=False):
        np.testing.assert_allclose([*found.center()][:2], gauge.middle[:2] / 0.99, rtol=1e-9)
        corners = np.array([[*v] for v in found.vertices()]) - [*found.center()]
        across = np.array([-gauge.direction[1], gauge.direction[0], 0.0])
        assert np.ptp(corners @ gauge.direction) == pytest.approx(length + 0.3, rel=1e-9)
        assert np.ptp(corners @ across) == pytest.approx(0.1 + 0.3, rel=1e-9)
        # and it is open through the walls: nothing of any part is left in it
        assert all(common(found, part) == pytest.approx(0.0, abs=1e-9) for part in paper_mold.parts.values())


# --- pour holes and vents --------------------------------------------------------------------------------------------


BASE = CrossSection.square((40.0, 20.0), center=True)


def test_a_funnel_and_two_vents_go_through_the_lid() -> None:
    found = ports(BASE, MoldOptions())
    assert (found.pour_mm, found.pour, found.vent_mm) == (6.0, (0.0, 0.0), 2.0)
    assert [math.copysign(1.0, x) for x, _ in found.vents] == [-1.0, 1.0]
    solids = openings(found)
    assert sum(solid.volume for solid in solids) == pytest.approx(found.volume_mm3, rel=1e-9)
    for solid in solids:
        assert (solid.bounding_box().min.Y, solid.bounding_box().max.Y) == pytest.approx((-4.0, 0.0), abs=1e-9)


def test_two_pieces_of_a_base_have_a_vent_each() -> None:
    """A base on both sides of a core: the pour hole is on one, and every piece lets its air out."""
    piece = CrossSection.square((14.0, 20.0), center=True)
    found = ports(piece.translate((-13.0, 0.0)) + piece.translate((13.0, 0.0)), MoldOptions())
    assert abs(found.pour[0]) - found.pour_mm / 2.0 >= 6.0 - 1e-6
    assert sorted(x > 0.0 for x, _ in found.vents) == [False, True]


@pytest.mark.parametrize("wide", [8.0, 1.5])
def test_openings_of_a_ring_are_as_narrow_as_it_asks(wide) -> None:
    """The base of a hollow dome of 30 mm: every opening is inside the ring, with a rim between them."""
    ring = disc((0.0, 0.0), 30.0) - disc((0.0, 0.0), 30.0 - 2.0 * wide)
    found = ports(ring, MoldOptions())
    for place, size in ((found.pour, found.pour_mm), *((vent, found.vent_mm) for vent in found.vents)):
        assert inside(widened(ring, -size / 2.0 + 0.1), place)
    for vent in found.vents:
        assert math.dist(vent, found.pour) >= (found.pour_mm + found.vent_mm) / 2.0 + 1.2 - 1e-2


def test_a_pour_hole_that_does_not_fit_is_refused() -> None:
    with pytest.raises(Finger3dError, match=r"--pour-mm 30: .*40 x 20 mm, with vents of"):
        ports(BASE, MoldOptions(pour_mm=30.0))


# --- parts of a mold -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["screws, gauges", "plain, sla", "pours", "insert", "triangles"])
def test_no_part_overlaps_another(name, molds) -> None:
    """Faces that touch share no volume; 1e-6 of the cavity is what booleans leave, 1e-3 beside triangles."""
    made = molds[name]
    shared = overlaps(made)
    assert {"half_a, half_b", f"half_a, {made.pours[0].lid}"} <= set(shared)
    assert max(shared.values()) <= (1e-6 if made.body.cad else 1e-3) * made.silicone_mm3


def test_block_minus_finger_is_the_cavity() -> None:
    """Volumes of both halves without screws against the block's, in closed form."""
    found = made("half_cylinder", {"screw": "none", "shrinkage": 0.01})
    block = float(np.prod(found.layout.outer_high - found.layout.outer_low))
    between, lid = half_pegs(found.layout, found.options), lid_pegs(found.layout, found.options)
    pegs = sum(float(peg.volume) for peg in between.add["half_b"])
    holes = sum(float(hole.volume) for hole in (*between.cut["half_a"], *lid.cut["half_a"]))
    halves = found.parts["half_a"].volume + found.parts["half_b"].volume
    assert halves == pytest.approx(block - found.silicone_mm3 + pegs - holes, rel=1e-6)
    meshed = sum(shell(found.parts[name], 0.02, name).surface.volume for name in ("half_a", "half_b"))
    assert block - meshed + pegs - holes == pytest.approx(found.silicone_mm3, rel=5e-3)


def test_the_cavity_is_larger_by_the_shrinkage(paper_mold, paper_finger) -> None:
    assert paper_mold.silicone_mm3 == pytest.approx(paper_finger.volume_mm3 / (1.0 - 0.01) ** 3, rel=1e-9)
    low, high = paper_mold.body.box
    assert list((high - low)[[0, 2]]) == pytest.approx([100.0 / 0.99, 20.0 / 0.99], rel=1e-6)


def test_a_mold_of_triangles_is_that_of_cad(molds) -> None:
    """The same halves, but for chords of 0.1 mm on the arc: their area is some percent of 91 ml's surface."""
    found, exact = molds["triangles"], made("clipped_cylinder", {})
    assert list(found.parts) == list(exact.parts)
    for name in ("half_a", "half_b"):
        volumes = found.shell(name, 0.05, 0.2).surface.volume, exact.parts[name].volume
        assert volumes[0] == pytest.approx(volumes[1], rel=2e-3)


def test_parts_fit_only_one_way(paper_mold) -> None:
    from build123d import Pos, Rot

    middle = 0.5 * (paper_mold.layout.outer_low + paper_mold.layout.outer_high)

    def turned(part, about):
        return Pos(*map(float, middle)) * Rot(*(180.0 * a for a in about)) * Pos(*map(float, -middle)) * part

    # half A upside down; lid turned end for end: a peg of full size meets the thin peg's hole. The chamfer of the tip
    # takes away a ninth of the ring that is shared.
    thick = math.pi * 2.0**2 * 4.0 - math.pi * (2.0 * THIN + 0.2) ** 2 * 4.0
    for part, about in (("half_a", (0, 0, 1)), ("lid", (0, 1, 0))):
        shared = turned(paper_mold.parts[part], about) & paper_mold.parts["half_b"]
        assert sum(solid.volume for solid in shared.solids()) >= 0.8 * thick


@pytest.mark.parametrize(
    ("gauges", "options", "told"),
    [
        ((), {"split_mm": 10.0}, "--split-mm 10"),
        ((), {"pour_mm": 96.0}, "--pour-mm 96"),
        ((), {"pour_mm": 24.0}, "--pour-mm 24"),
        (GAUGES[:1], {"split": "x"}, "--split x"),
        ((replace(GAUGES[0], length_mm=12.0),), {}, 'gauge "g36".* 12 x 3 x 0.1 mm'),
        ((Gauge("out", 60.0, 10.0),), {}, 'gauge "out"'),
        ((Gauge("edge", 0.0, 20.0, z_mm=9.5),), {}, 'gauge "edge"'),
        ((GAUGES[0], replace(GAUGES[0], name="near", y_mm=39.0)), {}, 'gauge "near".*g36'),
    ],
)
def test_molds_that_cannot_be(gauges, options, told, paper_finger) -> None:
    chosen = MoldOptions(**options)
    with pytest.raises(Finger3dError, match=told) as error:
        mold(paper_finger.solid(), foils(gauges), chosen)
    assert "\n" not in str(error.value)


def test_the_lid_fills_a_recess_in_the_base() -> None:
    from build123d import Box, Cylinder, Pos, Rot

    block = Pos(0.0, 6.0, 0.0) * Box(20.0, 12.0, 20.0)
    hole = Pos(-3.0, 2.5, 0.0) * Rot(90.0, 0.0, 0.0) * Cylinder(3.0, 5.0)
    plain, cast = (mold(body.solids()[0], [], MoldOptions()) for body in (block, block - hole))
    for name in ("half_a", "half_b"):
        assert cast.parts[name].volume == pytest.approx(plain.parts[name].volume, rel=1e-9)
    assert common(cast.parts["lid"], hole) == pytest.approx(45.0 * np.pi, rel=1e-6)
    assert cast.silicone_mm3 == pytest.approx(4800.0 - 45.0 * np.pi, rel=1e-6)
    wide = hole + Pos(-3.0, 4.5, 0.0) * Rot(90.0, 0.0, 0.0) * Cylinder(4.0, 1.0)
    with pytest.raises(Finger3dError, match=r"the recess in the base near \(-3, .*, an undercut of 1 mm"):
        mold((block - wide).solids()[0], [], MoldOptions())


# --- A mold for each pour --------------------------------------------------------------------------------------------


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
    rods = [cone((x, 0.0, z), 6.0, 5.0, 3.0, "y") for x in (-6.5, 6.5) for z in (-4.5, 4.5)]
    solids = pad(*rods)
    made = mold(between((-10, 0, -8), (10, 8, 8)), (), MoldOptions(), solids, ["carrier"])
    ports = made.pours[0].ports
    assert made.silicone_mm3 == pytest.approx(1600.0 + 4.0 * math.pi * (9.0 + 7.5 + 6.25), rel=1e-6)
    assert len(ports.vents) == 4
    for place in (ports.pour, *ports.vents):
        assert min(math.dist(place, (x, z)) for x in (-6.5, 6.5) for z in (-4.5, 4.5)) < 3.0


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


def test_a_strip_through_a_positive_is_refused() -> None:
    """A gauge in the body whose strip is long enough to reach into the core."""
    o = MoldOptions(parts=True)
    gauge = Gauge("through", 6.5, 4.0)
    with pytest.raises(Finger3dError, match='gauge "through".*lid_body'):
        mold(TIP.solid(), foils((gauge,)), o, TIP.solids(), ())


def test_the_lid_of_a_hollow_dome_is_pushed_in() -> None:
    """A ring of 1.5 mm as a base has channels; a pour hole that does not fit is refused."""
    from build123d import Rot, Sphere

    ball = Rot(90, 0, 0) * (Sphere(10.0) - Sphere(8.5))
    dome = (ball & between((-10, 0, -10), (10, 10, 10))).solids()[0]
    made = mold(dome, (), MoldOptions())
    assert made.pours[0].ports is None
    assert made.silicone_mm3 == pytest.approx(2.0 / 3.0 * math.pi * (10.0**3 - 8.5**3), rel=1e-6)
    with pytest.raises(Finger3dError, match="--pour-mm 3: .*20 x 20 mm"):
        mold(dome, (), MoldOptions(pour_mm=3.0))


# --- molds open: undercuts -------------------------------------------------------------------------------------------


def body(name: str) -> Body:
    return Body.of(designs()[name](**BODIES[name]).solid(), 0.01)


@pytest.mark.parametrize("name", ["block", "half_cylinder", "hemisphere"])
@pytest.mark.parametrize("split", ["z", "x"])
def test_every_design_opens(name, split) -> None:
    assert undercut(body(name), split, 0.0).depth_mm == 0.0


def test_halves_slide_off_along_z(paper_mold) -> None:
    """Half A drawn off along z by several steps shares no volume with what was cast."""
    from build123d import Pos

    for step in (0.5, 5.0, 15.0):
        for name, sign in (("half_a", 1.0), ("half_b", -1.0)):
            shared = (Pos(0, 0, sign * step) * paper_mold.parts[name]) & paper_mold.body.cad
            assert shared is None or sum(s.volume for s in shared.solids()) <= 1e-6 * paper_mold.silicone_mm3


def test_the_depth_of_an_undercut_is_that_of_a_ball_cut_beside_its_middle() -> None:
    """A ball of radius r cut 1 mm beside its middle: its rim is r - sqrt(r^2 - 1) inside its outline.

    Heights are 24 steps apart, of which one is within 0.4 mm of the cut: (0.4 + 1)^2 / 2 r bounds the error.
    """
    found = undercut(body("hemisphere"), "z", 1.0)
    assert found.depth_mm == pytest.approx(8.0 - math.sqrt(63.0), abs=2e-3)
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
    assert check_opening(ball, MoldOptions(split_mm=1.0, undercut_mm=0.07), may_turn=True).depth_mm > 0.06
    with pytest.raises(Finger3dError, match="--split x .*--split z"):
        check_opening(body("half_cylinder"), MoldOptions(split="x", split_mm=1.0), may_turn=True)


def test_a_smooth_body_of_triangles_is_not_refused() -> None:
    """Facets beside the widest place of a ball face the wrong way by less than a printer resolves."""
    ball = body("hemisphere")
    assert undercut(Body(ball.surface, None), "z", 0.0).depth_mm == 0.0
    assert undercut(Body(ball.surface, None), "z", 1.0).depth_mm == pytest.approx(8.0 - np.sqrt(63.0), abs=5e-3)


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
            assert check_opening(body, MoldOptions(), may_turn=True).depth_mm == 0.0
        else:
            with pytest.raises(Finger3dError, match="undercut of 0.05 mm"):
                check_opening(body, MoldOptions(), may_turn=True)
