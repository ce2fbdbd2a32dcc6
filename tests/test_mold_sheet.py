"""The casting sheet and the text of its steps."""

from __future__ import annotations

from finger3d.materials.silicones import silicone_named
from finger3d.mold.body import shell
from finger3d.mold.printing import as_printed
from finger3d.mold.sheet import close_lines, open_lines, oversize, pour_lines, prepare_lines, sheet, thread_lines


def test_the_steps_name_what_the_mold_has(molds) -> None:
    """Screws with their size, the strips and plugs, the hole that is poured through."""
    made = molds["tongue, screws, plugs"]
    assert f"{made.bolts.number} screws M3 x {made.bolts.length_mm:g}" in " ".join(close_lines(made))
    assert f"{made.bolts.number} M3 nuts" in " ".join(prepare_lines(made))
    assert "half B" in " ".join(thread_lines(made))
    assert "plugs" in " ".join(close_lines(made))
    told = " ".join(pour_lines(made, made.pours[0]))
    assert f"{made.silicone_mm3 / 1e3:.2f} ml" in told
    assert "6 mm" in told
    assert "along z" in " ".join(open_lines(made))


def test_a_carrier_is_poured_through_its_holes_and_stays(molds) -> None:
    made = molds["carrier"]
    assert thread_lines(made) == []
    *_, poured = pour_lines(made, made.pours[0])
    assert "carrier" in poured
    assert "carrier stays" in " ".join(open_lines(made))


def test_a_skin_is_poured_before_its_lid(molds) -> None:
    skin, body, _ = molds["pours"].pours
    poured, closed = pour_lines(molds["pours"], skin)
    assert f"{skin.silicone_mm3 / 1e3:.2f} ml" in poured
    assert "lid_skin" in closed
    *_, closed, poured = pour_lines(molds["pours"], body)
    assert "lid_body" in closed
    assert f"{body.silicone_mm3 / 1e3:.2f} ml" in poured


def test_a_cord_and_bands_are_laid(molds) -> None:
    made = molds["cord, bands, two cavities"]
    assert "cord of 2 mm" in " ".join(prepare_lines(made))
    assert "5 mm wide" in " ".join(close_lines(made))


def test_a_part_larger_than_the_bed_is_told(paper_mold) -> None:
    part = as_printed({"lid": shell(paper_mold.parts["lid"], 0.05, "lid")})["lid"]
    assert oversize(part, (45.0, 220.0, 250.0)) == ""  # turned on the bed
    assert oversize(part, (100.0, 100.0, 250.0))
    assert oversize(part, (220.0, 220.0, 5.0))


def test_the_sheet_has_the_silicone_of_the_scene(paper_mold) -> None:
    printed = as_printed({name: shell(part, 0.05, name) for name, part in paper_mold.parts.items()})
    named = sheet("mine", paper_mold, printed, (200.0, 200.0, 50.0), silicone_named("Dragon Skin 20"))
    unnamed = sheet("mine", paper_mold, printed, (200.0, 200.0, 50.0))
    heads = ["SILICONE", "PARTS", "PRINT", "FRICTION FACE", "CURE INHIBITION", "GAUGES", "MIX", "POUR"]
    for text in (named, unnamed):
        assert [line for line in text.splitlines() if line.isupper()] == heads
    assert "Dragon Skin 20" in named
    assert "g of A" in named
    assert "g of A" not in unnamed
    assert 'silicone = "NAME"' in unnamed
