"""Does a triangulated ball or bar press like the exact one?

References: the height of a ball and of a bar in closed form.  The facets of a curved body lie inside it by the sagitta
s^2/8R of their edges s, so gaps, first touch and force have errors of O(s^2), and a rate of 2 is required.  Distances
from edges and corners are tested in tests/test_geometry_surfaces.py.

The finger is a block, 3D, swept, with the same mesh for all objects.  The triangulated objects are made here, as an STL
file would hold them, and moved off the origin.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg
from finger3d.objects import ContactPath, Cylinder, MeshObject, PlacedObject, RigidObject, Sphere, first_touch

from ._common import convergence, rate
from ._press import block_model, measured
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

RADIUS = 6.0
AWAY = (3.0, -2.0, 1.0)
"""Middle of the ball and the bar, mm."""


def of_trimesh(mesh: trimesh.Trimesh, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Triangles:
    """Return a mesh of trimesh, moved, as a triangulated surface."""
    return Triangles(np.array(mesh.vertices, dtype=float) + at, np.array(mesh.faces))


def ball(sectors: int) -> Triangles:
    """A ball of `sectors` around and half as many rings, its poles on y."""
    polar = np.linspace(0.0, np.pi, sectors // 2 + 1)
    curve = RADIUS * np.column_stack([np.sin(polar), -np.cos(polar)])
    upright = np.eye(4)[[0, 2, 1, 3]]  # trimesh revolves about z
    return of_trimesh(trimesh.creation.revolve(curve, sections=sectors, transform=upright), AWAY)


def bar(sectors: int) -> Triangles:
    """A bar along z, 20 mm long, `sectors` around, a multiple of four: a corner of its polygon is straight down."""
    return of_trimesh(trimesh.creation.cylinder(RADIUS, 20.0, sections=sectors), AWAY)


def box(*half_edges: float) -> Triangles:
    """A box about the origin."""
    return of_trimesh(trimesh.creation.box(2.0 * np.array(half_edges)))


def pressed(obj: RigidObject, size: float) -> float:
    """Normal force (N) of a press off the middle of a block."""
    more = {"object": obj, "friction": Coulomb(0.3)}
    model = block_model((5.0, 4.0, 8.0), Isotropic(1.0, 0.3), (size, 2.0), (Leg(0.4, steps=2),), **more)
    return float(measured(build(model))[-1]["normal_force_N"])


def run(quick: bool) -> Result:
    """Two shapes on three fineness levels."""
    levels = (24, 40, 64) if quick else (32, 64, 128, 256)
    size = 1.0 if quick else 0.4
    rows, table, curves = [], [], {}
    dome = designs()["clipped_cylinder"](20.0, 12.0, 3.0, 8.0)
    x, z = 0.7 + np.linspace(-3.0, 3.0, 101), 0.4 + np.linspace(-2.0, 2.0, 101)

    def touch(obj: RigidObject) -> float:  # on the side of the dome
        return first_touch(ContactPath(dome.top, replace(obj, x_mm=4.0), 12.0, 4.0)).height_mm

    for name, make, exact in (
        ("ball", ball, Sphere(0.7, 0.4, radius_mm=RADIUS)),
        ("bar", bar, Cylinder(0.7, radius_mm=RADIUS)),
    ):
        true = pressed(exact, size)
        errors: dict[str, list[float]] = {"height": [], "first touch": [], "force": []}
        for sectors in levels:
            obj = MeshObject(0.7, 0.4 if name == "ball" else 0.0, surface=make(sectors))
            away = PlacedObject.of(obj, 0.0).height(x, z) - PlacedObject.of(exact, 0.0).height(x, z)
            errors["height"].append(float(np.sqrt(np.mean(away**2))))
            errors["first touch"].append(abs(touch(obj) - touch(exact)))
            errors["force"].append(abs(pressed(obj, size) / true - 1.0))
            table.append((name, sectors, len(obj.surface.faces), *(e[-1] for e in errors.values())))
        edges = [2.0 * np.pi * RADIUS / n for n in levels]
        curves |= {f"{name}: {what}": e for what, e in errors.items()}
        sagitta = edges[-1] ** 2 / (8.0 * RADIUS)
        rows += [
            judged("rate-of-height", rate(edges, errors["height"]), name=name),
            judged("force", 1.0 + errors["force"][-1], tolerance=3.0 * sagitta / 0.4, name=name, finest=levels[-1]),
            judged("first-touch", errors["first touch"][-1], tolerance=sagitta, name=name),
        ]
    columns = "shape sectors triangles height_error_mm first_touch_error_mm force_error"
    return Result(tuple(rows), exact_columns(columns, table), lambda figure: _draw(figure, edges, curves))


def _draw(figure: Any, edges: list[float], curves: dict[str, list[float]]) -> None:
    labels = "edge of the object's triangles, mm", "error: height and first touch in mm, force relative"
    convergence(figure.subplots(), edges, curves, 2.0, *labels)
