"""Does large deformation settle in every case a user can write, with nothing inside the object or inverted?

Random fingers and blocks, objects, paths, materials and friction; every scene follows from its number.  Bodies are 10
mm high; depths go to 40 % of the height, mu to 100, nu to 0.5.  A scene settles if all increments of all legs converge.

The meshes are coarse, 4 to 12 times as coarse as those a scene gets by default: that is harder to settle, and lets the
object in between the contact points.  What of this is left on default meshes is seen in the presses (first legs) of the
first scenes again, with the edge lengths of a scene that gives none; solids are cut to 5 mm of width, with the object
above their middle, so that a quarter is meshed.  Most of these solids touch with their rims; balls in the middle of a
block do not.  Blocks pressed deep fold at their corners, most at the bonded ones, and settle after some hundred
factorisations.  Penetration is the deepest place of the whole free surface in any increment, over the depth of the
press; it is at a sharp edge if its facet or the one beside it ends there, which a corner that folds over lifts as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import quadrature
from finger3d.geometry.design import Design, designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import SurfaceCheck, check_surface
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.scene.mesh_sizes import mesh_options
from finger3d.scene.tables import MeshTable

from ._paper import moved
from ._press import block_model
from ._rows import Result, Row, Settled, grouped, listed, of_records, settled
from .triangulated_objects import of_trimesh

judged = listed(__file__)

HEIGHT = 10.0
SCENES, SCENES_QUICK = 320, 8
RESOLVED, RESOLVED_QUICK = {2: 49, 3: 11}, {2: 2, 3: 0}
BALLS = ((5.0, 0.8), (8.0, 0.8), (15.0, 1.0))
"""Radius and depth, mm, of balls that touch nothing but the middle of a block."""

RESOLVED_WIDTH = 5.0
_NU, _MU = (0.3, 0.4, 0.45, 0.49, 0.5), (0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 10.0, 100.0)


@dataclass(frozen=True)
class Found:
    """Result of a scene.

    Attributes
    ----------
    settled : whether all increments converged
    folds : whether it ended at a sharp edge of the finger, with a cell compressed there or folded over
    says : outcome of the increment that failed
    increments, converged, factorizations : in all
    residual : the largest of the increments that converged, dimensionless
    penetration : deepest place of the surface inside the object, over the depth
    at_sharp_edge : whether it is beside a sharp edge of the finger, or under an object that has edges
    outside : whether no point of the surface is inside the object but those in contact
    least_volume : smallest ratio of deformed to initial volume at the quadrature points, over all increments
    """

    settled: bool
    folds: bool
    says: str
    increments: int
    converged: int
    residual: float
    factorizations: int
    penetration: float
    at_sharp_edge: bool
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


def resolved_scene(number: int) -> Model:
    """Return the press of a scene on the mesh that is chosen by default."""
    model = scene(number)
    if model.domain == "solid":
        design = replace(model.design, width_mm=min(model.design.width_mm, RESOLVED_WIDTH))  # type: ignore[type-var]
        model = replace(model, design=design, object=replace(model.object, x_mm=0.0))
    return _by_default(replace(model, legs=model.legs[:1]))


def ball(radius_mm: float, depth_mm: float) -> Model:
    """Return the press of a ball into the middle of a block on the mesh that is chosen by default."""
    more = {"object": Sphere(radius_mm=radius_mm), "friction": Coulomb(0.5)}
    model = block_model((6.0, HEIGHT, 12.0), Isotropic(1.0, 0.45), (1.0, 1.0), (Leg(depth_mm, steps=4),), **more)
    return Effect().apply(_by_default(model))


def _by_default(model: Model) -> Model:
    """Return a model with the edge lengths of a scene that gives none."""
    table = MeshTable(mesher="swept")
    box = model.first_contact.contact_box
    return replace(model, mesh=mesh_options(table, model.design, model.domain, model.object, box))


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
            return MeshObject(x_mm=x, surface=of_trimesh(ball))
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
        workspace = formulation_of(model).workspace()
        steps = list(march(problem, workspace=workspace))
        good = [step for step in steps if step.outcome.ok]
        checks = check_surface(problem, good)
        if all(check.within_candidates for check in checks):
            break
    return _found(problem, steps, checks, workspace.factorizations)


def _found(problem: Problem, steps: list[StepResult], checks: list[SurfaceCheck], factorizations: int) -> Found:
    model, good = problem.model, [step for step in steps if step.outcome.ok]
    last = steps[-1]
    deepest = max(checks, key=lambda check: check.penetration_mm, default=None)
    return Found(
        settled=last.outcome.ok,
        folds="sharp edge of the finger" in last.detail,
        says=f"{last.outcome} ({last.detail})" if last.detail else str(last.outcome),
        increments=sum(int(leg.steps) for leg in model.legs),
        converged=len(good),
        residual=max((step.residual for step in good), default=0.0),
        factorizations=factorizations,
        penetration=deepest.penetration_mm / model.largest_depth_mm if deepest else 0.0,
        at_sharp_edge=isinstance(model.object, MeshObject) or bool(deepest and deepest.at_crease),
        outside=all(check.within_candidates for check in checks),
        least_volume=min((_least_volume(problem, step) for step in good), default=1.0),
    )


def _least_volume(problem: Problem, step: StepResult) -> float:
    """Smallest determinant of the deformation gradient at the quadrature points, in the plane of a section."""
    mesh = problem.mesh
    u = moved(problem, step)
    gradients, _ = mesh.element.physical_gradients(mesh.points[mesh.cells], quadrature(mesh.dim, 2)[0])
    slope = np.einsum("eki,eqkj->eqij", u[mesh.cells], gradients, optimize=True)
    return float(np.linalg.det(slope + np.eye(mesh.dim)).min())


def coarse(count: int) -> Iterator[tuple[int, Model, Found]]:
    """Yield number, model and result of the first scenes that are not refused."""
    number = 0
    while count:
        model = scene(number)
        if (found := solved(model)) is not None:
            count -= 1
            yield number, model, found
        number += 1


def resolved(counts: dict[int, int]) -> Iterator[tuple[int, Model, Found]]:
    """Yield number, model and result of presses on default meshes, as many as asked for of sections and solids."""
    left, number = dict(counts), 0
    while any(left.values()):
        dim = 3 if scene(number).domain == "solid" else 2
        if left[dim]:
            model = resolved_scene(number)
            if (found := solved(model)) is not None:
                left[dim] -= 1
                yield number, model, found
        number += 1


def balls(count: int) -> Iterator[tuple[int, Model, Found]]:
    """Yield number, model and result of the presses of balls."""
    for number, (radius, depth) in enumerate(BALLS[:count]):
        model = ball(radius, depth)
        found = solved(model)
        assert found is not None
        yield number, model, found


def run(quick: bool) -> Result:
    """Solve the scenes on their coarse meshes, and some of them on those of default."""
    found = {
        "coarse": list(coarse(SCENES_QUICK if quick else SCENES)),
        "default": list(resolved(RESOLVED_QUICK if quick else RESOLVED)),
        "balls": list(balls(1 if quick else len(BALLS))),
    }
    table = _table(found)
    rows = (*_settling([f for *_, f in found["coarse"]]), *_penetration(found))
    counts = [Settled(f.converged, f.increments, f.residual) for scenes in found.values() for *_, f in scenes]
    return Result(rows, table, lambda figure: _draw(figure, table), settled(counts))


def _settling(found: Sequence[Found]) -> list[Row]:
    """How many scenes settle, at what cost, and whether a cell is inverted."""
    here = f"{len(found)} random scenes"
    unsettled = [f for f in found if not f.settled]
    increments = sum(f.increments for f in found)
    return [
        judged("share-unsettled", len(unsettled) / len(found), here=here),
        judged("unsettled-without-cure", sum(not _cured(f) for f in unsettled), here=here),
        judged("unsettled-without-fold", sum(not f.folds for f in unsettled), here=here),
        judged("point-inside", sum(not f.outside for f in found), here=here),
        judged("least-ratio-of-volumes", min(f.least_volume for f in found), here=here),
        judged("factorisations", sum(f.factorizations for f in found) / increments, here=here),
    ]


def _cured(found: Found) -> bool:
    """Whether the outcome names the place or the length at fault in one line, and what to try."""
    return "try" in found.says and "mm" in found.says and "\n" not in found.says


def _penetration(found: dict[str, list[tuple[int, Model, Found]]]) -> Iterator[Row]:
    """How deep the object is between the contact points, over the depth."""
    for mesh in ("coarse", "default"):
        for kind, solid in (("sections", False), ("solids", True)):
            here = [f for _, model, f in found[mesh] if (model.domain == "solid") == solid]
            if here:
                yield judged("penetration", max(f.penetration for f in here), count=len(here), kind=kind, mesh=mesh)
    for kind, some in (("sections", found["default"]), ("solids under balls", found["balls"])):
        smooth = [
            f for _, model, f in some if not f.at_sharp_edge and (model.domain == "solid") == (kind != "sections")
        ]
        if smooth:
            yield judged(
                "penetration-away-from-edges", max(f.penetration for f in smooth), count=len(smooth), kind=kind
            )
    ended, count = [f for *_, f in found["default"] if not f.settled], len(found["default"])
    yield judged("share-that-ends-early", len(ended) / count, count=count)
    yield judged("ends-early-without-cure", sum(not _cured(f) for f in ended), count=count)


def _table(found: dict[str, list[tuple[int, Model, Found]]]) -> dict[str, list[Any]]:
    rows = [
        {
            "mesh": mesh, "scene": number, "domain": model.domain, "finger": model.design.name,
            "object": type(model.object).__name__.lower(), "nu": model.material.nu, "mu": model.friction.mu,  # type: ignore[attr-defined]
            "depth_mm": model.largest_depth_mm, "size_mm": model.mesh.size_mm, "settled": f.settled,
            "penetration_over_depth": f.penetration,
            "at_sharp_edge": f.at_sharp_edge if mesh != "coarse" else "",  # coarse edges blur where it is
            "increments": f.increments, "converged": f.converged, "residual": f.residual,
            "factorizations": f.factorizations, "least_volume": f.least_volume,
        }
        for mesh, scenes in found.items()
        for number, model, f in scenes
    ]  # fmt: skip
    return of_records(rows)


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    left, right = figure.subplots(1, 2)
    for (mesh, solid), t in grouped(table | {"solid": [d == "solid" for d in table["domain"]]}, "mesh", "solid"):
        share, color = 100.0 * np.maximum(t["penetration_over_depth"], 1e-6), "C1" if solid else "C0"
        name = "balls, default meshes" if mesh == "balls" else f"{'solids' if solid else 'sections'}, {mesh} meshes"
        left.loglog(t["size_mm"], share, color + {"coarse": ".", "default": "o", "balls": "^"}[mesh], label=name)
        style = color + {"coarse": ":", "default": "-", "balls": "--"}[mesh]
        right.step(np.sort(share), np.linspace(0.0, 100.0, len(share)), style, label=name)
    left.axhline(1.0, color="k", lw=0.8, ls=":")
    right.axvline(1.0, color="k", lw=0.8, ls=":")
    left.set(xlabel="edge length at the contact (mm)", ylabel="largest penetration, % of the depth")
    right.set(xlabel="largest penetration, % of the depth", ylabel="share of the scenes, %", xscale="log")
