"""Bodies that relax: compliance of a step, and the two ways of relaxation."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import TwoCoefficients
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import InternalVariables, Step
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.small_strain.viscoelastic_body import (
    ConstantBulkModulus,
    ConstantPoissonRatio,
    RelaxationWorkspace,
)
from tests.models import marched
from tests.viscous_cases import RAMP, TWO, block, viscous


def test_in_an_incompressible_body_both_kinds_are_one() -> None:
    # two ways to the same numbers: row forces over the compliance, and displacements over new factors
    increments_as_given = TwoCoefficients(0.25, 0.99, "keep")  # with bulk alone, the first would be cut into parts
    problem = build(block(material=Isotropic(1.0, 0.5), friction=increments_as_given))
    a, b = (marched(viscous(problem, TWO, bulk)) for bulk in (True, False))
    largest = max(np.abs(f.meshed_state.contact.force).max() for f in a)
    for f, g in zip(a, b, strict=True):
        assert np.abs(f.meshed_state.contact.force - g.meshed_state.contact.force).max() <= 1e-6 * largest
        assert f.gauges["g"] == pytest.approx(g.gauges["g"], rel=1e-6)
    stresses = [formulation_of(p.model).fields(p, f[9].meshed_state)[2] for p, f in
                ((viscous(problem), a), (viscous(problem, TWO, False), b))]  # fmt: skip
    assert np.abs(stresses[0] - stresses[1]).max() <= 1e-5 * np.abs(stresses[0]).max()


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
@pytest.mark.parametrize("nu", [0.3, 0.49])
@pytest.mark.parametrize("kind", [ConstantPoissonRatio, ConstantBulkModulus])
def test_the_compliance_of_a_step_is_the_difference_quotient_of_its_response(
    kind: type, nu: float, domain: str
) -> None:
    problem = build(block(domain=domain, material=Isotropic(1.0, nu), legs=RAMP))
    body = kind(problem)
    rng = np.random.default_rng(0)
    rows = len(problem.body.condensed.compliance)
    memory = InternalVariables(np.zeros(body.size), np.zeros((2, body.size)))
    workspace = RelaxationWorkspace()
    for seconds in (0.3, 0.7):  # so that there is a past
        step = Step(TWO, seconds)
        response = body.respond(step, memory, workspace)
        force = rng.normal(size=rows)
        now = response.shape(force)
        assert body.read(now) == pytest.approx(response.moved + response.compliance @ force, rel=1e-9, abs=1e-12)
        change = rng.normal(size=rows)
        moved = body.read(response.shape(force + change)) - body.read(now)
        assert moved == pytest.approx(response.compliance @ change, rel=1e-7, abs=1e-9)
        memory = step.after(memory, now)
