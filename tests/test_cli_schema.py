"""finger3d schema."""

from __future__ import annotations

import json

import pytest

from finger3d.cli import main
from finger3d.scene.schema import schema


def test_schema_prints_the_json_schema_of_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
