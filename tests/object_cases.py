"""A pad under an object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure


def pad(**changes: object) -> Model:
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2, "swept"), (Leg(0.3, steps=2),), friction=Coulomb(0.25)
    )  # fmt: skip
    return replace(model, **changes)


def pressed(model: Model) -> tuple[dict[str, float], np.ndarray]:
    problem = build(model)
    last = list(march(problem))[-1]
    assert last.outcome.ok
    return measure(problem.points, last), problem.points.points[last.state.status != OPEN]
