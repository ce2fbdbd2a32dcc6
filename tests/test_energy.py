"""External work is stored or dissipated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.history import StepResult
from tests.models import block, fig9


def stored(problem: Problem, frame: StepResult) -> float:
    """Elastic energy (mJ), f C f / 2, summed over the whole finger's points."""
    force = problem.upright_force(frame.meshed_state.contact)
    each = 0.5 * np.einsum("id,idje,je->i", force, problem.delassus, force)
    return float((each[problem.symmetry.image_of] * problem.symmetry.multiplicity).sum())


SLIDE_OVER_A_BALL = (Leg(0.3), Leg(0.3, slide_x_mm=0.4))


@pytest.mark.parametrize("mu", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("legs", [(Leg(0.3),), SLIDE_OVER_A_BALL], ids=["press", "slide over a ball"])
def test_work_is_what_is_stored_and_dissipated_in_few_increments_and_in_many(legs: tuple[Leg, ...], mu: float) -> None:
    body = build(block(legs=legs, friction=Coulomb(mu)))
    excess = []
    for steps in (5, 10, 20, 40):
        same = tuple(replace(leg, steps=steps) for leg in legs)
        problem = replace(body, model=replace(body.model, legs=same))
        end = list(march(problem))[-1]
        assert end.outcome.ok
        work = end.external_work_mJ
        excess.append(abs(work - stored(problem, end) - end.dissipation_mJ) / work)
    if mu == 0.0:
        assert max(excess) < 1e-12  # of a linear body the sum is exact; a trapezoid over the depth leaves 1e-2 in 5
    # friction turns where slip reverses: second order in the increment, though points that change state make it uneven
    for steps, left in zip((5, 10, 20, 40), excess, strict=True):
        assert left < 0.4 / steps**2


def test_dissipation_of_a_press_that_slips_everywhere_is_good_in_ten_increments() -> None:
    model = fig9(domain="plane-strain", friction=Coulomb(0.03))
    problem = build(model)
    few, many = (list(march(replace(problem, model=replace(model, legs=(Leg(10.0, steps=n),)))))[-1] for n in (10, 320))
    # the friction of the end of each increment instead of its mean would leave 15 % (1.5 / steps)
    assert few.dissipation_mJ == pytest.approx(many.dissipation_mJ, rel=0.01)
    assert few.external_work_mJ == pytest.approx(many.external_work_mJ, rel=2e-4)


def test_work_at_large_deformation_is_the_energy_stored_and_dissipated() -> None:
    # trapezoids: second order in the increment, and 1e-3 of the work in a few
    legs = (Leg(6.0), Leg(6.0, slide_x_mm=3.0))
    model = LargeDeformation().apply(fig9(domain="plane-strain", legs=legs, material=Isotropic(1.0, 0.49)))
    body = build(model)
    excess = []
    for steps in (5, 10, 20):
        problem = replace(body, model=replace(model, legs=tuple(replace(leg, steps=steps) for leg in legs)))
        workspace = formulation_of(problem.model).workspace()
        end = list(march(problem, workspace=workspace))[-1]
        assert end.outcome.ok
        solid = workspace.bodies[False].solid
        energy = 2 ** len(problem.axes) * solid.energy(
            next(formulation_of(problem.model).unknowns(problem, [end.meshed_state]))
        )
        excess.append(abs(end.external_work_mJ - energy - end.dissipation_mJ) / end.external_work_mJ)
    assert excess[1] < 1e-3
    assert excess[2] < 0.4 * excess[0]
