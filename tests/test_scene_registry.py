"""Effects by their names."""

from __future__ import annotations

import sys
import tomllib

import pytest

import finger3d.effects
from finger3d.errors import Finger3dError
from finger3d.scene import parse
from tests.scene_tables import SMALL

STIFFER = """
from dataclasses import dataclass, replace
from typing import Annotated
from annotated_types import Gt
from finger3d.errors import Finger3dError

@dataclass(frozen=True)
class Effect:
    factor: Annotated[float, Gt(0)]
    prony: tuple[tuple[float, float], ...] = ()

    def __post_init__(self):
        if self.factor > 100:
            raise Finger3dError(f"factor = {self.factor:g} is too large; allowed: at most 100")

    def apply(self, model):
        return replace(model, material=replace(model.material, E_MPa=model.material.E_MPa * self.factor))
"""


@pytest.fixture
def stiffer(tmp_path, monkeypatch):
    """An effect that only this test knows, as a file beside the real ones."""
    (tmp_path / "stiffer.py").write_text(STIFFER, encoding="utf-8")
    monkeypatch.setattr(finger3d.effects, "__path__", [*finger3d.effects.__path__, str(tmp_path)])
    yield "finger3d.effects.stiffer"
    sys.modules.pop("finger3d.effects.stiffer", None)


def test_a_present_effect_fills_its_slot_and_an_absent_one_is_not_imported(stiffer) -> None:
    assert parse(SMALL).model().material.E_MPa == 1.0
    assert stiffer not in sys.modules
    scene = parse({**SMALL, "effects": {"stiffer": {"factor": 3.0, "prony": [[0.3, 0.5]]}}})
    assert scene.model().material.E_MPa == 3.0
    assert scene.as_dict()["effects"] == {"stiffer": {"factor": 3.0, "prony": [[0.3, 0.5]]}}
    assert parse(tomllib.loads(scene.to_toml())) == scene


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"stifer": {}}, r'effects\.stifer: .*"stiffer"'),
        ({"stiffer": {}}, r"effects\.stiffer\.factor .* 0 .* 1e12"),
        ({"stiffer": {"factor": -1.0}}, r"effects\.stiffer\.factor = -1\.0: .* 0"),
        (
            {"stiffer": {"factor": 1.0, "facter": 1}},
            r'effects\.stiffer\.facter = 1: .*"factor"',
        ),
        (
            {"stiffer": {"factor": 1.0, "prony": [[0.3]]}},
            r"prony = \[\[0\.3\]\]: ",
        ),
        ({"stiffer": {"factor": 101.0}}, r"effects\.stiffer: factor = 101 "),
        ({"stiffer": True}, r"effects\.stiffer = true: .*\[effects\.stiffer\]"),
        ({"base": {}}, r"effects\.base: "),
    ],
)
def test_mistakes_in_an_effect(stiffer, effects, message) -> None:
    with pytest.raises(Finger3dError, match=message):
        parse({**SMALL, "effects": effects})
