"""Random sections and solids on which error estimates are tested; none was used to choose their rules."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model
from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge

from ._press import fig9_finger

NEAR = (Gauge("a", 1.5, 4.0, angle=0.5), Gauge("b", 3.0, 3.0, angle=0.7), Gauge("c", 0.0, 3.5))
FAR = (Gauge("a", 36.0, 40.0, angle=0.5), Gauge("b", 20.0, 44.0, angle=0.2), Gauge("c", 5.0, 40.0))
UNDER = (Gauge("a", 0.5, 7.5, angle=0.5), Gauge("b", 0.0, 7.0), Gauge("c", 3.0, 6.0, angle=0.3))


Shape = tuple[Any, Any, tuple[Gauge, ...], float, float]
"""Design, object, gauges, and largest depth and usual edge length at the contact, mm."""


def scene(
    shape: Shape, nu: float, mu: float, share: float, size: float = 1.0, domain: Domain = "solid", steps: int = 10,
    **slide: float,
) -> tuple[str, Model]:  # fmt: skip
    """Name and model of a shape that is pressed by a share of its depth, then slid by shares of that.

    Parameters
    ----------
    size : edge length over the usual one; edges at the base are four times as long
    """
    design, rigid, gauges, depth, edge = shape
    legs = (Leg(share * depth, steps=steps),)
    if slide:
        legs += (replace(legs[0], **{key: factor * share * depth for key, factor in slide.items()}),)
    mesher, plane = ("swept", "") if domain == "solid" else ("ftetwild", f"{domain}, ")  # of sections both are the same
    mesh = MeshOptions(size * edge, 4.0 * size * edge, mesher)
    model = Model(
        design, Isotropic(1.0, nu), mesh, legs, object=rigid, friction=Coulomb(mu), gauges=gauges, domain=domain
    )
    return f"{type(rigid).__name__} on {design.name}, {plane}nu = {nu:.3g}, mu = {mu:.3g}", model


def drawn(count: int, seed: int = 2026) -> Iterator[tuple[str, Model]]:
    """Names and models: eight shapes in turn; nu, mu, plane state, depth and edge length at random."""
    random = np.random.default_rng(seed)
    half = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    fig9 = fig9_finger()
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    for number in range(count):
        u = random.uniform(size=7)
        nu = (0.5 * u[0], 0.4 + 0.1 * u[0], 0.49, 0.5)[int(4 * u[1])]
        plane: Domain = ("plane-stress", "plane-strain")[int(2 * u[2])]
        mu, part, size = 0.03 * 40.0 ** u[3], 0.3 + 0.7 * u[4], 0.6 + 0.8 * u[5]
        shapes: tuple[Shape, ...] = (
            (fig9, Plane(), FAR, 10.0, 1.5),
            (half, Plane(), NEAR, 1.0, 0.15),
            (half, Wedge(angle=math.radians(10.0 + 30.0 * u[6]), tip_radius_mm=0.3), NEAR, 1.0, 0.15),
            (fig9, Wave(wavelength_mm=8.0 + 17.0 * u[6], amplitude_mm=0.5), FAR, 6.0, 1.2),
            (block, Cylinder(radius_mm=5.0 + 25.0 * u[6]), UNDER, 0.8, 0.15),
            (fig9, Plane(tilt=math.radians(2.0 + 10.0 * u[6])), FAR, 6.0, 1.5),
            (half, Plane(), NEAR, 1.0, 0.15),
            (half, Cylinder(radius_mm=3.0 + 17.0 * u[6]), NEAR, 1.0, 0.15),
        )
        kind = number % len(shapes)
        slide = {"slide_x_mm": 0.02 + 0.48 * u[6]} if kind == 6 else {}
        name, model = scene(shapes[kind], nu, mu, part, size, plane, **slide)
        yield f"{number}: {name}", model


def drawn_solids(count: int, seed: int) -> Iterator[tuple[str, Model]]:
    """Names and models of swept solids: four scenes in turn; nu, mu, depth, edge length and object at random."""
    random = np.random.default_rng(seed)
    half = designs()["half_cylinder"](radius_mm=5.0, width_mm=6.0)
    fig9 = fig9_finger()
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    for number in range(count):
        u = random.uniform(size=6)
        nu, mu = (0.5 * u[0], 0.4 + 0.1 * u[0])[int(2 * u[1])], 0.03 * 40.0 ** u[2]
        part, size = 0.3 + 0.7 * u[3], 0.8 + 0.5 * u[4]
        shapes: tuple[Shape, ...] = (
            (fig9, Plane(tilt=math.radians(2.0 + 8.0 * u[5])), FAR, 6.0, 4.0),
            (block, Sphere(radius_mm=6.0 + 20.0 * u[5]), UNDER, 0.8, 1.2),
            (fig9, Plane(), FAR, 8.0, 4.0),
            (half, Cylinder(radius_mm=3.0 + 17.0 * u[5]), NEAR, 1.0, 0.8),
        )
        kind = number % len(shapes)
        slide = {"slide_z_mm": 0.3 * u[5]} if kind == 2 else {}
        name, model = scene(shapes[kind], nu, mu, part, size, steps=5, **slide)
        yield f"solid {number}: {name}", model
