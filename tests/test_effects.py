"""Effects: what each puts into the model, and its limits."""

from __future__ import annotations

import itertools
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d.effects
from finger3d.cli import main
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import SLIP, STICK, Coulomb, TwoCoefficients
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.effects import effect_names, effect_type
from finger3d.effects.elastic_object import Effect as SoftObject
from finger3d.effects.embedded_gauge import Effect as EmbeddedGauge
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import FREE_FACES
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import ElasticObject, Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.objects import Cylinder, MeshObject, Plane, Sphere
from finger3d.scene import parse
from tests.foil_cases import FOIL, FOIL_TABLE, GOOD, MIDDLE
from tests.foil_cases import block as foil_block
from tests.foil_cases import scene_of as foil_scene
from tests.models import block, ended, large_fig9, last
from tests.scene_tables import SMALL
from tests.scenes import HALF_CYLINDER, written
from tests.soft_object_cases import half_ball, pad
from tests.viscous_cases import TWO
from tests.viscous_cases import block as viscous_block
from tests.viscous_cases import scene_of as viscous_scene

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


@pytest.mark.parametrize("names", list(itertools.combinations(effect_names(), 2)))
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


@pytest.mark.parametrize("name", ["viscosity", ""])
def test_only_the_effects_a_scene_names_are_imported(name: str) -> None:
    settings = ", ".join(
        f"{k} = {[list(p) for p in v] if k == 'prony' else v}" for k, v in TYPICAL.get(name, {}).items()
    )
    keys = ["press.duration_s=1.0", 'gauge=[{name="g", x_mm=20.0, y_mm=40.0, length_mm=4.0}]']
    keys += [f"effects.{name}={{{settings}}}"] if name else []
    code = (
        "import sys; from finger3d.scene import load; from pathlib import Path; load(Path(sys.argv[1]), sys.argv[2:])"
        ".model(); import finger3d.mechanics.discretise.build; import finger3d.mechanics.march.solve; "
        "mine = 'viscoelastic', 'elastic_object', 'foils', 'finite_strain'; "
        "print(*[m for m in sys.modules if m.startswith('finger3d.effects.') and '._' not in m]); "
        "print(*[m for m in sys.modules if m.startswith('finger3d.mechanics.') and m.endswith(mine)])"
    )
    command = [sys.executable, "-c", code, "geometries/fig9.toml", *keys]
    effects, mechanics = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert effects == (f"finger3d.effects.{name}" if name else "")
    assert name or not mechanics


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
        (
            {"stiffer": {"factor": 1.0, "facter": 1}},
            r'effects\.stiffer\.facter = 1: .*"factor"',
        ),
        (
            {"stiffer": {"factor": 1.0, "prony": [[0.3]]}},
            r"prony = \[\[0\.3\]\]: ",
        ),
    ],
)
def test_mistakes_in_an_effect(stiffer, effects, message) -> None:
    with pytest.raises(Finger3dError, match=message):
        parse({**SMALL, "effects": effects})


def test_what_the_settings_refuse() -> None:
    for obj in (Sphere(radius_mm=4.0), Cylinder(radius_mm=4.0), MeshObject(surface=half_ball(4.0))):
        with pytest.raises(Finger3dError, match=r"effects\.elastic_object\.height_mm: "):
            SoftObject(1.0, 0.3, 5.0).apply(pad(object=obj))
    with pytest.raises(Finger3dError, match='model.domain = "solid"'):
        SoftObject(1.0, 0.3).apply(pad(object=MeshObject(surface=half_ball(4.0)), domain="plane-strain"))
    slid = SoftObject(1.0, 0.3).apply(pad(legs=(Leg(0.3, slide_x_mm=1.0),)))
    assert any("compliance" in w for w in slid.warnings)


def test_a_scene_names_the_effect() -> None:
    tables = {
        "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 6.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": 0.3},
        "effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4}},
    }
    model = parse(tables).model()
    assert model.object_compliance == ElasticObject(10.0, 0.4, None)


FOIL_MISTAKES = [
    (FOIL_TABLE, (), r"effects\.embedded_gauge: .*\[\[gauge\]\]"),
    (FOIL_TABLE, ({**GOOD, "length_mm": 0.0},), r"gauge\.0\.length_mm = 0\.0: .* 0 "),
    ({**FOIL_TABLE, "thickness_mm": 1.0}, (GOOD,), r"thickness_mm = 1\.0: "),
    ({**FOIL_TABLE, "width_mm": 4.5}, (GOOD,), r"width_mm = 4\.5: gauge \"g\" .* 4 "),
    (FOIL_TABLE, ({**GOOD, "z_mm": 1.0},), r"width_mm = 3\.0: gauge \"g\" .* 2 "),
    (FOIL_TABLE, (GOOD, {**GOOD, "name": "g_free"}), r"gauge\.name = \"g_free\": "),
]
NO_DURATION = ({"depth_mm": 1.0, "duration_s": 1.0}, {"depth_mm": 0.5})
VISCOUS_MISTAKES = [
    (viscous_scene({"prony": ((0.6, 1.0), (0.41, 2.0))}), r"effects\.viscosity: prony: .* 1"),
    (viscous_scene({"prony": ((-0.1, 1.0),)}), r"effects\.viscosity\.prony = .*above 0"),
    (viscous_scene({"prony": ()}), r"effects\.viscosity\.prony = \[\]: "),
    (viscous_scene({"prony": ((0.1, 1.0),)}, legs=NO_DURATION), r"press\.leg\.1\.duration_s .*viscosity"),
    (viscous_scene({"prony": ((0.1, 1.0),), "bulk": False}, "plane-stress"), r"viscosity\.bulk = false: "),
]


@pytest.mark.parametrize(
    ("scene", "says"),
    [*((foil_scene(effect, *gauges), says) for effect, gauges, says in FOIL_MISTAKES), *VISCOUS_MISTAKES],
)
def test_mistakes_are_one_line(scene: dict[str, Any], says: str) -> None:
    with pytest.raises(Finger3dError, match=says) as caught:
        parse(scene)
    assert "\n" not in str(caught.value)


def test_python_users_are_told_too_that_a_gauge_lies_outside() -> None:
    with pytest.raises(Finger3dError, match="outside"):
        build(FOIL.apply(foil_block(gauges=(replace(MIDDLE, y_mm=3.5),))))


def test_a_point_that_slips_keeps_the_kinetic_limit_until_it_sticks() -> None:
    compliance = np.eye(2).reshape(1, 2, 1, 2)  # one point on two unit springs
    law = TwoCoefficients(0.5, 0.6, "keep")
    state = ContactState.at_rest(np.array([0.0]), 2)
    wanted = [(0.2, STICK, 0.2), (0.6, SLIP, 0.3), (0.7, SLIP, 0.3), (0.6, STICK, 0.2), (0.3, STICK, -0.1)]
    for slide, status, friction in wanted:
        state = solve_increment(ContactProblem.of(state, np.array([[-1.0, -slide]]), compliance, law, 1.0)).state
        assert state.status[0] == status
        assert state.force[0, 1] == pytest.approx(friction, abs=1e-12)
    # after it stuck the static limit counts again
    state = solve_increment(ContactProblem.of(state, np.array([[-1.0, 0.1]]), compliance, law, 1.0)).state
    assert (state.status[0], state.force[0, 1]) == (STICK, pytest.approx(-0.5, abs=1e-9))


def test_a_scene_without_durations_exits_2_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    scene = written(tmp_path, HALF_CYLINDER + "[effects.viscosity]\nprony = [[0.3, 0.5]]\n")
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 2
    assert "press.duration_s " in capsys.readouterr().err
    assert not (tmp_path / "out" / "summary.json").exists()


def test_shares_that_sum_to_more_than_1_by_rounding_are_scaled_and_told() -> None:
    model = Viscosity(((0.6, 1.0), (0.401, 2.0))).apply(viscous_block())
    assert any("sum to 1.001" in text for text in model.warnings)
    shares = [share for share, _ in model.relaxation.prony]
    assert sum(shares) == pytest.approx(1.0 - 1e-6, rel=1e-12)
    assert shares[0] / shares[1] == pytest.approx(0.6 / 0.401)
    assert Viscosity(TWO).apply(viscous_block()).relaxation.prony == TWO


def test_fig9_agrees_with_calculix() -> None:
    # validation/REFERENCES.md, 6.5: 28.5 N per mm by CalculiX, and 22.35 in small strain; stick zone 33 mm
    problem = build(large_fig9(0.45, 1.0))
    workspace = formulation_of(problem.model).workspace()
    *_, end = march(problem, workspace=workspace)
    got = measure(problem.points, end)
    assert end.outcome is Outcome.CONVERGED
    assert got["normal_force_N"] / 20.0 == pytest.approx(28.5, rel=0.02)
    assert 30.0 <= got["stick_half_length_mm"] <= 36.0
    assert abs(got["tangential_force_x_N"]) < 1e-9
    assert got["gauges"]["g"] == pytest.approx(got["gauges"]["mirror"], rel=1e-9)


def test_incompressible_plane_stress_converges_to_the_limit_of_nu() -> None:
    forces = []
    for nu in (0.499, 0.4999, 0.5):
        problem = build(large_fig9(nu, 4.0, domain="plane-stress", legs=(Leg(3.0, steps=3),)))
        workspace = formulation_of(problem.model).workspace()
        *_, end = march(problem, workspace=workspace)
        assert end.outcome is Outcome.CONVERGED
        forces.append(measure(problem.points, end)["normal_force_N"])
        assert workspace.factorizations <= 5 * 3
    # linear in 0.5 - nu, so extrapolation from the first two leaves the square: 1e-6 and a factor
    assert forces[2] == pytest.approx(forces[1] + (forces[1] - forces[0]) / 9.0, rel=1e-5)


def test_half_the_height() -> None:
    # the contact reaches the corner of the section on the way; nu = 0.5 in the test above is the mixed form
    problem = build(large_fig9(0.45, 4.0, legs=(Leg(25.0, steps=12),)))
    frames = list(march(problem))
    assert frames[-1].outcome.ok
    forces = np.array([measure(problem.points, f)["normal_force_N"] for f in frames])
    assert np.all(np.diff(forces, 2) > -0.05 * forces[-1])  # it stiffens


def test_slide_of_several_contact_lengths_reaches_mu_n() -> None:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    model = Model(
        finger, Isotropic(1.0, 0.45), MeshOptions(0.3, 1.0), (Leg(0.3, steps=3), Leg(0.3, slide_x_mm=4.0, steps=20)),
        object=Plane(), friction=Coulomb(0.3), domain="plane-strain",
    )  # fmt: skip
    problem = build(LargeDeformation().apply(model), margin=np.inf)
    *_, end = march(problem)
    got = measure(problem.points, end)
    assert end.outcome.ok
    assert got["tangential_force_x_N"] == pytest.approx(0.3 * got["normal_force_N"], rel=1e-8)


def test_a_cylinder_is_pressed_past_its_equator() -> None:
    # the dent is 3.5 times as deep as the cylinder is wide at its equator, where its walls become vertical
    body = designs()["block"](half_length_mm=10.0, height_mm=10.0, width_mm=1.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.25, 2.0, "swept"), (Leg(3.5, steps=14),),
        object=Cylinder(radius_mm=1.0), friction=Coulomb(0.2), domain="plane-strain",
    )  # fmt: skip
    problem, end = ended(LargeDeformation().apply(model))
    assert end.state.bases is not None
    touching = end.state.force[:, 0] > 0.0
    assert end.state.bases[touching, 0, 1].max() > -0.35  # normals up to 70 degrees from the vertical
    (check,) = check_surface(problem, [end])
    assert check.within_candidates
    assert check.penetration_mm < 0.01 * 3.5


def test_a_bonded_block_folds_over() -> None:
    # walls roll onto the plane (validation/REFERENCES.md, 6.5); frictionless plates would let them bulge only
    body = designs()["block"](half_length_mm=5.0, height_mm=10.0, width_mm=1.0)
    model = Model(
        body, Isotropic(1.0, 0.45), MeshOptions(0.5, 1.0, "swept"), (Leg(3.0, steps=8),),
        friction=Coulomb(1.0), domain="plane-strain",
    )  # fmt: skip
    problem = build(LargeDeformation().apply(model), margin=np.inf)
    frames = list(march(problem))
    assert frames[-1].outcome.ok
    walls = problem.points.face == FREE_FACES.index("walls")
    touching = [np.count_nonzero(frame.state.force[walls, 0] > 0.0) for frame in frames]
    assert touching[2] < touching[-1]
    checks = check_surface(problem, frames)
    assert all(check.within_candidates for check in checks)
    assert max(check.penetration_mm for check in checks) < 0.03 * 3.0


@pytest.mark.slow
def test_a_press_too_deep_ends_in_an_outcome_with_all_earlier_steps_kept() -> None:
    problem = build(large_fig9(0.3, 8.0, legs=(Leg(48.0, steps=6),)))
    frames = list(march(problem))
    assert frames[0].outcome.ok
    assert frames[-1].outcome in {Outcome.NEWTON, Outcome.NO_CONVERGENCE}
    assert all(f.outcome.ok for f in frames[:-1])
    assert "try" in str(frames[-1].outcome)


@pytest.mark.parametrize("friction", [0.3, 5.0])
def test_a_twist_is_that_of_small_strain_under_a_light_load(friction: float) -> None:
    """Strains of a percent: the moment differs by a few percent, sliding and sticking."""
    legs = (Leg(0.02, steps=1), Leg(0.02, turn_y=np.radians(0.5), steps=2))
    model = block(object=Plane(), legs=legs, mesh=MeshOptions(1.0, 1.5, "swept"), friction=Coulomb(friction))
    small, finite = last(model), last(LargeDeformation().apply(model))
    assert small["moment_y_Nmm"] > 0.1
    assert finite["moment_y_Nmm"] == pytest.approx(small["moment_y_Nmm"], rel=0.05)
    assert finite["normal_force_N"] == pytest.approx(small["normal_force_N"], rel=0.05)


WIDE_FOIL = EmbeddedGauge(E_MPa=3000.0, thickness_mm=0.02, width_mm=2.0)
PAIRS = {
    "embedded gauge": WIDE_FOIL,
    "viscosity": Viscosity(((0.3, 0.5),)),
    "viscosity of the shear modulus": Viscosity(((0.3, 0.5),), bulk=False),
    "elastic object": SoftObject(2.0, 0.4),
    "ogden": None,
}


@pytest.mark.parametrize("name", PAIRS)
def test_every_effect_beside_it_is_that_of_small_strain_under_a_light_load(name: str) -> None:
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    foil = Gauge("g", 0.0, 3.0, length_mm=2.0)
    differences = []
    for depth in (0.16, 0.04):
        model = Model(
            finger, Isotropic(1.0, 0.45), MeshOptions(0.4 * depth**0.5, 1.0, "swept"),
            (Leg(depth, steps=4, duration_s=1.0),),
            friction=Coulomb(0.25), domain="plane-strain", gauges=(foil,),
        )  # fmt: skip
        effect = PAIRS[name]
        plain = model if effect is None else effect.apply(model)
        settings = (
            LargeDeformation(law="ogden", terms=((0.7, 3.0), (0.3, -1.5))) if effect is None else LargeDeformation()
        )
        problems = build(plain), build(settings.apply(plain))
        small, large = (measure(problem.points, list(march(problem))[-1]) for problem in problems)
        force = large["normal_force_N"] / small["normal_force_N"] - 1.0
        differences.append((abs(force), abs(large["gauges"]["g"] / small["gauges"]["g"] - 1.0)))
    # strain and slope at the contact go with the root of the depth, their effect on force and gauge with the depth
    assert max(differences[0]) < 0.05
    assert all(after < 0.4 * before for before, after in zip(*differences, strict=True))
