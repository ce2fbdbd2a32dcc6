"""Scenes that share a body: which do, and that sharing changes no number."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from finger3d.family import Body, Variant, body_key, families, finest, shared_legs
from finger3d.history import measure
from finger3d.model import Leg
from finger3d.scene import Scene, parse, tree
from finger3d.solve import build, march

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


SHARING = [
    ["friction.mu=1.0"],
    ["effects.kinetic_friction.ratio=0.5"],
    ["press.steps=5"],
    ["gauge.0.angle_deg=80", "gauge.0.name=other"],
    ["title=another"],
]


def test_a_body_pressed_as_its_variants_is_each_pressed_on_its_own():
    scenes = [scene(), *(scene(*c) for c in SHARING)]
    assert list(families(scenes).values()) == [list(range(len(scenes)))]
    models = [s.model() for s in scenes]
    body = Body(replace(models[0], mesh=finest(models)), [Variant.of(m) for m in models])
    for model in models:
        own = build(model)
        alone = measure(own.points, list(march(own))[-1])
        shared = body.press(Variant.of(model))
        assert shared.outcome == "converged"
        # both are exact solutions of one contact problem; one has the mirrored half meshed, too, and round-off differs
        for key in ("normal_force_N", "friction_sum_N", "stick_area_mm2", "dissipation_mJ"):
            assert shared.numbers[key] == pytest.approx(alone[key], rel=1e-9)
        assert shared.gauges == pytest.approx(alone["gauges"], rel=1e-9)


def test_a_slide_among_the_variants_costs_the_mirror_plane_only():
    """A plane touches the same places however it slides, so the mesh is the same."""
    level = ["object={shape='plane'}", "finger={geometry='half_cylinder', radius_mm=3.0, width_mm=1.0}"]
    level += ["gauge.0.x_mm=0.5"]
    models = [scene(*level).model(), scene(*level, "press.slide_x_mm=0.1").model()]
    body = Body(models[0], [Variant.of(m) for m in models])
    assert body.problem.axes == ()
    for model in models:
        own = build(model)
        alone = measure(own.points, list(march(own))[-1])
        assert body.press(Variant.of(model)).numbers["friction_sum_N"] == pytest.approx(
            alone["friction_sum_N"], rel=1e-9
        )


def test_a_shallower_press_on_the_mesh_of_the_deepest():
    models = [scene().model(), scene("press.depth_mm=0.15").model()]
    body = Body(models[0], [Variant.of(m) for m in models])
    shared = body.press(Variant.of(models[1]))
    # other candidate points on the same mesh: open points change nothing but round-off
    every = replace(build(models[0], margin=math.inf), model=models[1])
    assert len(every.surface.nodes) > len(body.problem.surface.nodes)
    same = measure(every.points, list(march(every))[-1])
    assert shared.numbers["normal_force_N"] == pytest.approx(same["normal_force_N"], rel=1e-9)
    # a mesh of its own is graded for its own contact: it agrees as meshes do, not to round-off
    own = build(models[1])
    alone = measure(own.points, list(march(own))[-1])
    assert shared.numbers["normal_force_N"] == pytest.approx(alone["normal_force_N"], rel=0.02)


def test_candidates_are_widened_when_contact_reaches_beyond_them(monkeypatch):
    model = scene("friction.mu=0.0").model()
    wide = Body(model, [Variant.of(model)]).press(Variant.of(model))
    import finger3d.family as family

    said = []
    first = [lambda m, say, margin=-0.8: build(m, say, margin)]
    monkeypatch.setattr(family, "build", lambda m, say, *margin: first[0](m, say, *margin))
    narrow = Body(model, [Variant.of(model)], said.append)
    again = narrow.press(Variant.of(model))
    assert any("beyond" in text for text in said)
    assert again.numbers["normal_force_N"] == pytest.approx(wide.numbers["normal_force_N"], rel=1e-9)


def test_gauges_alone_cost_no_press():
    models = [scene().model(), scene("gauge.0.x_mm=0.5").model()]
    body = Body(models[0], [Variant.of(m) for m in models])
    first, second = (body.press(Variant.of(m)) for m in models)
    assert first.seconds > 0.0
    assert second.seconds == 0.0
    assert first.gauges != second.gauges
    assert first.numbers == second.numbers


@pytest.mark.parametrize(
    "change",
    [
        "material.nu=0.31", "material.E_MPa=2.0", "finger.height_mm=3.1", "object.radius_mm=5.0", "mesh.size_mm=0.3",
        "model.domain=plane-stress", "effects.large_deformation={}",
    ],
)  # fmt: skip
def test_what_shapes_the_condensation_makes_another_body(change):
    assert body_key(scene(change)) != body_key(scene())


def test_a_gauge_that_is_stiff_shapes_the_body():
    foil = ["effects.embedded_gauge={E_MPa=3000.0, thickness_mm=0.02, width_mm=1.0}", "gauge.0.length_mm=1.0"]
    assert body_key(scene(*foil)) != body_key(scene(*foil, "gauge.0.x_mm=0.5"))
    models = [scene(*foil).model(), scene(*foil, "friction.mu=1.0").model()]
    body = Body(models[0], [Variant.of(m) for m in models])
    own = build(models[1])
    alone = measure(own.points, list(march(own))[-1])
    assert body.press(Variant.of(models[1])).gauges == pytest.approx(alone["gauges"], rel=1e-9)


def test_chosen_sizes_follow_the_depth_and_are_shared():
    free = {k: v for k, v in BLOCK.items() if k != "mesh"}
    scenes = [parse(tree.override(tree.frozen(free), [f"press.depth_mm={d}"])) for d in (0.004, 0.3)]
    assert scenes[0].mesh.size_mm < scenes[1].mesh.size_mm
    assert len(families(scenes)) == 1
    assert finest([s.model() for s in scenes]).size_mm == scenes[0].mesh.size_mm


def test_a_step_that_fails_is_named():
    """The paper's rule, which does not exclude friction that helps slip (design.md sec. 3)."""
    model = scene("contact.rule=paper", "material.nu=0.45", "mesh.size_mm=0.1", "press.depth_mm=0.6").model()
    pressed = Body(model, [Variant.of(model)]).press(Variant.of(model))
    assert pressed.outcome.startswith("step ")
    assert pressed.numbers == {}
    assert pressed.gauges == {}


def variant(*legs: Leg) -> Variant:
    return replace(Variant.of(scene().model()), legs=legs)


def test_the_shared_path_goes_everywhere_and_nowhere_else():
    a, b = (Leg(1.0), Leg(1.0, 2.0)), (Leg(2.0),)
    assert shared_legs([variant(*a)]) == a
    assert shared_legs([variant(*b), variant(Leg(1.0))]) == b
    assert shared_legs([variant(*a), variant(*b)]) == (*a, Leg(1.0), Leg(0.0), *b)
