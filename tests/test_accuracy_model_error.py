"""The change by large deformation, estimated beside a press."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from finger3d._cost import PressSize
from finger3d.accuracy import model_error as module
from finger3d.accuracy.changes import changing_numbers
from finger3d.accuracy.model_error import large_deformation
from finger3d.contact.friction import Coulomb
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.fem.solids.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import Sphere
from tests.models import ended, fig9, half_cylinder, run

COARSE = 0.3


def test_the_change_by_large_deformation_is_that_of_the_press_at_large_deformation() -> None:
    model = half_cylinder(COARSE)
    problem, frames = run(model)
    estimate = large_deformation(problem, frames[-1], len(frames))
    truth = changing_numbers(*ended(LargeDeformation().apply(model)))
    assert {"normal_force_N", "friction_sum_N"} <= set(estimate.significant)
    for name, change in estimate.significant.items():
        true = truth[name] - change.value
        assert 1.0 / 1.5 <= true / change.change <= 1.5  # what is claimed, validation/advice_against_truth.py
    assert estimate.method


def test_the_interval_of_a_number_that_no_coarse_mesh_resolves_holds() -> None:
    """The gauge is an edge length below a ball: its changes on both coarse meshes agree by chance, 3.3 times too large.

    The truth is the same press at large deformation.
    """
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=11.2)
    model = Model(
        block, Isotropic(1.0, 0.358), MeshOptions(1.05, 4.2, "swept"), (Leg(0.727, steps=10),),
        object=Sphere(radius_mm=10.0), friction=Coulomb(0.106), gauges=(Gauge("b", 0.0, 7.0),),
    )  # fmt: skip
    problem, step = ended(model)
    estimate = large_deformation(problem, step, 10)
    truth = changing_numbers(*ended(LargeDeformation().apply(model)))
    gauge = estimate.changes["gauge_b"]
    assert gauge.low <= truth["gauge_b"] - gauge.value <= gauge.high
    assert not gauge.significant
    force = estimate.changes["normal_force_N"]
    assert force.low <= truth["normal_force_N"] - force.value <= force.high


def test_no_change_is_told_where_none_can_be_estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, step = ended(half_cylinder(COARSE, 2))
    filled = replace(problem, model=KineticFriction(ratio=0.5).apply(problem.model))
    papers = replace(problem, model=replace(problem.model, rule="paper"))
    legs = tuple(replace(leg, force_N=1.0) for leg in problem.model.legs)
    forced = replace(problem, model=replace(problem.model, legs=legs))
    whole, end = ended(replace(half_cylinder(COARSE, 2), mesh=MeshOptions(5.0, 5.0, "swept")))
    for found, why in (
        (large_deformation(filled, step, 2), "kinetic_friction"),
        (large_deformation(papers, step, 2), "number of increments"),
        (large_deformation(whole, end, 2), "too coarse"),
        (large_deformation(forced, step, 2), "to a force"),
    ):
        assert found.changes == {}
        assert why in found.method

    reason = "a run did not converge"

    def fail(*_: Any) -> Any:
        raise Finger3dError(reason)

    monkeypatch.setattr(module, "last_step", fail)
    assert large_deformation(problem, step, 2).method.endswith(reason)


def test_a_body_of_a_million_unknowns_is_judged_from_a_small_one(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = MeshOptions(0.9, 0.9, "swept")
    large = SimpleNamespace(
        model=fig9(mesh=mesh),
        size=PressSize(3, 1_009_778, 600),
    )
    pressed: list[Model] = []

    def build(model: Model) -> None:
        pressed.append(model)
        raise Finger3dError("enough")

    monkeypatch.setattr(module, "build", build)
    large_deformation(large, None, 10)  # type: ignore[arg-type]
    (model,) = pressed
    assert model.mesh.size_mm >= 2.5  # below 50 000 unknowns
