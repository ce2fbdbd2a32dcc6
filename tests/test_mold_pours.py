"""A mold for each pour."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Gauge
from finger3d.mold.foils import foils
from finger3d.mold.options import MoldOptions
from finger3d.mold.pours import pour_order, poured
from tests.mold_cases import BODIES

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
    shared = made.parts["insert_core"] & made.parts["lid_body"]
    assert shared is None or sum(s.volume for s in shared.solids()) == pytest.approx(0.0, abs=1e-6)
    assert made.parts["insert_core"].distance_to(made.parts["lid_body"]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"pour_order": "skin,core"}, "--pour-order skin,core: .*body"),
        ({"pour_order": "skin,bone,body"}, "bone.*body"),
        ({"pour_order": "body,skin,core"}, "lid_body.*--pour-order.*--inserts"),
        ({"inserts": "skin"}, "--inserts skin"),
        ({"inserts": "skin,body,core"}, "--inserts skin,body,core"),
    ],
)
def test_orders_that_cannot_be(options, told) -> None:
    with pytest.raises(Finger3dError, match=told) as error:
        poured(TIP.solid(), TIP.solids(), (), MoldOptions(parts=True, **options))
    assert "\n" not in str(error.value)


def test_one_solid_needs_no_parts() -> None:
    with pytest.raises(Finger3dError, match="--parts"):
        pour_order({"": TIP.solid()}, MoldOptions(parts=True))


def test_a_strip_through_a_positive_is_refused() -> None:
    """A gauge in the body whose strip is long enough to reach into the core."""
    o = MoldOptions(parts=True, foil_length_mm=5.0)
    gauge = Gauge("through", 6.5, 4.0)
    with pytest.raises(Finger3dError, match='gauge "through".*lid_body'):
        poured(TIP.solid(), TIP.solids(), foils((gauge,), o, None), o)
