"""The casting sheet."""

from __future__ import annotations

from finger3d.materials.silicones import silicone_named
from finger3d.mold.packing import as_printed
from finger3d.mold.sheet import oversize, sheet
from finger3d.mold.shell import shell


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
