"""Designs by their names."""

from __future__ import annotations

import dataclasses

from finger3d.geometry.registry import designs
from tests.designs import GOOD


def test_every_design_is_listed_by_its_name() -> None:
    assert set(designs()) == set(GOOD)
    for name, design in designs().items():
        assert design.name == name
        assert dataclasses.is_dataclass(design)
        assert design.__module__ == f"finger3d.geometries.{name}"
        assert [f.name for f in dataclasses.fields(design)] == list(GOOD[name])
