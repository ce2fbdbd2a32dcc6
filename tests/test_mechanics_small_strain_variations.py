"""Variations of a condensed body: against its own proportions, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.solvers.condense import Condensation, condense
from finger3d.mechanics.discretise import elastic_object
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import ElasticObject
from finger3d.mechanics.small_strain.variations import VariedBody
from finger3d.objects import Plane
from tests.differences import STEP, other_parameters, parameters
from tests.models import half_cylinder, small_section


def test_a_modulus_changes_the_compliance_in_inverse_proportion() -> None:
    # W = W_1 / E, so that dW / dE = -W / E
    model = replace(half_cylinder(0.3), symmetry=())
    problem = build(model)
    e, nu, step = model.material.E_MPa, model.material.nu, 1e-3
    low, high = (replace(model, material=Isotropic(e + sign * step, nu)) for sign in (-1.0, 1.0))
    found = VariedBody(problem).variation(low, high, step)
    assert found.body is not None
    condensed = problem.body.condensed
    force = np.random.default_rng(0).normal(size=(len(condensed.compliance), 1))
    moved = found.body.moved(force, condensed.unknowns(force))
    whole = found.body.compliance(condensed.unknowns(np.eye(len(force))))
    assert moved == pytest.approx(-(condensed.compliance @ force) / e, rel=1e-5)
    assert whole == pytest.approx(-condensed.compliance / e, rel=1e-5, abs=1e-9)  # mm/N, round-off of 1e-10


def test_what_changes_the_mesh_has_none() -> None:
    model = half_cylinder(0.3)
    other = replace(model, mesh=replace(model.mesh, size_mm=0.25))
    with pytest.raises(Finger3dError, match="changes the mesh"):
        VariedBody(build(model)).variation(model, other, 1e-3)


def test_an_elastic_object_is_condensed_once_for_a_press_and_its_derivatives(monkeypatch: pytest.MonkeyPatch) -> None:
    model = small_section(object_compliance=ElasticObject(3.0, 0.3, 4.13), symmetry=(), object=Plane(tilt=0.03))
    condensed = list[object]()

    def counted(*given: Any) -> Condensation:
        condensed.append(given)
        return condense(*given)

    monkeypatch.setattr(elastic_object, "condense", counted)
    body = VariedBody(build(model))
    ways = parameters(model) | other_parameters(model)
    changed = [body.variation(way(-STEP), way(STEP), STEP).thing for way in ways.values()]
    assert len(condensed) == 1
    assert sum(thing is not None for thing in changed) > 3
