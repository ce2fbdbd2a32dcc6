"""The finger of Maeno 2004, Fig. 9, and presses of which every increment must converge."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

from finger3d._types import Tree
from finger3d.contact.friction import Coulomb, FrictionLaw
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import Design, designs
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model

GEOMETRIES = Path(__file__).resolve().parents[1] / "geometries"
"""Scenes and designs that come with the program."""


def fig9_finger(width_mm: float = 20.0, radius_mm: float = 100.0, edge_height_mm: float = 36.6) -> Design:
    """Return the clipped cylinder of Fig. 9, 100 mm long; or another radius and height of its edges."""
    return designs()["clipped_cylinder"](
        radius_mm=radius_mm, half_length_mm=50.0, edge_height_mm=edge_height_mm, width_mm=width_mm
    )


def fig9_model(nu: float, size: float, base: float, domain: Domain = "solid", **fields: Any) -> Model:
    """Return the finger of Fig. 9 on a structured mesh, pressed 10 mm unless `fields` say otherwise."""
    mesh = MeshOptions(size, base, "swept")
    own = {"design": fig9_finger(), "legs": (Leg(10.0),)}
    return Model(material=Isotropic(1.0, nu), mesh=mesh, domain=domain, **own | fields)


def block_model(
    size_mm: Sequence[float], material: Isotropic, edges: tuple[float, float], legs: tuple[Leg, ...], **fields: Any
) -> Model:
    """Return a model of a block on a structured mesh.

    Parameters
    ----------
    size_mm : half its length, height and width
    edges : lengths at the contact and far from it, mm
    """
    half_length, height, width = size_mm
    block = designs()["block"](half_length_mm=half_length, height_mm=height, width_mm=width)
    return Model(block, material, MeshOptions(*edges, "swept"), legs, **fields)


def block_tables(size_mm: Sequence[float], E_MPa: float, nu: float, edges: Sequence[float], **tables: Any) -> Tree:
    """Return the tables of a block on a structured mesh, and others.

    Parameters
    ----------
    size_mm : half its length, height and width
    edges : lengths at the contact and far from it, mm
    """
    return {
        "finger": {"geometry": "block", **dict(zip(("half_length_mm", "height_mm", "width_mm"), size_mm, strict=True))},
        "material": {"E_MPa": E_MPa, "nu": nu},
        "mesh": {"mesher": "swept", "size_mm": edges[0], "base_size_mm": edges[1]},
        **tables,
    }


PAPER_GAUGE = Gauge("g", 36.0, 40.0, angle=math.radians(30.0))
"""The gauge of the paper, at a point; its depth is not told."""


def paper_gauges(length_mm: float, y_mm: float = 40.0) -> tuple[Gauge, Gauge]:
    """Return the gauge of 30 degrees at x = 36 mm, "g", and its mirror image, "m"."""
    turn = math.radians(30.0)
    return Gauge("g", 36.0, y_mm, 0.0, turn, length_mm), Gauge("m", -36.0, y_mm, 0.0, math.pi - turn, length_mm)


def changed(problem: Problem, **fields: Any) -> Problem:
    """Return a problem with other friction, legs or other data of its model; the condensed body is shared."""
    return replace(problem, model=replace(problem.model, **fields))


def converged(problem: Problem, workspace: Workspace | None = None) -> list[StepResult]:
    """Return the increments of a press.

    Raises
    ------
    AssertionError
        If one of them does not converge.
    """
    steps = list(march(problem, workspace=workspace))
    if not steps[-1].outcome.ok:
        raise AssertionError(f"mu = {problem.model.friction.mu:g}, {steps[-1].target}: {steps[-1].outcome}")
    return steps


def measured(problem: Problem) -> list[Tree]:
    """Return the numbers after every increment of a press, all of which must converge."""
    return [measure(problem.points, step) for step in converged(problem)]


def in_increments(legs: Sequence[Leg], count: int | Literal["auto"]) -> tuple[Leg, ...]:
    """Return legs with a number of increments each."""
    return tuple(replace(leg, steps=count) for leg in legs)


def under(problem: Problem, friction: FrictionLaw | float, steps: int | None = None) -> list[StepResult]:
    """Return the increments of a press under another friction, and in that many increments a leg."""
    law = Coulomb(friction) if isinstance(friction, int | float) else friction
    legs = problem.model.legs
    return converged(changed(problem, friction=law, legs=in_increments(legs, steps) if steps else legs))


def in_edges(model: Model, factor: float) -> Model:
    """Return the model with all edge lengths of its mesh times a factor."""
    own = model.mesh
    return replace(model, mesh=replace(own, size_mm=factor * own.size_mm, base_size_mm=factor * own.base_size_mm))


@contextmanager
def empty_mesh_cache() -> Iterator[None]:
    """Keep meshes in a folder of their own for a while, so that each is made anew once."""
    before = os.environ.get("FINGER3D_CACHE")
    with TemporaryDirectory(prefix="finger3d_meshes_") as folder:
        os.environ["FINGER3D_CACHE"] = folder
        try:
            yield
        finally:
            del os.environ["FINGER3D_CACHE"]
            if before is not None:
                os.environ["FINGER3D_CACHE"] = before
