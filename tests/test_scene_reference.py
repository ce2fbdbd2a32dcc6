"""The table of all keys."""

from __future__ import annotations

import re


def test_the_reference_names_every_key_with_its_meaning() -> None:
    from finger3d.scene.reference import reference

    rows = [line.strip("| ").split(" | ") for line in reference().splitlines()[2:] if "**" not in line]
    assert len(rows) > 50
    assert all(row[-1].strip() for row in rows)
    keys = {row[0].strip("`") for row in rows}
    assert {
        "geometry",
        "edge_height_mm",
        "nu",
        "shape",
        "tilt_deg",
        "mu",
        "rule",
        "domain",
        "angle_deg",
        "prony",
    } <= keys


def test_the_template_names_every_design_shape_and_key_of_an_object() -> None:
    from importlib import resources

    from finger3d.geometry.registry import designs
    from finger3d.objects import OBJECTS
    from finger3d.scene.tables import table_of

    text = resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", text))
    assert {*designs(), *OBJECTS} <= words
    assert {key for record in OBJECTS.values() for key in table_of(record).model_fields} <= words
    assert {key for design in designs().values() for key in table_of(design).model_fields} <= words
