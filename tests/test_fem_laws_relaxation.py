"""Relaxation by a Prony series."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.viscosity import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.objects import Plane
from tests.models import marched
from tests.viscous_cases import RAMP_AND_HOLD, TWO, block, mean_relaxation, viscous


def test_uniform_compression_relaxes_as_the_series_says() -> None:
    # nu = 0 under a flat plate: a bar, stress = E int r(t - s) d'(s) ds / h
    problem = build(block(material=Isotropic(2.0, 0.0), object=Plane(), friction=Coulomb(0.0), legs=RAMP_AND_HOLD))
    held = viscous(problem)
    for frame in marched(held):
        t = frame.target.time_s
        mean = mean_relaxation(TWO, np.array(max(t - 1.0, 0.0)), np.array(t)) * min(t, 1.0)
        stress = 2.0 * 0.3 / 3.0 * float(mean)
        pressure = frame.state.force[:, 0] / problem.points.area
        assert pressure == pytest.approx(stress, rel=1e-9)
        _, strain, sigma = formulation_of(held.model).fields(held, frame.meshed_state)
        assert sigma[:, 1, 1] == pytest.approx(-stress, rel=1e-9)
        assert strain[:, 1, 1] == pytest.approx(-min(t, 1.0) * 0.1, rel=1e-9)


def test_settings_are_kept_as_the_model_compares_them() -> None:
    assert Effect(((0.3, 0.5),)).apply(block()) == Effect(((0.3, 0.5),)).apply(block())
    assert Relaxation(((0.3, 0.5),), True) != Relaxation(((0.3, 0.5),), False)
