"""What effects that are off would change, and the advice on it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.accuracy import model_error as module
from finger3d.accuracy.changes import Change, ChangeEstimate, changing_numbers, natural_scales
from finger3d.accuracy.model_error import advise, judged_large_deformation, largest_principal_strain
from finger3d.cli import main
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings import Marker, Taxel
from finger3d.objects import Sphere
from finger3d.report.press import press_page
from tests.models import ended, half_cylinder
from tests.scenes import HALF_CYLINDER, changed, words, written

COARSE = 0.3


def test_the_change_by_large_deformation_is_that_of_the_press_at_large_deformation() -> None:
    model = half_cylinder(COARSE)
    own = changing_numbers(*ended(model))
    found = judged_large_deformation(model)
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
    estimate = judged_large_deformation(model).estimate.of_press(own)
    truth = changing_numbers(*ended(LargeDeformation().apply(model)))
    for name in ("gauge_b", "normal_force_N"):
        change = estimate.changes[name]
        assert change.low <= truth[name] - own[name] <= change.high
    assert not estimate.changes["gauge_b"].significant


def failing(monkeypatch: pytest.MonkeyPatch, when: Any) -> None:
    pressed = module.rough_steps

    def press(problem: Any) -> Any:
        if when(problem.model):
            raise Finger3dError("it did not converge")
        return pressed(problem)

    monkeypatch.setattr(module, "rough_steps", press)


def test_the_strain_decides_where_a_press_at_large_deformation_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """The change stays within four times the strain, relative to the scale of the number."""
    deep, shallow = half_cylinder(COARSE), replace(half_cylinder(COARSE), legs=(Leg(0.02, steps=4),))
    truth, own = (changing_numbers(*ended(one)) for one in (LargeDeformation().apply(deep), deep))
    failing(monkeypatch, lambda model: model.finite_strain)
    assert judged_large_deformation(deep).used
    assert not judged_large_deformation(shallow).used
    for name, change in judged_large_deformation(deep).estimate.changes.items():
        assert change.low <= truth[name] - own[name] <= change.high


def test_a_change_is_significant_if_its_interval_is_narrow_and_the_change_large() -> None:
    found = Change(10.0, 3.0, 0.9, 10.0)
    assert found.significant
    assert (found.low, found.high) == (2.1, 3.9)
    # within a third of an estimate d lies what is within a factor of 1.5 of it: 2/3 d to 4/3 d
    assert found.low > 3.0 / 1.5
    assert not Change(10.0, 3.0, 1.1, 10.0).significant
    assert not Change(0.1, 0.0009, 1e-5, 0.1).significant  # less than a hundredth of the scale
    assert not Change(0.0, 0.0, 0.0, 0.0).significant


def test_the_interval_holds_how_far_the_coarse_press_is_from_the_press() -> None:
    coarse = ChangeEstimate(
        changes={"normal_force_N": Change(10.0, 1.0, 0.1, 10.0), "other": Change(1.0, 0.0, 0.0, 1.0)}
    )
    (found,) = coarse.of_press({"normal_force_N": 10.5}).changes.values()
    assert (found.value, found.change, found.error) == (10.5, 1.0, 0.5)


def test_a_number_counts_relative_to_what_it_is_a_part_of() -> None:
    model = replace(
        half_cylinder(0.3), friction=Coulomb(0.25), gauges=(Gauge("a", 1.0, 4.0), Gauge("b", 1.0, 3.0)),
        markers=(Marker("m", 0.0, 4.0, 0.0),), taxels=(Taxel("t", 0.0, 0.0, 1.0, 1.0),),
    )  # fmt: skip
    design = model.design
    numbers = {
        "normal_force_N": 8.0, "friction_sum_N": 0.1, "contact_half_length_mm": 2.0, "stick_half_length_mm": 0.1,
        "contact_area_mm2": 5.0, "stick_area_mm2": 0.0, "gauge_a": -0.01, "gauge_b": 1e-4, "marker_m_x_mm": 1e-3,
        "taxel_t_MPa": 1e-3,
    }  # fmt: skip
    base = 2.0 * design.half_length_mm * design.width_mm
    assert natural_scales(model, 0.5, numbers) == pytest.approx(
        {
            "normal_force_N": 8.0, "friction_sum_N": 0.25 * 8.0, "contact_half_length_mm": 2.0,
            "stick_half_length_mm": 2.0, "contact_area_mm2": 5.0, "stick_area_mm2": 5.0,
            "gauge_a": 0.5 / design.height_mm, "gauge_b": 0.5 / design.height_mm, "marker_m_x_mm": 0.5,
            "taxel_t_MPa": 8.0 / base,
        }
    )  # fmt: skip
    assert natural_scales(model, 0.5, {**numbers, "gauge_a": 0.3})["gauge_b"] == 0.3


SHALLOW = changed(HALF_CYLINDER, steps=5, size_mm=0.2)
DEEP = changed(HALF_CYLINDER, depth_mm=1.0, size_mm=0.2)
"""Principal strains of about 0.2."""


def test_a_line_of_advice_tells_changes_with_their_intervals() -> None:
    changes = {
        "normal_force_N": Change(10.0, 1.9, 0.2, 10.0),
        "friction_sum_N": Change(4.0, 1.0, 0.9, 4.0),
        "gauge_a": Change(-0.02, 0.0058, 0.0004, 0.02),  # its magnitude falls
        "gauge_b": Change(0.001, 0.01, 0.001, 0.02),
        "gauge_c": Change(0.01, 0.001, 0.0001, 0.02),
        "gauge_d": Change(0.01, 0.002, 0.0001, 0.02),
    }
    model = replace(half_cylinder(COARSE), gauges=tuple(Gauge(name, 1.0, 4.0) for name in "abcd"))
    large = advise(model, 0.2, ChangeEstimate(changes=changes))[0]
    told = [
        "+19 % (+17 to +21 %)", "gauge_b by +0.01 (+0.009 to +0.011)", "gauge_a by -29 % (-31 to -27 %)",
        "gauge_d by +20 % (+19 to +21 %)", "[effects.large_deformation]",
    ]  # fmt: skip
    places = [large.index(text) for text in told]
    assert places == sorted(places)
    assert not any(name in large for name in ("friction", "gauge_c"))


def test_without_a_known_change_no_number_is_told() -> None:
    model, unknown = half_cylinder(COARSE), {"normal_force_N": Change(10.0, 1.9, 2.0, 10.0)}
    for estimate in (None, ChangeEstimate(method="no estimate: why"), ChangeEstimate(changes=unknown)):
        line, *_ = advise(model, 0.2, estimate)
        assert "0.2" in line
        assert "[effects.large_deformation]" in line
        assert "%" not in line
        assert not any("%" in line for line in advise(model, 0.06, estimate))
    assert not any("large_deformation" in line for line in advise(LargeDeformation().apply(model), 0.2))


def test_the_singular_corners_do_not_count_as_strain() -> None:
    strain = np.zeros((1000, 3, 3))
    strain[:, 0, 0] = -0.07
    strain[:5] *= 100.0
    assert largest_principal_strain(strain) == pytest.approx(0.07, rel=1e-12)


def test_a_press_tells_what_large_deformation_would_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(DEEP, encoding="utf-8")
    told = finger3d.press(scene, tmp_path / "told", figures=False).summary()
    found = json.loads((tmp_path / "told" / "summary.json").read_text(encoding="utf-8"))["model_error"]
    force = found["large_deformation"]["normal_force_N"]
    assert set(force) == {"change", "low", "high"}
    value = told["steps"][-1]["normal_force_N"]
    line = next(text for text in told["advice"] if "[effects.large_deformation]" in text)
    assert f" {float(format(100.0 * force['change'] / value, '.2g')):+g} % (" in line
    page = words(press_page(tmp_path / "told").write(tmp_path / "told"))
    assert f"normal_force_N {force['change']:.5g} {force['low']:.5g} {force['high']:.5g}" in page

    def forbidden(*_: Any) -> Any:
        raise AssertionError("estimated under --no-error")

    monkeypatch.setattr(module, "Judgement", forbidden)
    alone = finger3d.press(scene, tmp_path / "alone", error=False).summary()
    assert alone["steps"] == told["steps"]  # to the last digit
    assert alone["model_error"] == {}
    assert any("[effects.large_deformation]" in text for text in alone["advice"])


@pytest.mark.slow
def test_advice_comes_with_numbers_and_goes_when_it_is_followed(tmp_path: Path) -> None:
    said = {}
    for name, keys in {
        "small": ["press.depth_mm=1.0"],
        "large": ["press.depth_mm=1.0", "effects.large_deformation={}", "press.steps=60"],
        "viscous": ["press.depth_mm=1.0", "press.duration_s=1.0", "effects.viscosity={prony=[[0.3, 0.5]]}"],
        "auto": ["press.steps=auto", "press.depth_mm=0.05"],
    }.items():
        out = tmp_path / name
        settings = [word for key in keys for word in ("--set", key)]
        assert main(["press", str(written(tmp_path, SHALLOW)), "--out", str(out), "--no-figures", *settings]) == 0
        said[name] = " ".join(json.loads((out / "summary.json").read_text(encoding="utf-8"))["advice"])
    assert "% (" in said["small"]
    assert "% (" in said["viscous"]
    assert "[effects.large_deformation]" in said["small"]
    assert "[effects.large_deformation]" in said["viscous"]
    assert "large_deformation" not in said["large"]
    assert "% (" not in said["large"] + said["auto"]
    assert "finger3d compare" in said["large"]
