"""The record of a press: its summary and its warnings."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import trimesh

from finger3d.cli import main
from tests.scenes import BLOCK, HALF_CYLINDER, changed, written

SECTION = changed(HALF_CYLINDER, steps=5, size_mm=0.2)


def test_effects_and_warnings_are_told(tmp_path: Path) -> None:
    text = SECTION + '[effects.kinetic_friction]\nratio = 0.5\nbranch = "paper"\n'
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, text)), "--out", str(out), "--no-figures"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["effects"] == ["kinetic_friction"]
    assert any("stuck" in w for w in summary["warnings"])


def test_uniqueness_is_reported_and_warned_of(tmp_path: Path) -> None:
    found = {}
    for mu in ("0.25", "1000.0"):
        out = tmp_path / mu
        main(
            ["press", str(written(tmp_path, SECTION)), "--out", str(out), "--no-figures", "--set", f"friction.mu={mu}"]
        )
        found[mu] = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    ratio = found["1000.0"]["uniqueness"]["largest_coupling"] / found["0.25"]["uniqueness"]["largest_coupling"]
    assert ratio == pytest.approx(4000.0, rel=1e-9)
    assert not found["0.25"]["warnings"]
    assert any("states" in w for w in found["1000.0"]["warnings"])


@pytest.mark.parametrize(("key", "text"), [("press.depth_mm=3.0", "small strain"), ("mesh.size_mm=0.9", "touch")])
def test_a_scene_beyond_what_can_be_trusted_is_warned_of(tmp_path: Path, key: str, text: str) -> None:
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, SECTION)), "--out", str(out), "--no-figures", "--set", key]) == 0
    assert any(text in w for w in json.loads((out / "summary.json").read_text(encoding="utf-8"))["warnings"])


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_an_object_narrower_than_two_edges_is_warned_of_with_an_edge_length_that_resolves_it(
    tmp_path: Path, domain: str
) -> None:
    trimesh.creation.box((1.7, 3.0, 40.0)).export(tmp_path / "bar.stl")
    text = (
        changed(BLOCK, domain=domain, half_length_mm=4.0, width_mm=2.0) + '[object]\nshape = "mesh"\npath = "bar.stl"\n'
    )
    scene = written(tmp_path, text)

    def said(size: str) -> list[str]:
        command = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
        assert main([*command, "--set", "mesh.mesher=swept", "--set", f"mesh.size_mm={size}"]) == 0
        summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
        return [line for line in summary["warnings"] if " touch" in line]

    (line,) = said("1.0")
    assert not said(re.findall(r"mesh\.size_mm = ([\d.]+) has enough", line)[0])


def test_a_light_press_by_default_has_enough_points(tmp_path: Path) -> None:
    text = re.sub(r"\[mesh\][^[]*", "", changed(HALF_CYLINDER, steps=2, depth_mm=0.01))
    out = tmp_path / "out"
    assert main(["press", str(written(tmp_path, text)), "--out", str(out), "--no-figures", "--no-error"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert not [line for line in summary["warnings"] if " touch" in line]


def test_a_deep_press_at_finite_strain_is_not_warned_of_small_strain(tmp_path: Path) -> None:
    settings = {"small": [], "large": ["--set", "effects.large_deformation={}"]}
    said = {}
    for name, more in settings.items():
        command = ["press", str(written(tmp_path, changed(SECTION, depth_mm=1.6))), "--out", str(tmp_path / name)]
        assert main([*command, "--no-figures", "--no-error", *more]) == 0
        said[name] = json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))["warnings"]
    assert len(said["small"]) == 1
    assert not said["large"]
