"""Does a scene that is rotated by half a turn about the press axis give the rotated answer, for every object?

A block is pressed off its middle by every shape of object in a pose of its own, which is then dragged and twisted.  The
same scene is rotated by 180 degrees about y.  The swept mesh is its own image under this rotation, so that the answers
differ by round-off and by what the solver's residual leaves: forces and moments along x and z change their sign, those
along y do not.  In a section the rotated scene is the mirror image.  Source: validation/REFERENCES.md, 7.2.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge

from ._press import converged
from ._rows import Result, zero
from .triangulated_objects import ball

POSE = {"turn_x": 0.06, "turn_y": 0.4, "turn_z": 0.1}
WRENCH = ("force_x_N", "force_y_N", "force_z_N", "moment_x_Nmm", "moment_y_Nmm", "moment_z_Nmm")
ROTATED = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])


def objects() -> dict[str, RigidObject]:
    """Every shape, off the middle and in a pose of its own."""
    at: dict[str, Any] = {"x_mm": 0.7, "z_mm": 0.4, **POSE}
    round_ = ball(24)
    oval = Triangles((round_.points - round_.points.mean(axis=0)) * [1.6, 1.0, 0.8], round_.faces)
    return {
        "plane": Plane(tilt=0.02, **at),
        "cylinder": Cylinder(radius_mm=3.0, **at),
        "sphere": Sphere(radius_mm=3.0, **at),
        "wedge": Wedge(angle=0.5, tip_radius_mm=1.0, **at),
        "wave": Wave(wavelength_mm=6.0, amplitude_mm=0.3, **at),
        "mesh": MeshObject(surface=oval, **at),
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
    block = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=6.0)
    mesh = MeshOptions(1.0 if solid else 0.4, 1.5, "swept")
    legs = (Leg(0.3, steps=2), Leg(0.3, steps=2, **away))
    return Model(block, Isotropic(1.0, 0.4), mesh, legs, object=obj, friction=Coulomb(0.3), domain=domain, symmetry=())


def wrench(model: Model) -> Float:
    """Force (N) and moment (N mm) on the finger at the end."""
    problem = build(model)
    last = converged(problem)[-1]
    found = measure(problem.points, last)
    return np.array([found[name] for name in WRENCH])


def run(quick: bool) -> Result:
    """Every object in a solid and a section; a sphere at large deformation."""
    cases = [(name, obj, domain, False) for name, obj in objects().items() for domain in ("solid", "plane-strain")]
    cases.append(("sphere", objects()["sphere"], "solid", True))
    table: dict[str, list[Any]] = {"object": [], "domain": [], "change": [], "sideways": []}
    rows = []
    for name, obj, domain, large in cases if not quick else cases[4:8]:
        model = pressed(obj, domain)
        model = Effect().apply(model) if large else model
        first, second = wrench(model), wrench(rotated(model))
        change = float(np.abs(second - ROTATED * first).max() / np.linalg.norm(first[:3]))
        where = f"{domain}, large deformation" if large else domain
        rows.append(
            zero(f"largest change of force and moment, rotated back, {name}, {where}", "symmetry", change, 1e-6,
                "the residual of 1e-8, times arms of some mm and the iteration over normals")
        )  # fmt: skip
        for key, value in zip(table, (name, where, change, float(np.hypot(first[0], first[2]))), strict=True):
            table[key].append(value)
    return Result(tuple(rows), table, lambda figure: _draw(figure, table))


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    axes = figure.subplots()
    names = [f"{o}\n{d.replace(', ', chr(10))}" for o, d in zip(table["object"], table["domain"], strict=True)]
    at = np.arange(len(names))
    axes.semilogy(at, np.maximum(table["change"], 1e-17), "o")
    axes.axhline(1e-6, color="k", lw=0.8, label="allowed")
    axes.set_xticks(at, names, fontsize=6)
    axes.set(ylabel="change over the force, rotated back", ylim=(1e-17, 1e-5))
