"""Does turning the object, its place and its slide by any angle about the press axis turn the result?

If the mesh turns too, exactly: the same tetrahedra of a half ball, turned by 17, 45 and other degrees, under a
triangulated oval body that is pressed off the middle and dragged.  Coulomb's cone is circular, so no direction in the
x-z plane is preferred.  If the mesh stays, up to the error of the mesh: the same scene on a user's finger, turned
against its tetrahedra.  Source: validation/REFERENCES.md, 7.2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import Coulomb
from finger3d.contact.law import ContactLaw
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.objects import ContactPath, MeshObject, PlacedObject, first_touch

from ._common import Body, body
from ._rows import Result, at_least, zero
from .triangulated_objects import ball

DEPTH, SLIDE, PLACE, MU = 0.3, 0.15, np.array([0.6, 0.0, 0.2]), 0.3
FINGER = 4.0


def turn(degrees: float) -> Float:
    """Matrix (3, 3) that turns about y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def finger(size: float) -> Mesh:
    """A half ball as tetrahedra."""
    design = designs()["hemisphere"](radius_mm=FINGER)
    return mesh_solid(design, MeshOptions(size, 1.5, "ftetwild"), (-2.0, 2.0, -2.0, 2.0))[0]


def condensed(mesh: Mesh) -> Body:
    """Contact points within 2 mm of the pole."""
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[np.unique(mesh.facets["base"])] = True
    return body(mesh, Elasticity.of(1.0, 0.45), held, "contact", lambda p: np.hypot(p[:, 0], p[:, 2]) < 2.0)


def oval(degrees: float, sectors: int) -> tuple[MeshObject, float]:
    """The object at its place, turned, and the height of its lowest point at first touch."""
    q = turn(degrees)
    round_ = ball(sectors)
    points = (round_.points - round_.points.mean(axis=0)) * [1.6, 1.0, 0.8] @ q.T
    obj = MeshObject(*(q @ PLACE)[[0, 2]], surface=Triangles(points, round_.faces))
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
        found = solve_increment(ContactProblem.of(state, free, soft.compliance, ContactLaw(Coulomb(MU)), DEPTH))
        assert found.outcome.ok, found.outcome
        state = found.state
        total = state.force.sum(axis=0)
        out.append(q.T @ [total[1], -total[0], total[2]])
    return np.array(out)


def run(quick: bool) -> Result:
    """One mesh turned with the scene, and the scene alone."""
    size, steps = (0.7, 2) if quick else (0.3, 4)
    angles = (0.0, 17.0) if quick else (0.0, 17.0, 45.0, 137.0)
    mesh = finger(size)
    rest = condensed(mesh)
    with_mesh, alone, touched = [], [], []
    for angle in angles:
        obj, found = oval(angle, 24 if quick else 64)
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
    one = f"the same on one mesh of size {size:g} mm"
    rows = [
        zero("largest change of the force, turned back, mesh turned too", "symmetry", exact, 1e-9,
            "the solver's residual of 1e-8 at worst, 1e-15 as a rule"),
        zero("largest change of the height of first touch, mm", "symmetry", float(np.ptp(touched)), 1e-4 * DEPTH,
            "1e-4 of the depth, or 1.5e-4 of the force; it is searched on finer and finer grids"),
        zero(one, "symmetry", meshed, allowed, "the mesh is not invariant under the rotation"),
        at_least("friction over force at the end", "mu = 0.3", 0.05, sideways, "friction acts"),
    ]  # fmt: skip
    world = np.array([turn(a) @ f[-1] for a, f in zip(angles, alone, strict=True)])
    table: dict[str, Any] = {"angle_deg": list(angles)}
    for name, forces in (("turned", with_mesh), ("one", alone)):
        table |= {f"{name}_mesh_F{axis}_N": [f[-1, i] for f in forces] for i, axis in enumerate("xyz")}
    return Result(tuple(rows), table, lambda figure: _draw(figure, np.array(angles), np.array(with_mesh), world))


def _draw(figure: Any, angles: Float, with_mesh: Float, world: Float) -> None:
    """Friction at the end, as the standing observer sees it, and the force over the increments, turned back."""
    left, right = figure.subplots(1, 2)
    around = np.linspace(0.0, angles.max(), 181)
    ahead, aside = with_mesh[0, -1, 0], with_mesh[0, -1, 2]
    c, s = np.cos(np.radians(around)), np.sin(np.radians(around))
    left.plot(around, ahead * c + aside * s, "C0--", lw=1.0, label="x: that of 0 deg, turned")
    left.plot(around, aside * c - ahead * s, "C1--", lw=1.0, label="z: that of 0 deg, turned")
    left.plot(angles, world[:, 0], "C0o", label="x: solved on one mesh")
    left.plot(angles, world[:, 2], "C1s", label="z: solved on one mesh")
    left.set(xlabel="angle of the scene, deg", ylabel="friction on the finger at the end, N")
    steps = np.arange(1, with_mesh.shape[1] + 1)
    for angle, force in zip(angles, with_mesh, strict=True):
        right.plot(steps, -force[:, 1], "o-", mfc="none", ms=4 + 3 * list(angles).index(angle), label=f"{angle:g} deg")
    right.set(xlabel="increment: press, then slide", ylabel="normal force, mesh turned too, N", xticks=steps)
