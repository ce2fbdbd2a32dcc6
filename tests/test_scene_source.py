"""What the functions of the Python interface take for a scene."""

from __future__ import annotations

from pathlib import Path

import pytest

import finger3d
from finger3d.errors import Finger3dError
from finger3d.scene import scene_of, tables_of
from tests.scenes import HALF_CYLINDER, written


def test_a_path_a_dict_and_a_scene_are_the_same_scene(tmp_path: Path) -> None:
    path = written(tmp_path, HALF_CYLINDER)
    loaded = finger3d.load(path)
    assert scene_of(loaded) is loaded
    assert scene_of(path).as_dict() == scene_of(str(path)).as_dict() == loaded.as_dict()
    assert scene_of(dict(loaded.given)).as_dict() == loaded.as_dict()
    for source in (path, loaded, dict(loaded.given)):
        given, _ = tables_of(source, ["friction.mu=0.7"])
        assert given["friction"]["mu"] == 0.7
        assert scene_of(source, ["friction.mu=0.7"]).tables.friction.mu == 0.7
    assert loaded.given["friction"]["mu"] == 0.25


def test_a_model_is_told_what_takes_it(tmp_path: Path) -> None:
    model = finger3d.load(written(tmp_path, HALF_CYLINDER)).model()
    for given in (model, 7, None):
        with pytest.raises(Finger3dError, match=f"a {type(given).__name__} is no scene: .*finger3d.load"):
            finger3d.press(given)


def test_a_dict_is_a_scene(tmp_path: Path) -> None:
    given = dict(finger3d.load(written(tmp_path, HALF_CYLINDER)).given)
    assert finger3d.press(given, error=False).last.normal_force_N > 0.0
    assert finger3d.plan(given).dofs > 0
    with pytest.raises(Finger3dError, match=r"friction.mu = -1"):
        finger3d.press(given | {"friction": {"mu": -1}})
