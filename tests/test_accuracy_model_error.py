"""Effects judged by coarse presses with and without them, against the press itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from finger3d.accuracy import model_error as module
from finger3d.accuracy.changes import changing_numbers
from finger3d.accuracy.model_error import Judged, Judgement, at_large_deformation
from finger3d.contact.friction import Coulomb
from finger3d.effects import LARGE_DEFORMATION
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import Sphere
from tests.models import ended, half_cylinder

COARSE = 0.3


def large_deformation(model: Model, shortcut: bool = False) -> Judged:
    (found,) = Judgement(model, {LARGE_DEFORMATION: at_large_deformation}).found(shortcut).values()
    return found


def test_the_change_by_large_deformation_is_that_of_the_press_at_large_deformation() -> None:
    model = half_cylinder(COARSE)
    own = changing_numbers(*ended(model))
    found = large_deformation(model)
    estimate = found.estimate.of_press(own)
    truth = changing_numbers(*ended(LargeDeformation().apply(model)))
    assert found.used
    for name in ("normal_force_N", "friction_sum_N"):
        change = estimate.changes[name]
        assert change.low <= truth[name] - own[name] <= change.high
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
    own = changing_numbers(*ended(model))
    estimate = large_deformation(model).estimate.of_press(own)
    truth = changing_numbers(*ended(LargeDeformation().apply(model)))
    for name in ("gauge_b", "normal_force_N"):
        change = estimate.changes[name]
        assert change.low <= truth[name] - own[name] <= change.high
    assert not estimate.changes["gauge_b"].significant


def failing(monkeypatch: pytest.MonkeyPatch, when: Any) -> None:
    pressed = module.last_step

    def press(problem: Any, *more: Any, **options: Any) -> Any:
        if when(problem.model):
            raise Finger3dError("it did not converge")
        return pressed(problem, *more, **options)

    monkeypatch.setattr(module, "last_step", press)


def test_the_strain_decides_where_a_press_at_large_deformation_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """The change stays within four times the strain, relative to the scale of the number."""
    deep, shallow = half_cylinder(COARSE), replace(half_cylinder(COARSE), legs=(Leg(0.02, steps=4),))
    truth, own = (changing_numbers(*ended(one)) for one in (LargeDeformation().apply(deep), deep))
    failing(monkeypatch, lambda model: model.finite_strain)
    assert large_deformation(deep).used
    assert not large_deformation(shallow).used
    for name, change in large_deformation(deep).estimate.changes.items():
        assert change.low <= truth[name] - own[name] <= change.high


def test_what_cannot_be_judged_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    model, effects = half_cylinder(COARSE), {"kinetic_friction": KineticFriction(ratio=0.999).apply}
    assert not Judgement(model, effects).found()["kinetic_friction"].used
    failing(monkeypatch, lambda model: True)
    found = Judgement(model, effects | {LARGE_DEFORMATION: at_large_deformation}).found()
    assert all(one.used for one in found.values())


def test_large_strains_need_no_press_at_large_deformation(monkeypatch: pytest.MonkeyPatch) -> None:
    deep = replace(half_cylinder(COARSE), legs=(Leg(1.5, steps=4),))
    failing(monkeypatch, lambda model: model.finite_strain)
    found = large_deformation(deep, shortcut=True)
    assert found.used
    assert "strains" in found.why


def test_a_body_of_many_unknowns_is_judged_on_a_small_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundredth of a millimetre at the contact of a solid would take hours."""
    pressed = list[float]()

    def build(model: Model) -> None:
        pressed.append(model.mesh.size_mm)
        raise Finger3dError("enough")

    monkeypatch.setattr(module, "build", build)
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=11.2)
    large_deformation(Model(block, Isotropic(1.0, 0.4), MeshOptions(0.25, 0.25, "swept"), (Leg(0.5, steps=10),)))
    assert pressed[0] >= 1.0
