"""The casting sheet and the text of its steps."""

from __future__ import annotations

import re

import pytest

from finger3d.materials.silicones import silicone_named
from finger3d.mold.printing import as_printed
from finger3d.mold.sheet import close_lines, open_lines, pour_lines, prepare_lines, sheet


def test_the_steps_name_what_the_mold_has(molds) -> None:
    """Screws with their size, the strips, the hole that is poured through."""
    made = molds["screws, gauges"]
    assert f"{made.bolts.number} screws M3 x {made.bolts.length_mm:g}" in " ".join(close_lines(made))
    assert f"{made.bolts.number} M3 nuts" in " ".join(prepare_lines(made))
    assert "strips" in " ".join(prepare_lines(made))
    told = " ".join(pour_lines(made, made.pours[0]))
    assert f"{made.silicone_mm3 / 1e3:.2f} ml" in told
    assert "6 mm" in told
    assert "along z" in " ".join(open_lines(made))


def test_a_skin_is_poured_before_its_lid(molds) -> None:
    skin, body, core = molds["pours"].pours
    poured, pushed, off = pour_lines(molds["pours"], skin)
    assert f"{skin.silicone_mm3 / 1e3:.2f} ml" in poured
    assert "lid_skin" in pushed
    assert "lid_skin off" in off
    closed, poured, off = pour_lines(molds["pours"], body)
    assert "lid_body" in closed
    assert f"{body.silicone_mm3 / 1e3:.2f} ml" in poured
    assert "lid_body off" in off
    assert not any("pull" in line for line in pour_lines(molds["pours"], core))


def test_an_insert_is_printed_and_not_poured(molds) -> None:
    """The volume of the sheet is that of skin and body; before the last pour the core is put onto its lid."""
    made = molds["insert"]
    printed = as_printed({name: made.shell(name, 0.2, 0.4) for name in made.parts})
    text = " ".join(sheet("mine", made, printed).split())
    volume = float(re.search(r"cavity ([\d.]+) ml, without what is inserted: core", text)[1])
    assert volume == pytest.approx((made.body.volume_mm3 - 10.0 * 8.0 * 16.0) / 1e3, abs=0.006)
    assert "insert core" in text
    skin, body = made.pours
    assert "core, which is printed (mold_insert_core.stl)" in pour_lines(made, body)[0]
    assert not any("core" in line for line in pour_lines(made, skin))
    assert "but not the inserts" in prepare_lines(made)[0]


def test_the_sheet_has_the_silicone_of_the_scene(paper_mold) -> None:
    printed = as_printed({name: paper_mold.shell(name, 0.2, 0.4) for name in paper_mold.parts})
    named = sheet("mine", paper_mold, printed, silicone_named("Dragon Skin 20"))
    unnamed = sheet("mine", paper_mold, printed)
    heads = ["SILICONE", "PARTS", "PRINT", "FRICTION FACE", "CURE INHIBITION", "GAUGES", "MIX", "POUR"]
    for text in (named, unnamed):
        assert [line for line in text.splitlines() if line.isupper()] == heads
    assert "Dragon Skin 20" in named
    assert "g of A" in named
    assert "g of A" not in unnamed
    assert 'silicone = "NAME"' in unnamed
