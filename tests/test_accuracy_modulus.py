"""Errors due to the spread of Young's modulus."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from finger3d.accuracy.estimate import press_numbers
from finger3d.accuracy.modulus import modulus_errors
from finger3d.cli import main
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.materials.modulus import SPREAD_A
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings.reading import Taxel
from tests.models import half_cylinder, run
from tests.scenes import HALF_CYLINDER, changed

SPREAD = 0.25


def model_at(E_MPa: float, leg: Leg) -> Model:
    model = half_cylinder(0.4)
    gauges, taxels = (Gauge("g", 1.5, 3.5),), (Taxel("t", 0.0, 0.0, 1.0, 1.0),)
    material = Isotropic(E_MPa, 0.4)
    return replace(model, legs=(leg,), gauges=gauges, taxels=taxels, material=material)


def test_on_a_path_of_depths_numbers_scale_with_the_modulus() -> None:
    problem, steps = run(model_at(1.0, Leg(1.0, steps=8)))
    told, (found, reason) = (
        press_numbers(problem, steps[-1]),
        modulus_errors(problem, steps, {"": SPREAD}, press_numbers),
    )
    assert not reason
    assert found == pytest.approx({name: SPREAD * abs(told[name]) for name in found})
    assert set(found) == {name for name in told if name.endswith(("_N", "_mJ", "_Nmm", "_MPa"))}


def test_there_are_none_where_the_modulus_is_given() -> None:
    problem, steps = run(model_at(1.0, Leg(1.0, steps=2)))
    assert modulus_errors(problem, steps, {}, press_numbers) == ({}, "")
    assert modulus_errors(problem, [], {"": SPREAD}, press_numbers) == ({}, "")


def _to_forces(model: Model) -> Model:
    legs = (Leg(1.0, steps=4, force_N=1.5), Leg(1.0, slide_x_mm=0.2, steps=3, force_N=1.2))
    return replace(model, legs=legs)


@pytest.mark.parametrize(
    "changed_model",
    [
        _to_forces,
        lambda model: LargeDeformation().apply(_to_forces(model)),
        lambda model: ElasticObject(2.0, 0.3).apply(model),
        lambda model: Foil(300.0, 0.1, 0.5).apply(replace(model, gauges=(Gauge("g", 1.0, 4.2, length_mm=1.0),))),
        lambda model: replace(
            model,
            design=designs()["fingertip"](
                radius_mm=5.0, half_length_mm=4.0, edge_height_mm=3.0, width_mm=2.0, skin_mm=0.8
            ),
            parts=(("skin", Isotropic(3.0, 0.4)),),
        ),
    ],
    ids=["forces", "large deformation to forces", "elastic object", "foil", "elastic part"],
)
def test_elsewhere_they_are_half_the_change_between_both_ends_of_the_spread(
    changed_model: Callable[[Model], Model],
) -> None:
    def at(E_MPa: float) -> Model:
        return changed_model(replace(model_at(E_MPa, Leg(1.0, steps=4)), mesh=MeshOptions(0.2, 0.8, "swept")))

    problem, steps = run(at(1.0))
    found, reason = modulus_errors(problem, steps, {"": SPREAD}, press_numbers)
    told = press_numbers(problem, steps[-1])
    assert not reason
    soft, stiff = (press_numbers(*_last(run(at(1.0 + sign * SPREAD)))) for sign in (-1.0, 1.0))
    for name in set(told) & {"normal_force_N", "depth_mm", "gauge_g", "external_work_mJ", "taxel_t"}:
        change = 0.5 * abs(stiff[name] - soft[name])
        # on another mesh, whose error is some 5 % of the change, and more where that is small
        assert found.get(name, 0.0) == pytest.approx(change, rel=0.05, abs=0.02 * abs(told[name])), name


def _last(pressed: tuple) -> tuple:
    return pressed[0], pressed[1][-1]


def test_spreads_of_several_moduli_add_as_squares_and_each_counts_alone() -> None:
    tip = designs()["fingertip"](radius_mm=5.0, half_length_mm=4.0, edge_height_mm=3.0, width_mm=2.0, skin_mm=0.8)

    def at(skin: float) -> Model:
        model = replace(model_at(1.0, Leg(1.0, steps=4)), design=tip, mesh=MeshOptions(0.2, 0.8, "swept"))
        return replace(model, parts=(("skin", Isotropic(skin, 0.4)),))

    (problem, steps), stiff = run(at(3.0)), run(at(3.0 * (1.0 + SPREAD)))
    alone = {
        label: modulus_errors(problem, steps, {label: SPREAD}, press_numbers)[0]["normal_force_N"]
        for label in ("", "skin")
    }
    told, more = (press_numbers(*_last(one))["normal_force_N"] for one in ((problem, steps), stiff))
    # the change is not linear in E, by up to the spread
    assert alone["skin"] == pytest.approx(more - told, rel=SPREAD + 0.05)
    both = modulus_errors(problem, steps, {"": SPREAD, "skin": SPREAD}, press_numbers)[0]["normal_force_N"]
    assert both == pytest.approx(math.hypot(*alone.values()), rel=1e-9)
    # the force is proportional to both moduli together
    assert sum(alone.values()) == pytest.approx(SPREAD * told, rel=0.1)


def test_the_compliance_of_an_elastic_object_makes_them_smaller(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    text = changed(HALF_CYLINDER, domain="plane-strain", size_mm=0.3).replace("E_MPa = 1.0\n", "shore_A = 30\n")
    scene.write_text(text + "[effects.elastic_object]\nE_MPa = 2.0\nnu = 0.4\n", encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    share = summary["error_estimate"]["modulus"]["normal_force_N"] / summary["steps"][-1]["normal_force_N"]
    # two springs in series: the softer one has E = 1.14 MPa
    assert 0.3 * SPREAD_A < share < 0.9 * SPREAD_A


def test_table_page_and_summary_keep_them_apart_from_those_of_the_mesh(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    text = changed(HALF_CYLINDER, domain="plane-strain", size_mm=0.4)
    scene.write_text(text.replace("E_MPa = 1.0\n", "shore_A = 30\n"), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    bars, force = summary["error_estimate"], summary["steps"][-1]["normal_force_N"]
    spread = bars["modulus"]["normal_force_N"] / force
    assert spread == pytest.approx(SPREAD_A, rel=1e-9)
    assert bars["discretisation"]["normal_force_N"] < 0.05 * force
    said = f"+- {spread * force:.2g} N by the modulus"
    printed = next(line for line in capsys.readouterr().out.splitlines() if "normal force" in line)
    assert said in printed
    page = (out / "report.html").read_text(encoding="utf-8")
    assert said.replace("+-", "±").replace(" N by", " by") in page
    assert "of the modulus" in page
