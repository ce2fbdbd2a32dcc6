"""Settings of viscosity: what is refused, and shares that are rounded."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.cli import main
from finger3d.effects.viscosity import (
    Effect,
)
from finger3d.errors import Finger3dError
from finger3d.scene import parse
from tests.viscous_cases import TWO, block, scene_of


@pytest.mark.parametrize(
    ("effect", "domain", "legs", "says"),
    [
        ({"prony": ((0.6, 1.0), (0.41, 2.0))}, "solid", None, r"effects\.viscosity: prony: .* 1"),
        ({"prony": ((-0.1, 1.0),)}, "solid", None, r"effects\.viscosity\.prony = .*above 0"),
        ({"prony": ((0.0, 1.0),)}, "solid", None, r"effects\.viscosity\.prony = .*above 0"),
        ({"prony": ((0.1, 0.0),)}, "solid", None, r"effects\.viscosity\.prony = .*above 0"),
        ({"prony": ()}, "solid", None, r"effects\.viscosity\.prony = \[\]: "),
        ({}, "solid", None, r"effects\.viscosity\.prony "),
        (
            {"prony": ((0.1, 1.0),)}, "solid", ({"depth_mm": 1.0, "duration_s": 1.0}, {"depth_mm": 0.5}),
            r"press\.leg\.1\.duration_s .*viscosity",
        ),
        ({"prony": ((0.1, 1.0),), "bulk": False}, "plane-stress", None, r"viscosity\.bulk = false: "),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(effect: dict, domain: str, legs: tuple | None, says: str) -> None:
    with pytest.raises(Finger3dError, match=says) as caught:
        parse(scene_of(effect, domain, legs) if legs else scene_of(effect, domain))
    assert "\n" not in str(caught.value)


def test_a_scene_without_durations_exits_2_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[finger]\ngeometry = "half_cylinder"\nradius_mm = 5.0\nwidth_mm = 2.0\n[material]\nE_MPa = 1.0\nnu = 0.3\n'
        "[press]\ndepth_mm = 0.5\n[effects.viscosity]\nprony = [[0.3, 0.5]]\n",
        encoding="utf-8",
    )
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 2
    assert "press.duration_s " in capsys.readouterr().err
    assert not (tmp_path / "out" / "summary.json").exists()


def test_shares_that_sum_to_more_than_1_by_rounding_are_scaled_and_told() -> None:
    model = Effect(((0.6, 1.0), (0.401, 2.0))).apply(block())
    assert any("sum to 1.001" in text for text in model.warnings)
    shares = [share for share, _ in model.relaxation.prony]
    assert sum(shares) == pytest.approx(1.0 - 1e-6, rel=1e-12)
    assert shares[0] / shares[1] == pytest.approx(0.6 / 0.401)
    assert Effect(TWO).apply(block()).relaxation.prony == TWO
