"""Presses that go together: variants, groups, processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from threading import Event

import numpy as np
import pytest

from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.errors import Finger3dError
from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build, changed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.groups import march_in_groups
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.variants import map_parallel, press_variants
from finger3d.mechanics.model import ElasticObject, Foils, Gauge, Leg, MeshOptions, Model
from finger3d.objects import Cylinder

CLIPPED = designs()["clipped_cylinder"](radius_mm=6.0, half_length_mm=4.0, edge_height_mm=2.0, width_mm=4.0)
PATH = (Leg(0.3, steps=2, duration_s=1.0), Leg(0.3, slide_x_mm=0.05, steps=2, duration_s=1.0))
SECTION = Model(
    CLIPPED, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2), PATH, object=Cylinder(radius_mm=5.0, axis="z"),
    friction=Coulomb(0.3), gauges=(Gauge("g", 0.7, 2.1, 0.0, 0.5, length_mm=1.0),), domain="plane-strain", symmetry=(),
)  # fmt: skip
KINDS = {
    "section": SECTION,
    "solid": replace(SECTION, domain="solid", mesh=MeshOptions(1.2, 2.0, "swept")),
    "viscous": replace(SECTION, relaxation=Relaxation(((0.5, 1.0),), False)),
    "foils": replace(SECTION, inclusions=Foils(100.0, 0.05, 3.0)),
    "elastic object": replace(SECTION, object_compliance=ElasticObject(5.0, 0.3)),
    "force": replace(SECTION, legs=(Leg(0.3, steps=2, force_N=0.2),)),
    "large deformation": replace(SECTION, hyperelastic_law=NeoHooke(1.0)),
    "large deformation, force": replace(
        SECTION, hyperelastic_law=NeoHooke(1.0), legs=(Leg(0.3, steps=2, force_N=0.2),)
    ),
}


def read(problem: Problem, steps: Sequence[StepResult]) -> dict[str, float]:
    return press_numbers(problem, steps[-1])


def changes_of(model: Model) -> dict[str, Model]:
    """A model with one of its parts changed by 1 %."""
    design, leg = model.design, model.legs[-1]
    found = {
        "mu": replace(model, friction=Coulomb(0.303)),
        "E": replace(model, material=Isotropic(1.01, 0.3)),
        "nu": replace(model, material=Isotropic(1.0, 0.303)),
        "object": replace(model, object=Cylinder(radius_mm=5.05, axis="z")),
        "gauge": replace(model, gauges=(replace(model.gauges[0], x_mm=0.75),)),
        **{
            name: replace(model, design=replace(design, **{name: 1.01 * getattr(design, name)}))
            for name in ("radius_mm", "edge_height_mm", "width_mm")
        },
    }
    if leg.force_N is None:
        found["depth"] = replace(model, legs=tuple(replace(one, depth_mm=0.303) for one in model.legs))
    else:
        found["force"] = replace(model, legs=(replace(leg, force_N=0.202),))
    if model.object_compliance:
        found["object's E"] = replace(model, object_compliance=ElasticObject(5.05, 0.3))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_variant_is_a_press_of_its_own(kind: str) -> None:
    model = KINDS[kind]
    problem, models = build(model), changes_of(model)
    variants = press_variants(problem, list(models.values()), read)
    # presses are solved to round-off, at finite strain and to forces to a residual of 5e-9
    close = 1e-5 if model.finite_strain or model.is_under_force else 1e-8
    for name, variant in zip(models, variants, strict=True):
        assert not variant.failure, (name, variant.failure)
        changed(problem, models[name])  # the cells are shared
        if model.object_compliance and name == "object":
            continue  # its mesh is stretched, where one made anew would have other cells
        own = build(models[name])
        assert own.mesh.points.shape == problem.mesh.points.shape, name
        wanted = press_numbers(own, list(march(own))[-1])
        size = abs(wanted["normal_force_N"])
        assert variant.found == pytest.approx(wanted, rel=close, abs=close * size), name


def test_a_variant_that_needs_other_cells_is_meshed_anew() -> None:
    other = replace(SECTION, mesh=MeshOptions(1.0, 1.5))
    with pytest.raises(Finger3dError):
        changed(build(SECTION), other)
    (variant,) = press_variants(build(SECTION), [other], read)
    own = build(other)
    assert variant.found == pytest.approx(press_numbers(own, list(march(own))[-1]))


def test_a_variant_that_fails_leaves_the_others() -> None:
    model = SECTION
    impossible = replace(model, legs=(*model.legs[:-1], replace(model.legs[-1], depth_mm=40.0)))
    bad, good = press_variants(build(model), [impossible, changes_of(model)["mu"]], read)
    assert bad.found is None
    assert bad.failure
    assert good.found


MUS, FAR_APART = (0.1, 0.5, 0.6, 0.8), (0.0, 0.1, 0.5, 2.0)
DEEP = (Leg(2.0, steps=2), Leg(2.0, slide_x_mm=0.5, steps=2))
PRESS_AND_SLIDE = (Leg(1.0, steps=3), Leg(1.0, slide_x_mm=0.2, steps=1))

NEO_HOOKE = LargeDeformation()


def problems(
    legs: tuple[Leg, ...] = PRESS_AND_SLIDE,
    law: LargeDeformation = NEO_HOOKE,
    viscous: bool = False,
    mus: tuple[float, ...] = MUS,
) -> list[Problem]:
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    model = Model(design, Isotropic(1.0, 0.45), MeshOptions(1.0, 2.0, "swept"), legs, domain="plane-strain")
    model = law.apply(model)
    if viscous:
        timed = tuple(replace(leg, duration_s=1.0) for leg in legs)
        model = Viscosity(((0.4, 0.5),)).apply(replace(model, legs=timed))
    problem = build(model)
    return [replace(problem, model=replace(problem.model, friction=Coulomb(mu))) for mu in mus]


def assert_same(steps: list[StepResult], wanted: list[StepResult]) -> None:
    """Both are solved to a residual of 1e-8; forces follow to some times that."""
    assert len(steps) == len(wanted)
    for a, b in zip(steps, wanted, strict=True):
        assert a.outcome.ok
        assert a.residual <= TOLERANCE
        assert (
            np.abs(a.meshed_state.contact.force - b.meshed_state.contact.force).max()
            <= 1e-6 * np.abs(b.meshed_state.contact.force).max()
        )
        assert a.external_work_mJ == pytest.approx(b.external_work_mJ, rel=1e-6)


@pytest.mark.parametrize("viscous", [False, True])
def test_presses_in_groups_are_those_pressed_alone_with_fewer_factorisations(viscous: bool) -> None:
    several = problems(viscous=viscous)
    shared = formulation_of(several[0].model).workspace()
    found = dict(march_in_groups(several, shared, Event()))
    assert sorted(found) == list(range(len(MUS)))
    factorizations = 0
    for number, steps in found.items():
        workspace = formulation_of(several[0].model).workspace()
        assert_same(steps, list(march(several[number], workspace=workspace)))
        factorizations += workspace.factorizations
    assert shared.factorizations < 0.5 * factorizations


def test_presses_that_wait_for_a_nearer_tangent_lose_nothing() -> None:
    several = problems(DEEP, mus=FAR_APART)
    groups = list(march_in_groups(several, formulation_of(several[0].model).workspace(), Event()))
    assert [number for number, _ in groups] != sorted(number for number, _ in groups)
    for number, steps in groups:
        assert_same(steps, list(march(several[number])))


def test_force_controlled_presses_go_on_by_themselves() -> None:
    several = problems((Leg(0.5, steps=1), Leg(1.0, force_N=1.0, steps=1)))
    for number, steps in march_in_groups(several, formulation_of(several[0].model).workspace(), Event()):
        assert_same(steps, list(march(several[number])))


def test_a_press_that_fails_ends_where_it_does_alone() -> None:
    """The material law is unstable from a strain on that the second increment reaches."""
    law = LargeDeformation(law="yeoh", c2_over_c1=-0.4, c3_over_c1=0.0)
    several = problems((Leg(0.2, steps=1), Leg(2.0, steps=1)), law, mus=MUS[:2])
    found = dict(march_in_groups(several, formulation_of(several[0].model).workspace(), Event()))
    for number, steps in found.items():
        alone = list(march(several[number]))
        assert [step.outcome for step in steps] == [step.outcome for step in alone]
    assert any(not steps[-1].outcome.ok for steps in found.values())


def test_presses_at_once_are_the_presses_in_turn() -> None:
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
    legs = (Leg(0.5, steps=4), Leg(0.5, slide_x_mm=0.1, steps=3))
    problem = build(Model(design, Isotropic(1.0, 0.3), MeshOptions(0.3, 1.5), legs, domain="plane-stress"))
    mus = (0.1, 0.3, 0.6, 1.2)

    def press(mu: float, *_: object) -> list[np.ndarray]:
        own = replace(problem, model=replace(problem.model, friction=Coulomb(mu)))
        return [f.meshed_state.contact.force for f in march(own)]  # other guesses leave other round-off

    at_once = list(map_parallel(problem, press, mus, 2, threads_from=1))
    assert all(
        np.array_equal(a, b)
        for mu, found in zip(mus, at_once, strict=True)
        for a, b in zip(found, press(mu), strict=True)
    )
