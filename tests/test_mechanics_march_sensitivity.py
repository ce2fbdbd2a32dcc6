"""Derivatives of the numbers of a press: their proportions, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.sensitivity import held_normals
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.mechanics.results.history import table_row
from finger3d.mechanics.small_strain.relaxation import Relaxation
from finger3d.mechanics.small_strain.variations import VariedBody
from tests.differences import STEP, differentiated
from tests.models import block, ended, fig9
from tests.test_mechanics_small_strain_path_tangents import PRESS, READINGS
from tests.viscous_cases import TWO


def test_forces_are_proportional_to_the_modulus_and_places_are_not() -> None:
    model = fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), friction=Coulomb(0.4), legs=PRESS, **READINGS)
    problem = build(model)
    ends = [replace(model, material=Isotropic(1.0 + h, 0.49)) for h in (-STEP, STEP)]
    stiffer = VariedBody(problem).variation(*ends, STEP)
    steps, slopes = differentiated(problem, [stiffer])
    value, slope = table_row(problem.points, steps[-1]), slopes[-1][0]
    for name in ("normal_force_N", "friction_sum_N", "taxel_t1_MPa", "dissipation_mJ"):
        assert slope[name] == pytest.approx(value[name], rel=1e-8)
    for name in ("stick_area_mm2", "gauge_g36", "marker_m1_x_mm"):
        assert slope[name] == pytest.approx(0.0, abs=1e-8 * abs(value[name]))


def test_places_of_gauges_move_readings_only() -> None:
    model = fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), friction=Coulomb(0.4), legs=PRESS, **READINGS)
    problem, gauge = build(model), model.gauges[0]
    places = [replace(model, gauges=(replace(gauge, x_mm=gauge.x_mm + h), *model.gauges[1:])) for h in (-STEP, STEP)]
    rubs = [replace(model, friction=Coulomb(0.4 + h)) for h in (-STEP, STEP)]
    moved, rubbed = (VariedBody(problem).variation(*ends, STEP) for ends in (places, rubs))
    assert moved.of_readings
    assert not rubbed.of_readings
    _, alone = differentiated(problem, [moved])
    _, both = differentiated(problem, [rubbed, moved])
    for (first,), (_, second) in zip(alone, both, strict=True):
        assert first == second
        assert first["gauge_g36"] != 0.0
        assert {first[name] for name in ("normal_force_N", "stick_area_mm2", "gauge_g20", "dissipation_mJ")} == {0.0}


def test_what_changes_the_mesh_and_what_increments_define_is_refused() -> None:
    model = fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), friction=Coulomb(0.4), legs=PRESS)
    problem = build(model)
    other = replace(model, mesh=MeshOptions(3.0, 10.0))
    with pytest.raises(Finger3dError, match="changes the mesh"):
        VariedBody(problem).variation(model, other, STEP)
    with pytest.raises(Finger3dError, match="rule"):
        differentiated(replace(problem, model=replace(model, rule="paper")), [])


@pytest.mark.parametrize("relaxation", [None, Relaxation(TWO, False)], ids=["elastic", "relaxing"])
def test_normals_that_were_held_are_counted(relaxation: Relaxation | None) -> None:
    problem, last = ended(block(relaxation=relaxation, legs=(Leg(0.3, steps=2, duration_s=1.0),)))
    assert held_normals(problem, last) == 0
    contact = last.meshed_state.contact
    touching = np.flatnonzero(contact.force[:, 0] > 0.0)[:2]
    bases, (c, s) = contact.own_bases.copy(), (math.cos(0.01), math.sin(0.01))
    bases[touching] = bases[touching] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(last.meshed_state, contact=replace(contact, bases=bases))
    assert held_normals(problem, replace(last, meshed_state=turned)) == 2
