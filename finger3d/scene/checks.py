"""Checks that involve several keys: depth and height of the finger, gauges and outline, edge lengths and both."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from finger3d._ranges import LONGEST_SLIDE, at_least, at_most
from finger3d._types import Tree
from finger3d.geometry.design import Design
from finger3d.mechanics.model import Domain, MeshOptions
from finger3d.objects import RigidObject
from finger3d.scene.messages import dotted, shown
from finger3d.scene.tables import GaugeTable, LegTable, MeshTable, SceneTable

Box = tuple[float, float, float, float]

SIZE_SHARE, BASE_SHARE = 1 / 25, 1 / 6.25
"""Default edge lengths in a solid as shares of the finger's height; sections take a quarter of them. They leave less
than 1 % of the force in both, and .3 % of a gauge in a section (validation/cost_of_accuracy.py)."""

_ACROSS = 12.0  # elements across the overlap of a curved object, which is some 1.4 times as wide as the contact
_FINEST = 0.2  # of the default: finer is left to those who ask for it


def check(tables: SceneTable, legs: tuple[LegTable, ...], design: Design) -> list[str]:
    """Return the mistakes that only the whole scene shows, each in one line."""
    solid = tables.model.domain == "solid"
    lines = []
    if design.section() is None:
        lacks = f"finger.geometry = {shown(design.name)} has no constant section"
        if not solid:
            lines.append(f'model.domain = {shown(tables.model.domain)}: {lacks}; must be "solid"')
        if tables.mesh.mesher == "swept":
            lines.append(f'mesh.mesher = "swept": {lacks}; must be "ftetwild"')
    lines += _legs(tables.press, legs, design, solid)
    lines += _sizes(tables.mesh, design, solid)
    twice = [name for name, n in Counter(g.name for g in tables.gauge).items() if n > 1]
    lines += [f"gauge.name = {shown(name)}: used more than once; every gauge needs its own name" for name in twice]
    for i, gauge in enumerate(tables.gauge):
        lines += _gauge(i, gauge, design)
    return lines


def _legs(press: Tree, legs: tuple[LegTable, ...], design: Design, solid: bool) -> list[str]:
    lines = []
    height, half_length = design.height_mm, design.half_length_mm
    for i, leg in enumerate(legs):
        at = ("press", "leg", i) if "leg" in press else ("press",)
        allowed = f"a number above 0 and below the finger's height of {at_most(height)} mm"
        if i > 0 and _target(leg) == _target(legs[i - 1]) and leg.duration_s is None:
            lines.append(f"{dotted(at)}: goes nowhere, its target is that of the leg before; take it out")
        if (leg.depth_mm is None) == (leg.force_N is None):
            both = f"must not stand beside force_N = {shown(leg.force_N)}; give either a depth or a force"
            what = f"{dotted((*at, 'depth_mm'))}"
            lines.append(f"{what} is missing: give it, or force_N" if leg.force_N is None else f"{what}: {both}")
            continue
        if leg.depth_mm is None:
            pass
        elif i == 0 and leg.depth_mm == 0.0 and any(_target(leg)[2:]):
            lines.append(f"{dotted(at)}: moves before first touch; give the first leg a depth_mm above 0")
        elif leg.depth_mm >= height or (i == 0 and leg.depth_mm == 0.0):
            lines.append(f"{dotted((*at, 'depth_mm'))} = {shown(leg.depth_mm)}: must be {allowed}")
        for key in ("slide_x_mm", "slide_z_mm"):
            far = LONGEST_SLIDE * half_length
            if abs(value := getattr(leg, key)) > far:
                lines.append(
                    f"{dotted((*at, key))} = {shown(value)}: must be a number from -{at_most(far)} to {at_most(far)}, "
                    f"{LONGEST_SLIDE:g} times the finger's half length"
                )
        for key in () if solid else ("slide_z_mm", "turn_x_deg", "turn_y_deg"):
            if (value := getattr(leg, key)) != 0.0:
                lines.append(f"{dotted((*at, key))} = {shown(value)}: must be 0.0 in a 2D domain")
    return lines


def _target(leg: LegTable) -> tuple[float | None, ...]:
    return leg.force_N, leg.depth_mm, leg.slide_x_mm, leg.slide_z_mm, leg.turn_x_deg, leg.turn_y_deg, leg.turn_z_deg


def smallest_mm(design: Design, solid: bool) -> float:
    """Return the smallest extent of the meshed part, mm."""
    extents = [design.height_mm, 2.0 * design.half_length_mm]
    if solid:
        extents.append(design.width_mm)
    return min(extents)


def _sizes(mesh: MeshTable, design: Design, solid: bool) -> list[str]:
    for key in ("size_mm", "base_size_mm"):
        if mesh.tolerance is not None and (size := getattr(mesh, key)) is not None:
            return [
                f"mesh.tolerance = {shown(mesh.tolerance)}: must not stand beside mesh.{key} = {shown(size)}; "
                "give either sizes or a tolerance"
            ]
    if mesh.max_seconds is not None and mesh.tolerance is None:
        return [f"mesh.max_seconds = {shown(mesh.max_seconds)}: only with mesh.tolerance, whose refining it ends"]
    extent = smallest_mm(design, solid)
    section = smallest_mm(design, solid=False)
    if mesh.size_mm is not None and mesh.size_mm > extent:
        return [
            f"mesh.size_mm = {shown(mesh.size_mm)}: larger than the finger; must be at most {at_most(extent)}, "
            "its smallest extent"
        ]
    if mesh.base_size_mm is not None and mesh.base_size_mm > section:
        return [
            f"mesh.base_size_mm = {shown(mesh.base_size_mm)}: larger than the finger; must be at most "
            f"{at_most(section)}, its smallest extent in the section"
        ]
    if mesh.size_mm and mesh.base_size_mm and mesh.base_size_mm < mesh.size_mm:
        return [
            f"mesh.base_size_mm = {shown(mesh.base_size_mm)}: finer than the contact; "
            f"must be at least mesh.size_mm = {shown(mesh.size_mm)}"
        ]
    return []


def chosen(mesh: MeshTable, design: Design, domain: Domain, obj: RigidObject, box: Box) -> MeshOptions:
    """Return the mesh options, with sizes chosen where they are absent, from all else and the box of contact."""
    solid = domain == "solid"
    share = design.height_mm * (1.0 if solid else 0.25)
    size, base = mesh.size_mm, mesh.base_size_mm
    if size is None:
        # A thin finger gets two elements across its width; four significant digits keep scene.toml readable.
        coarse = min(share * SIZE_SHARE, smallest_mm(design, solid) / 2.0, base or math.inf)
        size = _rounded(max(min(coarse, _detail(obj, box, solid)), coarse * _FINEST))
    if base is None:
        base = max(_rounded(min(share * BASE_SHARE, smallest_mm(design, solid=False))), size)
    return MeshOptions(size, base, mesh.mesher)


def _detail(obj: RigidObject, box: Box, solid: bool) -> float:
    """Return the edge length, mm, that gives a curved object some elements across its contact or its crest."""
    if obj.is_flat:
        return math.inf
    x0, x1, z0, z1 = box
    across = min(x1 - x0, z1 - z0) if solid else x1 - x0
    detail = obj.detail
    wave = detail.length_mm if detail and detail.kind == "wavelength" else math.inf
    return min(across, wave) / _ACROSS


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def _gauge(index: int, gauge: GaugeTable, design: Design) -> list[str]:
    at = ("gauge", index)
    half_length, height = design.half_length_mm, design.height_mm
    half_width = design.width_mm / 2.0
    for key, value, low, high in (
        ("x_mm", gauge.x_mm, -half_length, half_length),
        ("y_mm", gauge.y_mm, 0.0, height),
        ("z_mm", gauge.z_mm, -half_width, half_width),
    ):
        if not low <= value <= high:
            return [
                f"{dotted((*at, key))} = {shown(value)}: gauge {shown(gauge.name)} is outside the finger; "
                f"must be a number from {at_least(low)} to {at_most(high)}"
            ]
    along = np.array([-0.5, 0.5]) * gauge.length_mm if gauge.length_mm else np.zeros(1)
    x = gauge.x_mm + along * math.cos(math.radians(gauge.angle_deg))
    y = gauge.y_mm + along * math.sin(math.radians(gauge.angle_deg))
    top = design.top(x, np.full_like(x, gauge.z_mm))
    slack = 1e-9 * height
    if not np.all((y >= -slack) & (y <= top + slack)):
        here = float(design.top(np.array([gauge.x_mm]), np.array([gauge.z_mm]))[0])
        if math.isnan(here):
            return [
                f"{dotted((*at, 'z_mm'))} = {shown(gauge.z_mm)}: gauge {shown(gauge.name)} is outside the finger; "
                f"must be nearer to 0 at x_mm = {shown(gauge.x_mm)}"
            ]
        if gauge.length_mm and gauge.y_mm <= here + slack:
            return [
                f"{dotted((*at, 'length_mm'))} = {shown(gauge.length_mm)}: an end of gauge {shown(gauge.name)} "
                "leaves the finger; must be shorter, or the gauge moved inward"
            ]
        return [
            f"{dotted((*at, 'y_mm'))} = {shown(gauge.y_mm)}: gauge {shown(gauge.name)} is outside the finger; "
            f"must be a number from 0 to {at_most(here)} at x_mm = {shown(gauge.x_mm)}"
        ]
    return []
