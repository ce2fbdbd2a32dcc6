"""The casting sheet."""

from __future__ import annotations

from finger3d.mold.output import as_printed
from finger3d.mold.sheet import oversize
from finger3d.mold.shell import shell


def test_a_part_larger_than_the_bed_is_told(paper_mold) -> None:
    part = as_printed({"lid": shell(paper_mold.parts["lid"], 0.05, "lid")})["lid"]
    assert oversize(part, (40.0, 220.0, 250.0)) == ""  # turned on the bed
    assert oversize(part, (100.0, 100.0, 250.0))
    assert oversize(part, (220.0, 220.0, 5.0))
