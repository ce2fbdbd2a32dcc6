"""The price of a third of the error bars: against a press on that mesh, and where there is none."""

from __future__ import annotations

import re

import pytest

from finger3d.accuracy.price import price_of_a_third
from finger3d.mechanics.discretise.build import build
from tests.sensor_cases import scene


def numbers(text: str) -> tuple[float, float, float]:
    """Seconds, and the edge lengths of contact and base."""
    found = re.fullmatch(r"about (\S+) s and \S+ GB \(mesh.size_mm = (\S+), mesh.base_size_mm = (\S+)\)", text)
    assert found, text
    seconds, size, base = map(float, found.groups())
    return seconds, size, base


def test_edges_shrink_alike_and_time_grows_with_the_unknowns() -> None:
    problem = build(scene(mesh={"size_mm": 1.0, "base_size_mm": 4.0}).model())
    seconds, size, base = numbers(price_of_a_third(problem, 10, 1.0))
    assert base / size == pytest.approx(4.0, rel=5e-3)  # both have three digits
    assert 1 / 3 < size < 1 / 2  # at first order a third of the edges, at order 1.6 half of them
    assert 3.0 < seconds < 20.0  # in a section, of (1 / size)^2 = 6 times the unknowns


def test_a_solid_beyond_the_memory_says_so() -> None:
    solid = scene(model={"domain": "solid"}, mesh={"size_mm": 2.0, "base_size_mm": 6.0, "mesher": "swept"})
    problem = build(solid.model())
    text = price_of_a_third(problem, 10, 10.0)
    assert "GB" in text
    assert "mesh.size_mm" in text


def test_shorter_edges_at_the_border_of_stick_stay_with_the_sizes() -> None:
    # a scene with sizes has none by default, and its areas would get wider bars
    problem = build(scene(mesh={"size_mm": 1.0, "stick_refinement": 3.0}).model())
    assert price_of_a_third(problem, 10, 1.0).endswith("mesh.stick_refinement = 3)")
