"""Energies of the parts of an increment: those of the parts add up to those of the press."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.parts import Substep, energies
from finger3d.mechanics.march.path import stations
from finger3d.mechanics.march.solve import Press
from finger3d.objects import Cylinder, Move
from tests.models import half_cylinder


def test_energies_of_parts_add_up() -> None:
    problem = build(replace(half_cylinder(0.3), object=Cylinder(radius_mm=10.0)))
    press = Press(problem)
    frames = [press.advance(station) for station in stations(problem.model.legs)]
    ends = [(press.formulation.start(problem), problem.origin)]
    ends += [(state, pose) for frame in frames for pose, state in frame.parts]
    parts = [Substep(a, b, Move(one, other)) for (a, one), (b, other) in pairwise((s, p) for s, p in ends)]
    work, lost = energies(problem, parts)
    assert work == pytest.approx(frames[-1].external_work_mJ, rel=1e-12)
    assert lost == pytest.approx(frames[-1].dissipation_mJ, rel=1e-12)
    assert energies(problem, []) == (0, 0)
