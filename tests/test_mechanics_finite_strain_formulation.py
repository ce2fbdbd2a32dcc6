"""Finite strain in the limit of small ones, and of a part in the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder
from tests.models import large_fig9


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_light_load_is_small_strain(nu: float) -> None:
    ratios = []
    for depth in (0.08, 0.01):
        model = large_fig9(nu, legs=(Leg(depth, steps=8),), mesh=MeshOptions(0.2, 8.0))
        problem = build(model)
        small = list(march(replace(problem, model=replace(model, hyperelastic_law=None))))
        large = list(march(problem))
        a, b = (measure(problem.points, f[-1]) for f in (small, large))
        ratios.append(abs(b["normal_force_N"] / a["normal_force_N"] - 1.0))
    assert ratios[0] < 0.01
    assert ratios[1] < 0.6 * ratios[0]  # the strain goes with the root of the depth: 0.35


def test_quarter_and_whole_agree_in_3d_and_curved_objects_are_followed() -> None:
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(1.0, 1.5, "swept"), (Leg(0.6, steps=3),),
        object=Cylinder(radius_mm=3.0), friction=Coulomb(0.3),
    )  # fmt: skip
    ends = []
    for axes in (("x", "z"), ()):
        problem = build(Effect().apply(replace(model, symmetry=axes)))
        *_, end = march(problem)
        assert end.outcome.ok
        ends.append(measure(problem.points, end))
        at = problem.points.points + 0.0
        u = np.zeros_like(at)
        touching = end.state.status != OPEN
        assert end.state.bases is not None
        # where it touches the flank, the force leans outward with the cylinder's normal
        world = problem.points.with_basis_of(end.state).to_global(end.state.force * [1.0, 0.0, 0.0])[touching]
        lean = world[:, 0] * np.sign(at[touching, 0])
        assert lean[np.abs(at[touching, 0]) > 0.4].min() > 0.0
        assert u.shape == at.shape
    for key in ("normal_force_N", "friction_sum_N", "dissipation_mJ", "external_work_mJ"):
        assert ends[0][key] == pytest.approx(ends[1][key], rel=1e-6)
