"""Shorter edges at the border of stick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.borders import stick_borders, with_refined_borders
from finger3d.accuracy.estimate import estimate, main_numbers
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarser
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model
from finger3d.scene import scene_of
from tests.logs import Log
from tests.models import half_cylinder, swept_fig9

STICK_MM2 = 180.4
"""Area of stick on Fig. 9 (nu = 0.49, mu = 0.25, 20 increments) with edges of 0.25 mm at its border."""


def refined(model: Model, factor: float) -> tuple[Problem, Problem, Log]:
    said, finer = Log(), replace(model, mesh=replace(model.mesh, stick_refinement=factor))
    return build(finer), with_refined_borders(finer, said), said


@pytest.mark.slow
def test_the_area_of_a_thin_stick_zone_becomes_known() -> None:
    model = replace(swept_fig9(2.0, mu=0.25, nu=0.49), legs=(Leg(10.0, steps=20),))
    before, after, said = refined(model, 3.0)
    assert [line for line in said.lines if "border of stick" in line] == [
        "border of stick: edges of 1 mm",
        "border of stick: edges of 0.667 mm",
    ]
    found = []
    for problem in (before, after):
        steps = list(march(problem))
        bar = estimate(problem, steps).discretisation["stick_area_mm2"]
        found.append((main_numbers(problem, steps[-1])["stick_area_mm2"], bar))
    (coarse, unknown), (fine, bar) = found
    assert abs(coarse - STICK_MM2) <= 2.0 * unknown
    assert unknown > 0.3 * coarse
    assert abs(fine - STICK_MM2) <= min(2.0 * bar, 0.05 * STICK_MM2)
    assert bar <= 0.12 * fine
    # the body has hardly more unknowns than twice as many; edges of 0.667 mm everywhere would take ten times as many
    assert after.size.dofs < 2.5 * before.size.dofs


@pytest.mark.parametrize("mu", [0.0, 5.0])
@pytest.mark.parametrize("gauge_refinement", [1.0, 2.0])
def test_without_a_border_of_stick_the_mesh_stays(mu: float, gauge_refinement: float) -> None:
    plain = half_cylinder(0.4)
    mesh = replace(plain.mesh, gauge_refinement=gauge_refinement)
    before, after, said = refined(replace(plain, friction=Coulomb(mu), mesh=mesh), 4.0)
    assert np.array_equal(after.mesh.points, before.mesh.points)
    assert after.model == before.model
    assert not [line for line in said.lines if "border of stick" in line]
    # found on a mesh without shorter edges around the gauge
    assert sum("condensing" in line for line in said.lines) == gauge_refinement


def test_borders_of_a_section_lie_in_its_mesh_and_are_those_at_the_ends_of_legs() -> None:
    legs = (Leg(0.5, steps=5), Leg(1.0, steps=5))
    problem, after, _ = refined(replace(half_cylinder(0.3), friction=Coulomb(0.2), legs=legs), 2.0)
    borders = after.model.mesh.borders
    assert borders is not None
    steps = list(march(problem))
    places = stick_borders(problem, [steps[4], steps[9]])
    np.testing.assert_array_equal(borders.places, places)
    assert len(places) == 2
    assert (places[:, 0] >= 0.0).all()
    # a companion is coarser there, too
    assert coarser(after.model).mesh.borders.size == pytest.approx(2.0 * borders.size)  # type: ignore[union-attr]
    edges = np.diff(np.unique(after.points.points[:, 0]))
    assert edges.min() == pytest.approx(0.15, rel=0.35)


FIG9 = {
    "finger": {
        "geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
        "width_mm": 20.0,
    },
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "friction": {"mu": 0.25},
    "press": {"depth_mm": 5.0},
    "gauge": [{"name": "g", "x_mm": 30.0, "y_mm": 40.0}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "refinement"),
    [
        ({}, 3.5),
        ({"mesh": {"stick_refinement": 1.0}}, 1.0),
        ({"mesh": {"size_mm": 2.0}}, 1.0),
        ({"mesh": {"tolerance": 0.02}}, 1.0),
        ({"friction": {"mu": 0.0}}, 1.0),
        ({"press": {"force_N": 20.0}}, 1.0),
        ({"model": {"domain": "plane-strain"}}, 1.0),
        ({"effects": {"large_deformation": {}}}, 1.0),
    ],
)
def test_the_default_refines_solids_without_sizes(changes: dict[str, object], refinement: float) -> None:
    assert scene_of({**FIG9, **changes}).mesh.stick_refinement == refinement


def test_the_default_can_be_run_again_from_what_is_written() -> None:
    scene = scene_of(FIG9)
    assert scene.as_dict()["mesh"]["stick_refinement"] == 3.5
    assert scene_of(scene.as_dict()).mesh == scene.mesh
