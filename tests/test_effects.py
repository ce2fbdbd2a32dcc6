"""What holds for every effect: one table over finger3d/effects."""

from __future__ import annotations

import itertools
import subprocess
import sys
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import finger3d.effects
from finger3d.contact.friction import Coulomb
from finger3d.effects import effect_names, effect_type, fill, warn
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.scene import parse
from tests.models import block
from tests.scene_tables import SMALL

TYPICAL: dict[str, dict[str, Any]] = {
    "elastic_object": {"E_MPa": 2.0, "nu": 0.4},
    "embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 2.0},
    "kinetic_friction": {"ratio": 0.7},
    "large_deformation": {},
    "viscosity": {"prony": ((0.3, 0.5),)},
}
# settings that change nothing; finite strain has none, and is neutral under a light load, to the strain it makes
NEUTRAL: dict[str, dict[str, Any]] = {
    "elastic_object": {"E_MPa": 1e12, "nu": 0.4},
    "embedded_gauge": {"E_MPa": 1e-12, "thickness_mm": 0.02, "width_mm": 2.0},
    "kinetic_friction": {"ratio": 1.0},
    "large_deformation": {},
    "viscosity": {"prony": ((1e-15, 0.5),)},
}

# depth (mm), relative difference allowed; an object 1e12 times as stiff still gives by 1e-12
LIGHT = {"large_deformation": (2e-3, 2e-3), "elastic_object": (0.5, 1e-11)}


def baseline() -> Model:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    return Model(
        finger, Isotropic(1.0, 0.3), MeshOptions(0.3, 1.0, "swept"), (Leg(0.5, steps=5, duration_s=1.0),),
        friction=Coulomb(0.1), domain="plane-strain", gauges=(Gauge("g", 0.0, 4.5, length_mm=2.0),),
    )  # fmt: skip


def test_every_effect_is_in_the_tables() -> None:
    assert set(effect_names()) == set(TYPICAL) == set(NEUTRAL)


@pytest.mark.parametrize("name", effect_names())
def test_neutral_setting_is_the_baseline_to_round_off(name: str) -> None:
    depth, tolerance = LIGHT.get(name, (0.5, 1e-13))
    # a contact of a light load is narrow: its half width is sqrt(2 * 5 * 0.002) = 0.14 mm
    mesh = MeshOptions(0.3 if depth == 0.5 else 0.04, 1.0, "swept")
    plain = replace(baseline(), legs=(Leg(depth, steps=5, duration_s=1.0),), mesh=mesh)
    neutral = effect_type(name)(**NEUTRAL[name]).apply(plain)
    for a, b in zip(march(build(plain)), march(build(neutral)), strict=True):
        assert np.abs(a.state.force - b.state.force).max() <= tolerance * np.abs(a.state.force).max()


@pytest.mark.parametrize("name", effect_names())
def test_an_effect_changes_the_answer(name: str) -> None:
    a, b = (list(march(build(m)))[-1] for m in (baseline(), applied((name,))))
    assert np.abs(a.state.force - b.state.force).max() > 1e-3 * np.abs(a.state.force).max()


@pytest.mark.parametrize("names", list(itertools.permutations(effect_names(), 2)) or [effect_names()])
def test_order_does_not_matter(names: tuple[str, ...]) -> None:
    orders = (names, names[::-1])
    if set.intersection(*map(slots, names)):
        for order in orders:
            with pytest.raises(Finger3dError, match=" and ".join(order)):
                applied(order)
    else:
        assert applied(names) == applied(names[::-1])


def applied(names: tuple[str, ...]) -> Model:
    model = baseline()
    for name in names:
        model = effect_type(name)(**TYPICAL[name]).apply(model)
    return model


def slots(name: str) -> set[str]:
    return {slot for slot, _ in applied((name,)).filled}


@pytest.mark.parametrize("name", effect_names())
def test_two_effects_in_one_slot_are_named(name: str) -> None:
    effect = effect_type(name)(**TYPICAL[name])
    with pytest.raises(Finger3dError, match=f"{name} and {name}"):
        effect.apply(effect.apply(baseline()))


def test_an_absent_effect_is_not_imported() -> None:
    code = (
        "import sys; from finger3d.scene import load; load(sys.argv[1]).model(); "
        "import finger3d.mechanics.discretise.build; import finger3d.mechanics.march.solve; "
        "mine = 'viscoelastic', 'elastic_object', 'foils', 'finite_strain'; "
        "print([m for m in sys.modules if m.startswith('finger3d.effects.') "
        "or m.startswith('finger3d.mechanics.') and m.endswith(mine)])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "geometries/fig9.toml"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", effect_names())
def test_only_the_effects_a_scene_names_are_imported(name: str, tmp_path: Any) -> None:
    settings = ", ".join(f"{k} = {[list(p) for p in v] if k == 'prony' else v}" for k, v in TYPICAL[name].items())
    code = (
        "import sys; from finger3d.scene import load; from pathlib import Path; load(Path(sys.argv[1]), "
        "(f'effects.{sys.argv[2]}={sys.argv[3]}', 'press.duration_s=1.0', "
        "'gauge=[{name=\"g\", x_mm=20.0, y_mm=40.0, length_mm=4.0}]')).model(); import finger3d.mechanics.march.solve; "
        "print([m for m in sorted(sys.modules) if m.startswith('finger3d.effects.') and '._' not in m])"
    )
    scene, table = "geometries/fig9.toml", "{" + settings + "}"
    done = subprocess.run([sys.executable, "-c", code, scene, name, table], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"['finger3d.effects.{name}']"


def test_an_absent_effect_adds_no_factorisation() -> None:
    # those that are on need it, or do without
    wanted = {"": 1, "kinetic_friction": 1, "embedded_gauge": 1, "viscosity": 1, "elastic_object": 2}
    for name, count in wanted.items():
        problem = build(applied((name,)) if name else baseline())
        workspace = formulation_of(problem.model).workspace()
        list(march(problem, workspace=workspace))
        assert problem.factorizations + workspace.factorizations == count, name


def test_a_slot_is_filled_once_and_both_effects_are_named_otherwise() -> None:
    model = fill(block(), "friction", Coulomb(0.7), "wet")
    assert model.friction == Coulomb(0.7)
    assert dict(model.filled) == {"friction": "wet"}
    with pytest.raises(Finger3dError, match="wet and dry "):
        fill(model, "friction", Coulomb(0.1), "dry")
    assert fill(model, "held_ends", True, "dry").filled == (("friction", "wet"), ("held_ends", "dry"))


def test_a_warning_is_kept_once() -> None:
    assert warn(warn(warn(block(), "b"), "a"), "b").warnings == ("a", "b")


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
        ({"stiffer": True}, r"effects\.stiffer\.factor is missing"),
        ({"base": {}}, r"effects\.base: "),
    ],
)
def test_mistakes_in_an_effect(stiffer, effects, message) -> None:
    with pytest.raises(Finger3dError, match=message):
        parse({**SMALL, "effects": effects})
