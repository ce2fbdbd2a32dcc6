"""Hard cases at large deformation: random fingers and blocks, objects, paths, materials and friction.

Every scene follows from its number.  Bodies are 10 mm high, and the mesh is as coarse as resolves the object; depths go
to 40 % of the height, mu to 100, nu to 0.5.  A scene settles if all increments of all legs converge.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh

from finger3d._types import Float
from finger3d.analyses.study_rows import Row
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.material import Isotropic
from finger3d.fem.recover import displacement
from finger3d.geometry.design import Design
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.build import MARGIN, build
from finger3d.mechanics.coverage import SurfaceCheck, check_surface
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.solve import march
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge

HEIGHT = 10.0
SCENES, SCENES_QUICK = 320, 8
ROBUST = "what a robust method does; REFERENCES.md, 8.2"
_NU, _MU = (0.3, 0.4, 0.45, 0.49, 0.5), (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 10.0, 100.0)


@dataclass(frozen=True)
class Found:
    """Result of a scene.

    Attributes
    ----------
    settled : whether all increments converged
    folds : whether a cell at a sharp corner was turned inside out, and the state refused
    says : outcome of the increment that failed
    increments, factorizations, iterations : in all
    penetration : deepest place of the surface inside the object, over the depth
    outside : whether no point of the surface is inside the object but those in contact
    least_volume : smallest ratio of deformed to initial volume at the nodes of all cells, over all increments
    """

    settled: bool
    folds: bool
    says: str
    increments: int
    factorizations: int
    iterations: int
    penetration: float
    outside: bool
    least_volume: float


def scene(number: int) -> Model:
    """Return the model of a scene."""
    rng = np.random.default_rng(number)
    solid = bool(rng.uniform() < 0.25)
    domain = "solid" if solid else str(rng.choice(["plane-strain", "plane-strain", "plane-stress"]))
    size = HEIGHT / (6.0 if solid else 12.0) * rng.uniform(0.7, 1.2)
    return Effect().apply(
        Model(
            _finger(rng, float(rng.uniform(4.0, 16.0)) if solid else HEIGHT),
            Isotropic(1.0, float(rng.choice(_NU))),
            MeshOptions(size, 2.0 * size, "swept"),
            _path(rng, solid),
            object=_object(rng, solid),
            friction=Coulomb(float(rng.choice(_MU))),
            domain=domain,  # type: ignore[arg-type]
        )
    )


def _finger(rng: np.random.Generator, width: float) -> Design:
    kind = rng.choice(["block", "block", "half_cylinder", "clipped_cylinder", "clipped_cylinder"])
    if kind == "block":
        return designs()["block"](half_length_mm=float(rng.uniform(4.0, 15.0)), height_mm=HEIGHT, width_mm=width)
    if kind == "half_cylinder":
        return designs()["half_cylinder"](radius_mm=HEIGHT, width_mm=width)
    edge, half = rng.uniform(2.0, 8.0), rng.uniform(8.0, 14.0)
    rise = HEIGHT - edge
    radius = float((half**2 + rise**2) / (2.0 * rise))
    return designs()["clipped_cylinder"](
        radius_mm=radius, half_length_mm=float(half), edge_height_mm=float(edge), width_mm=width
    )


def _object(rng: np.random.Generator, solid: bool) -> RigidObject:
    x = float(rng.uniform(-2.0, 2.0)) if rng.uniform() < 0.5 else 0.0
    axis = str(rng.choice(["z", "x"])) if solid else "z"
    match rng.choice(["plane", "plane", "cylinder", "sphere" if solid else "cylinder", "wedge", "wave", "mesh"]):
        case "cylinder":
            return Cylinder(x_mm=x, radius_mm=float(rng.uniform(4.0, 20.0)), axis=axis)  # type: ignore[arg-type]
        case "sphere":
            return Sphere(x_mm=x, radius_mm=float(rng.uniform(5.0, 20.0)))
        case "wedge":
            angle, radius = np.radians(rng.uniform(10.0, 40.0)), rng.uniform(2.0, 4.0)
            return Wedge(x_mm=x, angle=float(angle), tip_radius_mm=float(radius))
        case "wave":
            length, amplitude = rng.uniform(8.0, 20.0), rng.uniform(0.1, 0.6)
            return Wave(x_mm=x, wavelength_mm=float(length), amplitude_mm=float(amplitude))
        case "mesh" if solid:
            ball = trimesh.creation.icosphere(subdivisions=3, radius=float(rng.uniform(6.0, 15.0)))
            return MeshObject(x_mm=x, surface=Triangles(np.array(ball.vertices), np.array(ball.faces)))
    return Plane(tilt=float(np.radians(rng.uniform(-10.0, 10.0))) if rng.uniform() < 0.5 else 0.0)


def _path(rng: np.random.Generator, solid: bool) -> tuple[Leg, ...]:
    """Press; often slide, turn, and release half or all of it."""
    depth, steps = float(rng.uniform(0.05, 0.4) * HEIGHT), int(rng.integers(3, 11))
    legs, place = [Leg(depth, steps=steps)], {}
    if rng.uniform() < 0.4:
        place = {"slide_x_mm": float(rng.uniform(-0.5, 0.5) * depth)}
        if solid:
            place["slide_z_mm"] = float(rng.uniform(-0.3, 0.3) * depth)
        legs.append(Leg(depth, steps=steps, **place))
    if rng.uniform() < 0.2:
        place["turn_z"] = float(np.radians(rng.uniform(-5.0, 5.0)))
        if solid:
            place["turn_y"] = float(np.radians(rng.uniform(-15.0, 15.0)))
        legs.append(Leg(depth, steps=steps, **place))
    if rng.uniform() < 0.4:
        legs.append(Leg(float(rng.choice([0.0, 0.5])) * depth, steps=steps, **place))
    return tuple(legs)


def solved(model: Model) -> Found | None:
    """Return the result of a scene, pressed again with more candidate points if contact left them; None if refused."""
    for margin in (MARGIN, np.inf):
        try:
            problem = build(model, margin=margin)
        except Finger3dError:  # the mesh is too coarse for the object
            return None
        workspace = model.formulation.workspace()
        steps = list(march(problem, workspace=workspace))
        good = [step for step in steps if step.outcome.ok]
        checks = check_surface(problem, good)
        if all(check.within_candidates for check in checks):
            break
    return _found(problem, steps, checks, workspace.factorizations)


def _found(problem: Problem, steps: list[StepResult], checks: list[SurfaceCheck], factorizations: int) -> Found:
    model, good = problem.model, [step for step in steps if step.outcome.ok]
    return Found(
        settled=steps[-1].outcome.ok,
        folds=steps[-1].outcome is Outcome.INVERTED,
        says=str(steps[-1].outcome),
        increments=sum(int(leg.steps) for leg in model.legs),
        factorizations=factorizations,
        iterations=sum(step.iterations for step in steps),
        penetration=max((check.penetration_mm for check in checks), default=0.0) / model.largest_depth_mm,
        outside=all(check.within_candidates for check in checks),
        least_volume=min((_least_volume(problem, step) for step in good), default=1.0),
    )


def _least_volume(problem: Problem, step: StepResult) -> float:
    """Smallest determinant of the deformation gradient at the nodes of all cells, in the plane of a section."""
    mesh = problem.mesh
    u: Float = displacement(mesh, problem.model.formulation.unknowns(problem, step.part))
    gradients, _ = mesh.element.physical_gradients(mesh.points[mesh.cells], mesh.element.nodes)
    slope = np.einsum("eki,eqkj->eqij", u[mesh.cells], gradients, optimize=True)
    return float(np.linalg.det(slope + np.eye(mesh.dim)).min())


def results(count: int) -> Iterator[Found]:
    """Yield the results of the first scenes that are not refused."""
    number = 0
    while count:
        found = solved(scene(number))
        number += 1
        if found is not None:
            count -= 1
            yield found


def rows(quick: bool) -> list[Row]:
    """How many scenes settle, at what cost, and whether anything is inside the object or inverted."""
    found = list(results(SCENES_QUICK if quick else SCENES))
    here = f"large deformation, {len(found)} random scenes"
    unsettled = [f for f in found if not f.settled]
    increments = sum(f.increments for f in found)

    def bound(what: str, most: float, got: float, reason: str) -> Row:
        return Row(f"{here}: {what}", ROBUST, float(most), float(got), 0.0, reason, measure="at most")

    return [
        bound("share unsettled", 0.02, len(unsettled) / len(found), "sharp corners that fold without end"),
        bound("unsettled without advice", 0, sum("try" not in f.says for f in unsettled), "none"),
        Row(f"{here}: unsettled where no sharp corner folds", "goal of this project", 0.0,
            float(sum(not f.folds for f in unsettled)), 0.0, "none", "statement", "at most"),
        bound("scenes with a point inside the object that is not in contact", 0, sum(not f.outside for f in found),
              "none"),
        bound("median of the deepest place inside the object, over the depth", 0.03,
              float(np.median([f.penetration for f in found])), "between points of coarse meshes"),
        Row(f"{here}: smallest ratio of volumes at any node", ROBUST, 0.0, min(f.least_volume for f in found), 0.0,
            "no cell inverted", measure="at least"),
        bound("factorisations of an increment", 3.0, sum(f.factorizations for f in found) / increments,
              "goal of this project"),
    ]  # fmt: skip
