"""Points of a sweep: combinations of values, and the bodies that they need."""

from __future__ import annotations

import pytest

from finger3d.analyses.sweep.points import Vary, combinations
from tests.sweep_cases import points_of


def test_every_combination_is_a_point_and_only_the_material_makes_bodies(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,0.25", "material.nu=0.45,0.49", "gauge.g36.angle_deg=10,20")
    assert [p.number for p in sweep.points] == list(range(8))
    assert sweep.points[1].values == {"friction.mu": 0.06, "material.nu": 0.45, "gauge.g36.angle_deg": 20}
    assert len(sweep.bodies) == 2


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("friction.mu=0.06, 0.25,1", (0.06, 0.25, 1)),
        ("model.domain=solid,plane-strain", ("solid", "plane-strain")),
        ("effects.viscosity.prony=[[0.3,0.5]],[[0.1,1.0],[0.2,2.0]]", ([[0.3, 0.5]], [[0.1, 1.0], [0.2, 2.0]])),
        ('title="a,b",c', ("a,b", "c")),
    ],
)
def test_values_are_told_apart_by_commas_outside_brackets_and_quotes(text, values) -> None:
    assert Vary.of(text).values == values


def test_a_varied_modulus_or_silicone_replaces_what_the_scene_gives(paper_scene) -> None:
    named = ["material.silicone=Dragon Skin 20"]
    moduli = combinations(paper_scene, named, ["material.E_MPa=0.3,0.5"])
    assert [p.values["material.E_MPa"] for p in moduli.points] == [0.3, 0.5]
    assert len(moduli.bodies) == 2
    silicones = combinations(paper_scene, (), ['material.silicone="Ecoflex 00-30","dragon skin 20"'])
    assert len(silicones.bodies) == 2
