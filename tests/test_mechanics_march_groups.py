"""Presses that share tangents give the results of presses alone."""

from __future__ import annotations

from concurrent.futures import CancelledError
from dataclasses import replace
from threading import Event

import numpy as np
import pytest

from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.groups import march_in_groups
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult

MUS, FAR_APART = (0.1, 0.5, 0.6, 0.8), (0.0, 0.1, 0.5, 2.0)
DEEP = (Leg(2.0, steps=2), Leg(2.0, slide_x_mm=0.5, steps=2))
PATH = (Leg(1.0, steps=3), Leg(1.0, slide_x_mm=0.2, steps=1))

NEO_HOOKE = LargeDeformation()


def problems(
    legs: tuple[Leg, ...] = PATH,
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


def test_groups_end_when_cancelled() -> None:
    several, cancel = problems(), Event()
    groups = march_in_groups(several, formulation_of(several[0].model).workspace(), cancel)
    cancel.set()
    with pytest.raises(CancelledError):
        next(groups)
