"""The companion's mesh is made beside the press where both take long, and never left behind."""

from __future__ import annotations

import json
import os
import pickle
from pathlib import Path
from typing import Any

import pytest

from finger3d.accuracy import prefetch
from finger3d.accuracy.companions import companion
from finger3d.accuracy.prefetch import MeshPrefetch
from finger3d.analyses.press import press
from finger3d.mechanics.solve import build
from finger3d.scene import Scene, parse
from tests.scenes import HALF_CYLINDER, changed

BALL = changed(
    HALF_CYLINDER, geometry="hemisphere", radius_mm=4.0, domain="solid", depth_mm=0.3, steps=2, size_mm=0.5,
    base_size_mm=2.0, y_mm=2.0,
).replace("width_mm = 2.0\n", "")  # fmt: skip


@pytest.fixture
def ball(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scene:
    """A small hemisphere, and no mesh kept of it."""
    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path / "cache"))
    return scene(BALL)


def scene(text: str, **tables: Any) -> Scene:
    import tomllib

    return parse({**tomllib.loads(text), **tables})


def kept(tmp_path: Path) -> int:
    return len(list((tmp_path / "cache").rglob("*.npz")))


def test_a_press_finds_its_companion_meshed(ball: Scene, tmp_path: Path) -> None:
    told = press(ball, tmp_path / "out", figures=False).summary()
    assert "beside" in told["error_estimate"]["method"]
    assert "paid once" not in told["error_estimate"]["method"]  # said of a mesh that the estimate itself has made
    assert kept(tmp_path) == 2
    assert prefetch._expected(ball.model()).mesh == companion(build(ball.model())).model.mesh  # which is what was made
    # nothing is left to do for the next press
    with MeshPrefetch(ball) as beside:
        assert beside._child is None
    again = press(ball, tmp_path / "out", figures=False).summary()
    assert again["error_estimate"]["discretisation"] == pytest.approx(told["error_estimate"]["discretisation"])
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["mesh"]["from_cache"]


@pytest.mark.parametrize(
    "tables",
    [
        {
            "model": {"domain": "plane-strain"},
            "finger": {"geometry": "half_cylinder", "radius_mm": 4.0, "width_mm": 2.0},
        },
        {"finger": {"geometry": "half_cylinder", "radius_mm": 4.0, "width_mm": 2.0}},
        {"mesh": {"tolerance": 0.1}},
    ],
    ids=["a section", "a swept companion", "a mesh that is refined"],
)
def test_what_is_quick_or_not_known_yet_is_not_begun(ball: Scene, tables: dict[str, Any]) -> None:
    with MeshPrefetch(scene(BALL, **tables)) as beside:
        assert beside._child is None
        beside.wait()


def test_without_an_estimate_nothing_is_begun() -> None:
    with MeshPrefetch(None) as beside:
        assert beside._child is None


def test_an_interruption_ends_the_child_and_leaves_no_litter(
    ball: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    litter = tmp_path / "tmp"
    litter.mkdir()
    monkeypatch.setenv("TMPDIR", str(litter))
    begun: list[MeshPrefetch] = []

    def interrupted() -> None:
        with MeshPrefetch(ball) as beside:
            begun.append(beside)
            assert beside._child is not None
            assert beside._child.poll() is None
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    child = begun[0]._child
    assert child is not None
    assert child.poll() is not None
    with pytest.raises(ProcessLookupError):  # nor any child of the child
        os.killpg(child.pid, 0)
    assert not list(litter.iterdir())


def test_a_child_that_fails_leaves_the_mesh_to_the_estimate(
    ball: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prefetch, "__name__", "finger3d.no_such_module")
    told = press(ball, tmp_path / "out", figures=False).summary()
    assert told["error_estimate"]["discretisation"]["normal_force_N"] > 0.0
    assert kept(tmp_path) == 2


def test_a_scene_read_from_a_file_reaches_the_child_whole(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(HALF_CYLINDER, encoding="utf-8")
    from finger3d.scene import load

    found = load(path, ["material.nu=0.4"])
    assert parse(pickle.loads(pickle.dumps(prefetch.tree.plain(found.given)))) == found
