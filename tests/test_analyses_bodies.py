"""Pressed bodies: presses that share one, and bodies that have to be condensed again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.analyses import pressed_body as pressing
from finger3d.analyses.pressed_body import SharedBody, Variant, VariantResult, body_key, finest
from finger3d.contact.friction import Coulomb
from finger3d.errors import UnresolvedError
from finger3d.fem.recovery import displacement
from finger3d.fem.surface import surface
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.postprocess.penetration import beyond_candidates, check_surface
from finger3d.scene import Scene, parse, tree
from tests.logs import Log
from tests.sensor_cases import scene as fig9_scene

NARROW = -0.8
"""Margin with which only points deep inside the object are candidates."""


def test_all_presses_are_of_the_body_that_is_wide_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    model, mus = (
        fig9_scene(model={"domain": "plane-strain"}, mesh={"size_mm": 2.0, "base_size_mm": 8.0}).model(),
        (0.1, 0.6),
    )
    wide, said = pressing.PressedBody(model), Log()
    ends, steps = wide.ends(mus), wide.steps()
    monkeypatch.setattr(
        pressing, "build", lambda m, report, margin, _: build(m, report, NARROW if margin == MARGIN else margin)
    )
    narrow = pressing.PressedBody(model, said)
    few = len(narrow.problem.surface.nodes)
    again = narrow.ends(mus)
    count = len(narrow.problem.surface.nodes)
    assert sum("beyond" in line for line in said.lines) == 1
    assert few < len(wide.problem.surface.nodes) <= count
    for one, other in zip(again, ends, strict=True):
        assert one.meshed_state.contact.force.shape == (count, 2)
        assert one.gauges == pytest.approx(other.gauges, rel=1e-9)
        assert one.penetration_mm == pytest.approx(other.penetration_mm, rel=1e-9)
    (last,) = (one[-1] for one in [narrow.steps()])
    assert last.gauges == pytest.approx(steps[-1].gauges, rel=1e-9)
    assert sum("beyond" in line for line in said.lines) == 1


def test_a_body_under_a_force_is_meshed_for_the_depth_that_it_is_reached_at() -> None:
    legs = (Leg(0.2, steps=2, force_N=8.0),)  # a forecast that is far too small
    section = fig9_scene(model={"domain": "plane-strain"}, mesh={"size_mm": 2.0, "base_size_mm": 8.0})
    model = replace(section.model(), legs=legs)
    said = Log()
    body = pressing.PressedBody(model, said)
    last = body.steps()[-1]
    assert sum("deeper" in line for line in said.lines) == 1
    # the depth reached on the first mesh, from that on the mesh for it
    assert body.problem.model.legs[0].depth_mm == pytest.approx(last.target.depth_mm, rel=0.01)
    assert -float(last.state.force[:, 0].sum()) == pytest.approx(-8.0, rel=1e-6)


def test_another_path_is_refused_where_the_object_passes_between_the_points() -> None:
    model = fig9_scene(
        model={"domain": "plane-strain"}, mesh={"size_mm": 4.0, "base_size_mm": 16.0}, press={"depth_mm": 5.0},
        object={"shape": "wedge", "angle_deg": 60.0, "tip_radius_mm": 0.5},
    ).model()  # fmt: skip
    problem = build(model)
    assert pressing.under(problem, model.friction.with_mu(0.9)).model.friction.mu == 0.9
    assert pressing.under(problem).model == model
    with pytest.raises(UnresolvedError):
        pressing.under(problem, legs=(Leg(0.05),))


BLOCK = {
    "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.3},
    "object": {"shape": "cylinder", "radius_mm": 4.0},
    "friction": {"mu": 0.25},
    "press": {"depth_mm": 0.3, "steps": 3},
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 0.4, "base_size_mm": 0.8},
    "gauge": [{"name": "g", "x_mm": 1.0, "y_mm": 2.0, "angle_deg": 30.0}],
}


def scene(*changes: str) -> Scene:
    return parse(tree.override(tree.frozen(BLOCK), changes))


def press(body: SharedBody, variant: Variant) -> VariantResult:
    (found,) = body.presses([variant])
    assert isinstance(found, VariantResult)
    return found


def strains(result: VariantResult) -> dict[str, float]:
    return {column.sensor: value for column, value in result.readings.items() if column.kind == "gauge"}


SHARING = [
    ["friction.mu=1.0"],
    ["effects.kinetic_friction.ratio=0.5"],
    ["press.steps=5"],
    ["gauge.0.angle_deg=80", "gauge.0.name=other"],
    ["title=another"],
]


def test_a_body_pressed_as_its_variants_is_each_pressed_on_its_own() -> None:
    scenes = [scene(), *(scene(*c) for c in SHARING)]
    assert len({body_key(s) for s in scenes}) == 1
    models = [s.model() for s in scenes]
    body = SharedBody(replace(models[0], mesh=finest(models)), [Variant.of(m) for m in models])
    for model in models:
        own = build(model)
        alone = measure(own.points, list(march(own))[-1])
        shared = press(body, Variant.of(model))
        assert shared.outcome == "converged"
        # both are exact solutions of one contact problem; one has the mirrored half meshed, too, and round-off differs
        for key in ("normal_force_N", "friction_sum_N", "stick_area_mm2", "dissipation_mJ"):
            assert shared.numbers[key] == pytest.approx(alone[key], rel=1e-9)
        assert strains(shared) == pytest.approx(alone["gauges"], rel=1e-9)


def test_a_slide_among_the_variants_costs_the_mirror_plane_only() -> None:
    """A plane touches the same places however it slides, so the mesh is the same."""
    level = ["object={shape='plane'}", "finger={geometry='half_cylinder', radius_mm=3.0, width_mm=1.0}"]
    level += ["gauge.0.x_mm=0.5"]
    models = [scene(*level).model(), scene(*level, "press.slide_x_mm=0.1").model()]
    body = SharedBody(models[0], [Variant.of(m) for m in models])
    assert body.problem.axes == ()
    for model in models:
        own = build(model)
        alone = measure(own.points, list(march(own))[-1])
        assert press(body, Variant.of(model)).numbers["friction_sum_N"] == pytest.approx(
            alone["friction_sum_N"], rel=1e-9
        )


def test_a_shallower_press_on_the_mesh_of_the_deepest() -> None:
    models = [scene().model(), scene("press.depth_mm=0.15").model()]
    body = SharedBody(models[0], [Variant.of(m) for m in models])
    shared = press(body, Variant.of(models[1]))
    # other candidate points on the same mesh: open points change nothing but round-off
    every = replace(build(models[0], margin=math.inf), model=models[1])
    assert len(every.surface.nodes) > len(body.problem.surface.nodes)
    same = measure(every.points, list(march(every))[-1])
    assert shared.numbers["normal_force_N"] == pytest.approx(same["normal_force_N"], rel=1e-9)
    # a mesh of its own is graded for its own contact: it agrees as meshes do, not to round-off
    own = build(models[1])
    alone = measure(own.points, list(march(own))[-1])
    assert shared.numbers["normal_force_N"] == pytest.approx(alone["normal_force_N"], rel=0.02)


def test_gauges_alone_cost_no_press() -> None:
    models = [scene().model(), scene("gauge.0.x_mm=0.5").model()]
    body = SharedBody(models[0], [Variant.of(m) for m in models])
    first, second = (press(body, Variant.of(m)) for m in models)
    assert first.seconds > 0.0
    assert second.seconds == 0.0
    assert first.readings != second.readings
    assert first.numbers == second.numbers


@pytest.mark.parametrize(
    "change",
    [
        "material.nu=0.31", "material.E_MPa=2.0", "finger.height_mm=3.1", "object.radius_mm=5.0", "mesh.size_mm=0.3",
        "model.domain=plane-stress", "effects.large_deformation={}",
    ],
)  # fmt: skip
def test_what_shapes_the_condensation_makes_another_body(change) -> None:
    assert body_key(scene(change)) != body_key(scene())


def test_a_gauge_that_is_stiff_shapes_the_body() -> None:
    foil = ["effects.embedded_gauge={E_MPa=3000.0, thickness_mm=0.02, width_mm=1.0}", "gauge.0.length_mm=1.0"]
    assert body_key(scene(*foil)) != body_key(scene(*foil, "gauge.0.x_mm=0.5"))
    models = [scene(*foil).model(), scene(*foil, "friction.mu=1.0").model()]
    body = SharedBody(models[0], [Variant.of(m) for m in models])
    own = build(models[1])
    alone = measure(own.points, list(march(own))[-1])
    assert strains(press(body, Variant.of(models[1]))) == pytest.approx(alone["gauges"], rel=1e-9)


def test_chosen_sizes_follow_the_depth_and_are_shared() -> None:
    free = {k: v for k, v in BLOCK.items() if k != "mesh"}
    scenes = [parse(tree.override(tree.frozen(free), [f"press.depth_mm={d}"])) for d in (0.004, 0.3)]
    assert scenes[0].mesh.size_mm < scenes[1].mesh.size_mm
    assert body_key(scenes[0]) == body_key(scenes[1])
    assert finest([s.model() for s in scenes]).size_mm == scenes[0].mesh.size_mm


def test_a_step_that_fails_is_named() -> None:
    """The paper's rule, which does not exclude friction that helps slip."""
    model = scene("contact.rule=paper", "material.nu=0.3", "mesh.size_mm=0.1", "press.depth_mm=0.6").model()
    pressed = press(SharedBody(model, [Variant.of(model)]), Variant.of(model))
    assert pressed.outcome.startswith("increment ")
    assert pressed.numbers == {}
    assert pressed.readings == {}


@pytest.mark.parametrize(
    "effect",
    [
        [],
        ["effects.embedded_gauge={E_MPa=3000.0, thickness_mm=0.02, width_mm=1.0}", "gauge.0.length_mm=1.0"],
        ["effects.elastic_object={E_MPa=10.0, nu=0.3}"],
        ["effects.viscosity={prony=[[0.3, 0.5]]}", "press.duration_s=1.0"],
        ["effects.viscosity={prony=[[0.3, 0.5]], bulk=false}", "press.duration_s=1.0"],
        ["effects.large_deformation={}"],
    ],
    ids=["paper", "embedded gauge", "elastic object", "viscosity", "shear relaxes", "large deformation"],
)
def test_several_presses_are_proved_as_each_on_its_own(effect) -> None:
    """The gaps beyond the candidates are those of a back-substitution for each press, over the whole face."""
    model = scene(*effect).model()
    problem = build(model)
    assert 0 in beyond_candidates(problem).face
    ends = [
        list(
            march(
                replace(
                    problem, model=replace(model, friction=Coulomb(mu), legs=(Leg(depth, steps=2, duration_s=1.0),))
                )
            )
        )[-1]
        for mu, depth in ((0.1, 0.3), (0.5, 0.2), (1.0, 0.1))
    ]
    face = surface(problem.mesh, "contact", problem.body.thickness)
    kinematics = formulation_of(model)
    together = kinematics.unknowns(problem, [f.meshed_state for f in ends])
    for frame, unknowns in zip(ends, together, strict=True):
        alone = next(kinematics.unknowns(problem, [frame.meshed_state]))
        found, expected = (
            kinematics.gap(problem, displacement(problem.mesh, x), frame.target, face)[0] for x in (unknowns, alone)
        )
        assert np.abs(found - expected).max() <= 1e-12 * frame.target.depth_mm
    assert all(check.within_candidates for check in check_surface(problem, ends))
    assert all(check_surface(problem, [end])[0].within_candidates for end in ends)


NARROWEST = -0.98
"""Margin of a body at first: its candidates reach to a fifth of the depth, where a shallow press ends."""


def narrowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "finger3d.analyses.pressed_body.build",
        lambda m, report, margin, _: build(m, report, NARROWEST if margin == MARGIN else margin),
    )


def test_presses_together_are_the_presses_alone(monkeypatch) -> None:
    """Two reach beyond the candidates, one does not, two differ in their gauges only; in the order asked."""
    shallow = "press.depth_mm=0.03"
    changes = [[shallow], ["friction.mu=0.1"], ["friction.mu=1.0"], ["friction.mu=0.1", "gauge.0.x_mm=0.5"]]
    models = [scene(*change).model() for change in changes]
    variants = [Variant.of(m) for m in models]
    wide = SharedBody(models[1], variants)
    alone = [press(wide, v) for v in variants]
    narrowed(monkeypatch)
    said = Log()
    body = SharedBody(models[1], variants, said)
    together = list(body.presses(variants))
    assert sum("beyond" in text for text in said.lines) == 1
    for one, other in zip(alone, together, strict=True):
        # the gap of the outermost candidate depends on neighbours that a narrow body lacks, and with it where contact
        # ends between two points
        zones = {name for name in one.numbers if "area" in name or "length" in name}
        forces = {name: value for name, value in one.numbers.items() if name not in zones}
        assert {name: other.numbers[name] for name in forces} == pytest.approx(forces, rel=1e-9)
        assert other.numbers == pytest.approx(one.numbers, rel=1e-3)
        assert strains(other) == pytest.approx(strains(one), rel=1e-9)
    assert together[1].readings != together[3].readings
    assert [p.seconds > 0.0 for p in together] == [True, True, True, False]


def test_a_press_that_fails_takes_no_other_along(monkeypatch) -> None:
    models = [scene(f"friction.mu={mu}").model() for mu in (0.1, 0.5, 1.0)]
    body = SharedBody(models[0], [Variant.of(m) for m in models])

    def failing(problem, **arguments):
        if problem.model.friction.mu == 0.5:
            raise MemoryError("none left")
        return march(problem, **arguments)

    monkeypatch.setattr("finger3d.mechanics.march.step_halving.march", failing)
    first, second, third = body.presses([Variant.of(m) for m in models])
    assert isinstance(second, MemoryError)
    assert first.outcome == third.outcome == "converged"
    (again,) = body.presses([Variant.of(models[1])])
    assert str(again) == "none left"


def test_a_body_that_cannot_be_widened_fails_those_that_need_it_only(monkeypatch) -> None:
    models = [scene(change).model() for change in ("friction.mu=0.1", "press.depth_mm=0.03", "friction.mu=1.0")]
    variants = [Variant.of(m) for m in models]

    def once(model, report, margin, _):
        if margin == math.inf:
            raise MemoryError
        return build(model, report, NARROWEST)

    monkeypatch.setattr("finger3d.analyses.pressed_body.build", once)
    found = list(SharedBody(models[0], variants).presses(variants))
    assert [isinstance(p, MemoryError) for p in found] == [True, False, True]
    assert found[1].outcome == "converged"
