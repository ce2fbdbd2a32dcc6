"""Does a scene that is turned about the press axis give the turned answer, for every object and by any angle?

Source: validation/REFERENCES.md, 7.2.  First a block is pressed off its middle by every shape of object in a pose of
its own, which is then dragged and twisted, and the same scene is turned by 180 degrees about y.  The swept mesh is its
own image under this rotation, so that the answers differ by round-off and by what the solver's residual leaves: forces
and moments along x and z change their sign, those along y do not.  In a section the turned scene is the mirror image.

Then the object, its place and its slide are turned by 17, 45 and other degrees: a triangulated oval body that is
pressed off the middle of a half ball and dragged.  If the tetrahedra of the half ball turn too, the answer turns
exactly, since Coulomb's cone is circular and no direction in the x-z plane is preferred.  If the mesh stays, it turns
up to the error of the mesh.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.contact.state import ContactState
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.meshing.generate import mesh_solid
from finger3d.objects import (
    ContactPath,
    Cylinder,
    MeshObject,
    PlacedObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
    first_touch,
)
from finger3d.objects.rigid import rotation

from ._common import Body, body, held_at, increment
from ._press import block_model, measured
from ._rows import Result, exact_columns, listed, together
from .triangulated_objects import ball

judged = listed(__file__)

POSE = {"turn_x": 0.06, "turn_y": 0.4, "turn_z": 0.1}
WRENCH = ("force_x_N", "force_y_N", "force_z_N", "moment_x_Nmm", "moment_y_Nmm", "moment_z_Nmm")
ROTATED = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])


def oval(sectors: int, turned: Float | None = None) -> Triangles:
    """An oval body about the origin, turned by a matrix (3, 3)."""
    round_ = ball(sectors)
    points = (round_.points - round_.points.mean(axis=0)) * [1.6, 1.0, 0.8]
    return Triangles(points if turned is None else points @ turned.T, round_.faces)


def objects() -> dict[str, RigidObject]:
    """Every shape, off the middle and in a pose of its own."""
    at: dict[str, Any] = {"x_mm": 0.7, "z_mm": 0.4, **POSE}
    return {
        "plane": Plane(tilt=0.02, **at),
        "cylinder": Cylinder(radius_mm=3.0, **at),
        "sphere": Sphere(radius_mm=3.0, **at),
        "wedge": Wedge(angle=0.5, tip_radius_mm=1.0, **at),
        "wave": Wave(wavelength_mm=6.0, amplitude_mm=0.3, **at),
        "mesh": MeshObject(surface=oval(24), **at),
    }


def rotated(model: Model) -> Model:
    """The scene rotated by 180 degrees about y; as rotations about x, y, z one after another."""
    obj = model.object
    turned = replace(obj, x_mm=-obj.x_mm, z_mm=-obj.z_mm, turn_y=obj.turn_y + math.pi, turn_z=-obj.turn_z)
    legs = tuple(
        replace(g, slide_x_mm=-g.slide_x_mm, slide_z_mm=-g.slide_z_mm, turn_x=-g.turn_x, turn_z=-g.turn_z)
        for g in model.legs
    )
    return replace(model, object=turned, legs=legs)


def pressed(obj: RigidObject, domain: Domain) -> Model:
    """A block under an object that is pressed, then dragged and twisted."""
    solid = domain == "solid"
    away = {"slide_x_mm": 0.1, "slide_z_mm": 0.05, "turn_y": 0.05} if solid else {"slide_x_mm": 0.1, "turn_z": 0.02}
    edges, legs = (1.0 if solid else 0.4, 1.5), (Leg(0.3, steps=2), Leg(0.3, steps=2, **away))
    more = {"object": obj, "friction": Coulomb(0.3), "domain": domain, "symmetry": ()}
    return block_model((4.0, 3.0, 6.0), Isotropic(1.0, 0.4), edges, legs, **more)


def wrench(model: Model) -> Float:
    """Force (N) and moment (N mm) on the finger at the end."""
    found = measured(build(model))[-1]
    return np.array([found[name] for name in WRENCH])


def _objects(quick: bool) -> Result:
    """Every object in a solid and a section; a sphere at large deformation."""
    cases = [(name, obj, domain, False) for name, obj in objects().items() for domain in ("solid", "plane-strain")]
    cases.append(("sphere", objects()["sphere"], "solid", True))
    rows, lines = [], []
    for name, obj, domain, large in cases if not quick else cases[4:8]:
        model = pressed(obj, domain)
        model = Effect().apply(model) if large else model
        first, second = wrench(model), wrench(rotated(model))
        change = float(np.abs(second - ROTATED * first).max() / np.linalg.norm(first[:3]))
        where = f"{domain}, large deformation" if large else domain
        rows.append(judged("largest-change-of-force-and-moment", change, name=name, where=where))
        lines.append((name, where, change, float(np.hypot(first[0], first[2]))))
    table = exact_columns("object domain change sideways", lines)
    return Result(tuple(rows), table, lambda figure: _draw_objects(figure, table))


def _draw_objects(figure: Any, table: dict[str, list[Any]]) -> None:
    axes = figure.subplots()
    domains = [d.replace("-", "\n").replace(", ", "\n") for d in table["domain"]]
    names = [f"{o}\n{d}" for o, d in zip(table["object"], domains, strict=True)]
    at = np.arange(len(names))
    axes.semilogy(at, np.maximum(table["change"], 1e-17), "o")
    axes.axhline(1e-6, color="k", lw=0.8, label="allowed")
    axes.set_xticks(at, names, fontsize=8)
    axes.set(ylabel="change over the force, rotated back", ylim=(1e-17, 1e-5))


DEPTH, SLIDE, PLACE, MU = 0.3, 0.15, np.array([0.6, 0.0, 0.2]), 0.3
FINGER = 4.0


def turn(degrees: float) -> Float:
    """Matrix (3, 3) that turns about y."""
    return rotation(0.0, math.radians(degrees), 0.0)


def finger(size: float) -> Mesh:
    """A half ball as tetrahedra."""
    design = designs()["hemisphere"](radius_mm=FINGER)
    return mesh_solid(design, MeshOptions(size, 1.5, "ftetwild"), (-2.0, 2.0, -2.0, 2.0))[0]


def condensed(mesh: Mesh) -> Body:
    """Contact points within 2 mm of the pole."""
    held = held_at(mesh, {"base": (0, 1, 2)})
    return body(mesh, Elasticity.of(1.0, 0.45), held, "contact", lambda p: np.hypot(p[:, 0], p[:, 2]) < 2.0)


def turned_oval(degrees: float, sectors: int) -> tuple[MeshObject, float]:
    """The object at its place, turned, and the height of its lowest point at first touch."""
    q = turn(degrees)
    obj = MeshObject(*(q @ PLACE)[[0, 2]], surface=oval(sectors, q))
    return obj, first_touch(ContactPath(designs()["hemisphere"](radius_mm=FINGER).top, obj, FINGER, FINGER)).height_mm


def dragged(soft: Body, degrees: float, steps: int, obj: MeshObject, touch: float) -> Float:
    """Force (2 steps, 3) on the finger, turned back: while it is pressed, and on the way of the slide."""
    q = turn(degrees)
    samples, out = soft.surface.samples, []
    state = None
    for depth, slide in [(DEPTH * k / steps, 0.0) for k in range(1, steps + 1)] + [
        (DEPTH, SLIDE * k / steps) for k in range(1, steps + 1)
    ]:
        moved = q @ np.array([slide, -depth, 0.0])
        near = np.hypot(samples[:, 0], samples[:, 2]) < 3.0
        gap = np.full(len(samples), 10.0)
        x, y, z = samples[near].T
        gap[near] = PlacedObject.of(obj, 0.0).height(x - moved[0], z - moved[2]) + touch - depth - y
        free = np.empty((len(soft.surface.nodes), 3))
        free[:, 0] = soft.surface.average @ gap
        free[:, 1:] = -moved[[0, 2]]
        state = state or ContactState.at_rest(np.maximum(free[:, 0], 0.0), 3)
        found = increment(state, free, soft.compliance, MU, DEPTH)
        assert found.outcome.ok, found.outcome
        state = found.state
        total = state.force.sum(axis=0)
        out.append(q.T @ [total[1], -total[0], total[2]])
    return np.array(out)


def _angles(quick: bool) -> Result:
    """One mesh turned with the scene, and the scene alone."""
    size, steps = (0.7, 2) if quick else (0.3, 4)
    angles = (0.0, 17.0) if quick else (0.0, 17.0, 45.0, 137.0)
    mesh = finger(size)
    rest = condensed(mesh)
    with_mesh, alone, touched = [], [], []
    for angle in angles:
        obj, found = turned_oval(angle, 24 if quick else 64)
        touched.append(found)
        touch = touched[0]  # the same height: what the search for it leaves is judged by itself
        turned = condensed(replace(mesh, points=mesh.points @ turn(angle).T)) if angle else rest
        with_mesh.append(dragged(turned, angle, steps, obj, touch))
        alone.append(dragged(rest, angle, steps, obj, touch))
    scale = np.linalg.norm(with_mesh[0][-1])
    exact = max(float(np.abs(f - with_mesh[0]).max()) / scale for f in with_mesh)
    meshed = max(float(np.abs(f - alone[0]).max()) / scale for f in alone)
    sideways = abs(with_mesh[0][-1, 0]) / abs(with_mesh[0][-1, 1])
    allowed = 0.03 if quick else 0.01
    rows = [
        judged("largest-change", exact),
        judged("change-of-first-touch", float(np.ptp(touched)), tolerance=1e-4 * DEPTH),
        judged("the-same-on-one-mesh-of", meshed, tolerance=allowed, size=size),
        judged("friction-over-force-at-the-end", sideways),
    ]
    world = np.array([turn(a) @ f[-1] for a, f in zip(angles, alone, strict=True)])
    table: dict[str, Any] = {"angle_deg": list(angles)}
    for name, forces in (("turned", with_mesh), ("one", alone)):
        table |= {f"{name}_mesh_F{axis}_N": [f[-1, i] for f in forces] for i, axis in enumerate("xyz")}
    return Result(tuple(rows), table, lambda figure: _draw_angles(figure, np.array(angles), with_mesh[0][-1], world))


def _draw_angles(figure: Any, angles: Float, first: Float, world: Float) -> None:
    """Friction at the end, as the standing observer sees it."""
    axes, (ahead, _, aside) = figure.subplots(), first
    around = np.linspace(0.0, angles.max(), 181)
    c, s = np.cos(np.radians(around)), np.sin(np.radians(around))
    for name, colour, turned, found in (
        ("x", "C0", ahead * c + aside * s, world[:, 0]),
        ("z", "C1", aside * c - ahead * s, world[:, 2]),
    ):
        axes.plot(around, turned, colour + "--", lw=1.0, label=f"{name}: that of 0 deg, turned")
        axes.plot(angles, found, colour + "o", label=f"{name}: solved on one mesh")
    axes.set(xlabel="angle of the scene, deg", ylabel="friction on the finger at the end, N")


def run(quick: bool) -> Result:
    """Every object in a solid and a section; one mesh turned with the scene, and the scene alone."""
    return together((10.0, 9.0), objects=_objects(quick), angles=_angles(quick))
