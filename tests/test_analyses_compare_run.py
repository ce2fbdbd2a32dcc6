"""Comparison of plane and solid models: limits of small and large width, error bars, and the verdict."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from finger3d.analyses.compare.run import compare
from finger3d.errors import Finger3dError
from finger3d.results.comparison import FORCE
from finger3d.scene import load
from tests.scenes import SWEPT_FINGER, written


@pytest.fixture
def scene(tmp_path) -> Path:
    return written(tmp_path, SWEPT_FINGER)


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    path = folder / "scene.toml"
    path.write_text(SWEPT_FINGER)
    return compare(path, folder / "out", widths=[5.0, 200.0, 1200.0])


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
    text = "\n".join(compared.verdict)
    (percent,) = re.findall(r"width/height 0\.4 .* plane strain overstates\D* (\d+) %", text)
    assert 70 <= int(percent) <= 78
    assert "plane stress understates" in text
    (width,) = re.findall(r"^Plane strain .*\b5 % .* (\d+) mm", text, re.MULTILINE)
    assert 700 <= int(width) <= 1000
    assert "gauge g36" in text
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


@pytest.mark.parametrize(
    ("overrides", "widths", "words"),
    [
        (["press.slide_z_mm=1.0"], [], "slide"),
        (["gauge.0.z_mm=9.0"], [10.0], 'gauge "g36" at z_mm = 9'),
        ([], [0.0], "--widths 0"),
        ([], [float("nan")], "--widths nan"),
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
    with pytest.raises(Finger3dError, match="section"):
        compare(scene, tmp_path / "out")


def test_an_object_that_varies_along_the_width_is_pointed_out(scene, tmp_path) -> None:
    told = compare(load(scene, ["object.shape=sphere", "object.radius_mm=200.0"]), tmp_path / "out", ()).verdict
    assert any("width" in line for line in told)


def test_the_scenes_own_domain_does_not_matter(scene, tmp_path) -> None:
    as_strain = compare(load(scene, ["model.domain=plane-strain"]), tmp_path / "a", ())
    as_solid = compare(load(scene), tmp_path / "b", ())
    assert [c.numbers for c in as_strain.cases] == [c.numbers for c in as_solid.cases]


def test_a_scene_that_leaves_the_mesh_to_a_tolerance_is_refused(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(Finger3dError, match=r"scene.toml: mesh.tolerance = 0.01: compare needs fixed edge lengths"):
        compare(scene, tmp_path / "out", overrides=["mesh={tolerance=0.01}"])
    assert not (tmp_path / "out").exists()
