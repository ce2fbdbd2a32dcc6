"""Comparison of plane and solid models: limits of small and large width, error bars, and the verdict."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from finger3d.accuracy.companions import FACTOR
from finger3d.accuracy.estimate import estimate
from finger3d.analyses.compare import cases
from finger3d.analyses.compare.cases import press_with_errors, resized, widened
from finger3d.analyses.compare.run import compare
from finger3d.analyses.compare.verdict import Deviation, crossing_width, deviation, force_deviation, rounded, verdict
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.build import build
from finger3d.mechanics.solve import march
from finger3d.results.comparison import FORCE, Case
from finger3d.scene import load
from tests.scenes import SWEPT_FINGER


@pytest.fixture
def scene(tmp_path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SWEPT_FINGER)
    return path


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    path = folder / "scene.toml"
    path.write_text(SWEPT_FINGER)
    return compare(path, folder / "out", widths=[5.0, 200.0, 1200.0])


def case(model: str, width: float, force: float, error: float = 0.0, **more: float) -> Case:
    numbers = {
        FORCE: force, "contact_length_mm": 70.0, "stick_length_mm": 10.0, "friction_sum_N_per_mm": 1.0,
        "friction_along_x_N_per_mm": 1.0, "friction_along_z_N_per_mm": 0.5, "peak_pressure_MPa": 0.3,
    }  # fmt: skip
    return Case(model, width, 2.0, "swept", Outcome.CONVERGED, numbers | more, {FORCE: error})


def force(compared, model: str, width: float) -> float:
    (found,) = (c for c in compared.cases if (c.model, c.width_mm) == (model, width))
    return found.numbers[FORCE]


def test_a_solid_passes_from_plane_stress_to_plane_strain_as_it_widens(compared) -> None:
    forces = [force(compared, "solid", w) for w in (5.0, 20.0, 200.0, 1200.0)]
    assert forces == sorted(forces)
    assert force(compared, "plane stress", 5.0) < forces[0]
    assert forces[-1] < force(compared, "plane strain", 1200.0) < 1.06 * forces[-1]


def test_held_ends_make_plane_strain_of_a_narrow_solid(compared) -> None:
    assert force(compared, "solid, ends held", 20.0) == pytest.approx(force(compared, "plane strain", 20.0), rel=5e-3)


def test_the_verdict_of_the_papers_finger(compared) -> None:
    text = " ".join(compared.verdict)
    (percent,) = re.findall(r"At width/height 0.4 .* plane strain overstates the force by (\d+) %", text)
    assert 70 <= int(percent) <= 78
    assert "plane stress understates it by" in text
    (width,) = re.findall(r"Plane strain is within 5 % .* from a width of (\d+) mm", text)
    assert 700 <= int(width) <= 1000
    assert "Gauge g36: solid" in text
    assert compared.outcome.ok


def test_what_is_written_agrees_with_what_is_returned(compared) -> None:
    told = json.loads((compared.out / "compare.json").read_text())
    assert told["outcome"] == "converged"
    assert tuple(told["verdict"]) == compared.verdict
    assert [c["numbers"][FORCE] for c in told["cases"]] == [c.numbers[FORCE] for c in compared.cases]
    with (compared.out / "compare.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(r[FORCE]) for r in rows] == [c.numbers[FORCE] for c in compared.cases]
    assert rows[0]["contact_length_end_mm"] == ""
    with (compared.out / "lines.csv").open() as stream:
        lines = list(csv.DictReader(stream))
    assert {r["line"] for r in lines if r["model"] == "solid"} == {"z = 0", "end"}
    assert {r["line"] for r in lines if r["model"] == "plane strain"} == {"z = 0"}
    assert (compared.out / "compare.png").read_bytes().startswith(b"\x89PNG")
    assert load(compared.out / "scene.toml").domain == "solid"


def test_models_of_one_width_share_their_in_plane_mesh(compared) -> None:
    for width in (5.0, 20.0, 200.0, 1200.0):
        assert len({c.size_mm for c in compared.cases if c.width_mm == width and "held" not in c.model}) == 1


@pytest.mark.parametrize("domain", ["plane-strain", "plane-stress"])
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_error_bars_hold_the_answer_of_a_fine_mesh(scene, domain, nu) -> None:
    model = load(scene, [f"model.domain={domain}", f"material.nu={nu}"]).model()
    fine = cases.press_without_errors("fine", resized(model, 0.4))
    for size in (5.0, 3.0, 2.0):
        coarse = press_with_errors("coarse", resized(model, size))
        for key in (FORCE, "contact_length_mm"):
            # error bars claim a factor 2, see validation/error_bars.py
            assert abs(coarse.numbers[key] - fine.numbers[key]) <= 2.0 * coarse.errors[key], (size, key)
        assert coarse.errors[FORCE] < 0.003 * size * coarse.numbers[FORCE]


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_case_has_the_very_bars_of_a_press(scene, domain) -> None:
    model = load(scene, [f"model.domain={domain}"]).model()
    case = press_with_errors(domain, model)
    problem = build(model)
    # what a press spends decides how its increments are judged: so much that four times as many are affordable here
    frames = tuple(march(problem))
    bars = estimate(problem, frames)
    main = {FORCE: "normal_force_N", "friction_sum_N_per_mm": "friction_sum_N", "gauge_g36": "gauge_g36"}
    main |= {"contact_length_mm": "contact_half_length_mm", "stick_length_mm": "stick_half_length_mm"}
    # the same problem but for the points that never touch: round-off apart, the error of the mesh is the very same
    found = estimate(problem, frames, numbers=lambda p, f: cases.quantities(p.points, f))
    for key, name in main.items():
        times = 2.0 if "length" in key else 1.0 if "gauge" in key else 1.0 / model.design.width_mm
        assert found.discretisation[key] == pytest.approx(times * bars.discretisation[name], rel=1e-6), key
        assert found.steps[key] == pytest.approx(times * bars.steps[name], rel=1e-6, abs=1e-12), key
        assert case.errors[key] >= 0.999999 * found.discretisation[key], key
    assert set(case.errors) == set(case.numbers)


@pytest.mark.parametrize("width", [1.0, 20.0, 2000.0])
def test_other_widths_are_structured_and_have_room_for_the_companion(scene, width) -> None:
    wide = widened(load(scene, ["mesh.mesher=ftetwild"]).model(), width)
    assert (wide.design.width_mm, wide.mesh.mesher) == (width, "swept")
    assert wide.mesh.size_mm * FACTOR <= min(width, 50.0)
    assert wide.mesh.base_size_mm / wide.mesh.size_mm == pytest.approx(12.0 / 5.0)


def test_the_width_is_interpolated_in_one_over_width() -> None:
    # deviation = 40/width exactly: 5 % at 800
    found = [Deviation(w, 40.0 / w, 0.1 * 40.0 / w) for w in (200.0, 20.0, 1000.0)]
    at, low, high = crossing_width(found, narrow=False)
    assert at == pytest.approx(800.0)
    assert (low, high) == (pytest.approx(720.0), pytest.approx(880.0))


def test_narrow_enough_for_plane_stress_is_an_upper_width() -> None:
    found = [Deviation(w, -0.002 * w, 0.0) for w in (5.0, 20.0, 50.0)]
    assert crossing_width(found, narrow=True)[0] == pytest.approx(25.0)


def test_a_width_that_was_not_asked_for_is_not_made_up() -> None:
    assert crossing_width([Deviation(20.0, 0.7, 0.01), Deviation(200.0, 0.2, 0.01)], narrow=False) is None
    solids = [case("solid", w, f) for w, f in ((20.0, 10.0), (200.0, 15.0))]
    planes = [case("plane strain", w, 18.0) for w in (20.0, 200.0)]
    text = " ".join(verdict([*planes, *solids], 20.0, 50.0))
    assert re.search(r"Plane strain is not within 5 % .* \(\+20 % at 200 mm, .*at about 800 mm", text)


def test_no_width_is_guessed_from_a_narrow_finger() -> None:
    cases = [case("solid", w, f) for w, f in ((20.0, 10.0), (50.0, 11.0))]
    cases += [case("plane strain", w, 18.0) for w in (20.0, 50.0)]
    assert "1/width" not in " ".join(verdict(cases, 20.0, 50.0))


def test_an_error_bar_that_leaves_the_widths_asked_says_on_which_side() -> None:
    forces = {"solid": (10.0, 10.4), "plane strain": (11.0, 10.8), "plane stress": (9.7, 9.0)}
    cases = [case(m, w, f, 0.15) for m, both in forces.items() for w, f in zip((20.0, 200.0), both, strict=True)]
    cases = [replace(c, mesher="ftetwild") for c in cases]
    text = " ".join(verdict(cases, 20.0, 50.0))
    assert re.search(r"from a width of [\d.]+ mm \(error bar [\d.]+ to more than 200\)", text)
    assert re.search(r"up to a width of [\d.]+ mm \(error bar less than 20 to [\d.]+\)", text)


def test_within_everywhere_is_said_so() -> None:
    found = [case(m, w, 10.0 + 0.1 * (m == "plane strain")) for m in ("plane strain", "solid") for w in (20.0, 200.0)]
    assert re.search(r"Plane strain is within 5 % .*, 20 to 200 mm\.", " ".join(verdict(found, 20.0, 50.0)))


def test_a_deviation_carries_both_error_bars() -> None:
    d = deviation(case("plane strain", 20.0, 15.0, 0.15), case("solid", 20.0, 10.0, 0.2))
    assert (d.value, d.error) == (pytest.approx(0.5), pytest.approx(1.5 * (0.01**2 + 0.02**2) ** 0.5))


def test_on_swept_meshes_a_common_error_cancels() -> None:
    plane, solid = case("plane strain", 20.0, 15.0, 0.15), case("solid", 20.0, 10.0, 0.1)
    plane, solid = replace(plane, companion={FORCE: 15.3}), replace(solid, companion={FORCE: 10.2})
    # both change by 2 %, so the deviation does not: of the bar of two unrelated errors a quarter is kept
    apart = force_deviation(plane, replace(solid, mesher="ftetwild")).error
    assert force_deviation(plane, solid).error == pytest.approx(0.25 * apart, rel=1e-12)
    assert apart > 0.01


def test_a_deviation_within_its_error_bar_of_the_limit_is_not_significant() -> None:
    told = verdict([case("plane strain", 20.0, 10.52, 0.1), case("solid", 20.0, 10.0, 0.1)], 20.0, 50.0)[-1]
    assert "not significantly more or less than 5 % in force (+5.2 %)" in told


def test_an_object_that_twists_has_a_moment_that_no_section_has() -> None:
    solid = case("solid", 20.0, 10.0)
    solid.numbers["moment_y_Nmm_per_mm"] = 3.25
    for turns in (True, False):
        told = " ".join(verdict([case("plane strain", 20.0, 10.0), solid], 20.0, 50.0, turns))
        assert ("torsion has no 2D model" in told) == turns
        assert ("solid 3.25" in told) == turns


def test_without_a_solid_there_is_no_verdict() -> None:
    failed = Case("solid", 20.0, 2.0, "swept", Outcome.NO_CONVERGENCE)
    text = verdict([case("plane strain", 20.0, 10.0), failed], 20.0, 50.0)
    assert text[0].startswith("solid, 20 mm wide, has no result: contact did not settle")
    assert text[-1].startswith("No verdict")


@pytest.mark.parametrize(("value", "text"), [(123.4, "120"), (8.16e2, "820"), (0.0567, "0.057")])
def test_rounded_numbers_have_no_exponent(value, text) -> None:
    assert rounded(value) == text


@pytest.mark.parametrize(
    ("overrides", "widths", "words"),
    [
        (["press.slide_z_mm=1.0"], [], "slide along its width"),
        (["gauge.0.z_mm=9.0"], [10.0], 'gauge "g36" at z_mm = 9 is outside a finger 10 mm wide'),
        ([], [0.0], "--widths 0: must be positive"),
        ([], [float("nan")], "--widths nan: must be positive"),
    ],
)
def test_what_a_section_cannot_stand_for_is_refused(scene, tmp_path, overrides, widths, words) -> None:
    with pytest.raises(Finger3dError, match=re.escape(words)):
        compare(load(scene, overrides), tmp_path / "out", widths)
    assert not (tmp_path / "out").exists()


def test_a_ball_has_no_section(scene, tmp_path) -> None:
    ball = '[finger]\ngeometry = "hemisphere"\nradius_mm = 50.0\n[material]'
    text = re.sub(r"\[finger\].*?\[material\]", ball, SWEPT_FINGER, flags=re.S)
    scene.write_text(text.replace('mesher = "swept"\n', "").replace("y_mm = 38.0", "y_mm = 20.0"))
    with pytest.raises(Finger3dError, match="no constant section"):
        compare(scene, tmp_path / "out")


def test_an_object_that_varies_along_the_width_is_pointed_out(scene, tmp_path) -> None:
    told = compare(load(scene, ["object.shape=sphere", "object.radius_mm=200.0"]), tmp_path / "out", ()).verdict
    assert any("changes along the width" in line for line in told)


def test_the_scenes_own_domain_does_not_matter(scene, tmp_path) -> None:
    as_strain = compare(load(scene, ["model.domain=plane-strain"]), tmp_path / "a", ())
    as_solid = compare(load(scene), tmp_path / "b", ())
    assert [c.numbers for c in as_strain.cases] == [c.numbers for c in as_solid.cases]
