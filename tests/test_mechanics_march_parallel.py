"""Presses at once give the results of presses in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from threading import Event
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.march.parallel import map_parallel
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from tests.models import block


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


def test_presses_nobody_waits_for_end_with_their_increment() -> None:
    """As after Ctrl-C: a long press at once with a short one, after which no more is asked."""
    problem = build(block())
    increments = {1: 0, 2000: 0}

    def press(steps: int, before: Sequence[Any], workspace: Workspace, cancel: Event) -> int:
        trial = replace(problem, model=replace(problem.model, legs=(Leg(0.3, steps=steps),)))
        for _ in march(trial, workspace=workspace, cancel=cancel):
            increments[steps] += 1
        return steps

    told = map_parallel(problem, press, list(increments), 2, threads_from=1)
    assert next(told) == 1
    told.close()
    assert increments[1] == 1
    assert increments[2000] < 2000
