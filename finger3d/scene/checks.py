"""Checks that involve several keys: depth and height of the finger, readings and outline, edge lengths and both."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

import numpy as np

from finger3d._ranges import LONGEST_SLIDE, at_least, at_most
from finger3d._types import Float, Tree, TreeView
from finger3d.geometry.design import Design, lacks_section
from finger3d.mechanics.readings import (
    AREAS,
    GIVEN_BY_FORCE,
    MAIN,
    RESULTANTS,
    SLIP,
    displacement_columns,
    pressure_column,
    strain_columns,
)
from finger3d.meshing.given import GivenMesh
from finger3d.objects import MeshObject, RigidObject
from finger3d.scene.material import check_parts
from finger3d.scene.mesh_sizes import smallest_mm
from finger3d.scene.messages import Place, dotted, message, shown
from finger3d.scene.tables import GaugeTable, LegTable, MarkerTable, MeshTable, SceneTable, TaxelTable

_MOST_MARKERS = 20_000

_ELASTOMERS_MPA = 1e-3, 100.0
"""Young's moduli from the softest gels to hard rubber."""

_FINGERS_MM = 0.1, 1000.0
"""Heights of fingers."""

_APART = 200.0  # sizes of object and finger that differ more than this are in different units, or cannot be meshed


def check(tables: SceneTable, legs: tuple[LegTable, ...], design: Design) -> list[str]:
    """Return the mistakes that only the whole scene shows, each in one line."""
    solid = tables.model.domain == "solid"
    lines = []
    if design.section() is None:
        lacks = f"finger.geometry = {shown(design.name)} is {lacks_section(design)}"
        if not solid:
            lines.append(f'model.domain = {shown(tables.model.domain)}: {lacks}; must be "solid"')
        if tables.mesh.mesher == "swept":
            lines.append(f'mesh.mesher = "swept": {lacks}; must be "ftetwild"')
    lines += check_parts(tables, design)
    lines += _legs(tables.press, legs, design, solid) + _grip(tables, solid)
    lines += _sizes(tables.mesh, design, solid)
    lines += _goal(tables, legs, solid)
    lines += _names(tables)
    for i, gauge in enumerate(tables.gauge):
        along = np.array([-0.5, 0.5]) * gauge.length_mm if gauge.length_mm else np.zeros(1)
        lines += _place(("gauge", i), gauge, along, math.radians(gauge.angle_deg), design)
    for i, marker in enumerate(tables.marker):
        lines += _place(("marker", i), marker, np.zeros(1), 0.0, design)
    if tables.marker_grid:
        lines += _grid("marker_grid.spacing_mm", tables.marker_grid.spacing_mm, design, solid)
    if tables.labels:
        lines += _grid("labels.grid_mm", tables.labels.grid_mm, design, solid)
    for i, taxel in enumerate(tables.taxel):
        lines += _taxel(i, taxel, design, solid)
    return lines


_HELD_SHAPES = "box", "cylinder", "mesh", "sphere"
"""Objects that two fingers can hold."""

_NOT_HELD = "elastic_object", "embedded_gauge", "viscosity"
"""Effects that a press by two fingers does not know."""


def _grip(tables: SceneTable, solid: bool) -> list[str]:
    """Return a line about what two fingers cannot do."""
    grip, shape = tables.grip, (tables.object or {}).get("shape", "plane")
    if grip is None:
        return []
    lines = []
    if shape not in _HELD_SHAPES or (shape == "cylinder" and solid and "length_mm" not in (tables.object or {})):
        closed = "a cylinder with length_mm" if shape == "cylinder" else f"one of {', '.join(_HELD_SHAPES)}"
        lines.append(f"object.shape = {shown(shape)}: two fingers hold a closed body; must be {closed}")
    lines += [
        f"effects.{name}: not with [grip]; take one of the two out" for name in _NOT_HELD if tables.effects.get(name)
    ]
    if grip.mass_g and not any(grip.down):
        lines.append("grip.down: must be a direction, not 0, 0, 0")
    across = {"down": grip.mass_g * grip.down[2], "load_N": grip.load_N[2], "load_Nmm": any(grip.load_Nmm[:2])}
    lines += (
        [] if solid else [f"grip.{key}: must act in the plane of a 2D domain" for key, value in across.items() if value]
    )
    return lines


def unusual(given: TreeView, E_MPa: float, height_mm: float) -> tuple[str, ...]:
    """Return a warning about each value that is allowed but seldom meant: of another unit, or left out."""
    lines = []
    for name, value, (low, high), unit in (
        ("material: Young's modulus", E_MPa, _ELASTOMERS_MPA, "MPa, and 1 MPa = 1000 kPa"),
        ("finger: height", height_mm, _FINGERS_MM, "mm"),
    ):
        if not low <= value <= high:
            lines.append(f"{name} {value:g}, not from {low:g} to {high:g} as usual; it is in {unit}")
    if "friction" not in given:
        lines.append("friction: the scene has no [friction], so that mu = 0")
    return tuple(lines)


def _goal(tables: SceneTable, legs: tuple[LegTable, ...], solid: bool) -> list[str]:
    """Return a line about a goal without a tolerance, or one that is no number of the press."""
    goal = tables.mesh.goal
    if goal is None:
        return []
    if tables.mesh.tolerance is None:
        return [f"mesh.goal = {shown(goal)}: only with mesh.tolerance, for which the mesh is refined"]
    names = [*headline_numbers(tables, solid, legs[-1].force_N is not None), "all"]
    return [] if goal in names else [no_such_number("mesh.goal", goal, names)]


def no_such_number(key: str, value: str, names: Iterable[str]) -> str:
    """Return a line about a number that a press has not."""
    return f"{key} = {shown(value)}: no number of this press; must be one of {', '.join(names)}"


def headline_numbers(tables: SceneTable, solid: bool, under_force: bool) -> list[str]:
    """Return the names of the numbers of a press that have error bars; under a force the depth is one of them."""
    dim = 3 if solid else 2
    names = [*MAIN, *AREAS, *SLIP, *RESULTANTS[dim], "external_work_mJ", "dissipation_mJ"]
    names += ["contact_half_length_end_mm"] if solid else []
    names = ["depth_mm", *(n for n in names if n not in GIVEN_BY_FORCE)] if under_force else names
    names += [strain_columns(g.name)[0].key for g in tables.gauge] + [pressure_column(t.name).key for t in tables.taxel]
    return names + [c.key for m in tables.marker for c in displacement_columns(m.name, dim)]


def _names(tables: SceneTable) -> list[str]:
    """Return a line about every name of a gauge, marker or taxel that is used twice, also with a component added."""
    kinds = [("gauge", g.name) for g in tables.gauge] + [("taxel", t.name) for t in tables.taxel]
    kinds += [("marker", m.name) for m in tables.marker]
    count = Counter(name for _, name in kinds)
    count.update(column.name for m in tables.marker for column in displacement_columns(m.name))
    twice = {name: kind for kind, name in kinds if count[name] > 1}
    return [
        f"{kind}.name = {shown(name)}: used more than once; every gauge, marker and taxel needs its own name"
        for name, kind in twice.items()
    ]


def _legs(press: Tree, legs: tuple[LegTable, ...], design: Design, solid: bool) -> list[str]:
    lines = []
    height, half_length = design.height_mm, design.half_length_mm
    for i, leg in enumerate(legs):
        place = ("press", "leg", i) if "leg" in press else ("press",)
        allowed = f"a number above 0 and below the finger's height of {at_most(height)} mm"
        if i > 0 and _target(leg) == _target(legs[i - 1]) and leg.duration_s is None:
            lines.append(f"{dotted(place)}: goes nowhere, its target is that of the leg before; take it out")
        if (leg.depth_mm is None) == (leg.force_N is None):
            both = f"must not stand beside force_N = {shown(leg.force_N)}; give either a depth or a force"
            what = f"{dotted((*place, 'depth_mm'))}"
            lines.append(f"{what} is missing: give it, or force_N" if leg.force_N is None else f"{what}: {both}")
            continue
        if leg.depth_mm is None:
            pass
        elif i == 0 and leg.depth_mm == 0.0 and any(_target(leg)[2:]):
            lines.append(f"{dotted(place)}: moves before first touch; give the first leg a depth_mm above 0")
        elif leg.depth_mm >= height or (i == 0 and leg.depth_mm == 0.0):
            lines.append(message((*place, "depth_mm"), leg.depth_mm, f"must be {allowed}"))
        for key in ("slide_x_mm", "slide_z_mm"):
            far = LONGEST_SLIDE * half_length
            if abs(value := getattr(leg, key)) > far:
                most = f"{at_most(far)}, {LONGEST_SLIDE:g} times the finger's half length"
                lines.append(message((*place, key), value, f"must be a number from -{at_most(far)} to {most}"))
        lines += _tangential(place, leg, legs[i - 1] if i else None, solid)
        for key in () if solid else ("slide_z_mm", "turn_x_deg", "turn_y_deg"):
            if (value := getattr(leg, key)) != 0.0:
                lines.append(message((*place, key), value, "must be 0.0 in a 2D domain"))
    return lines


_FREE = (
    ("force_x_N", "slide_x_mm", False), ("force_z_N", "slide_z_mm", True), ("moment_x_Nmm", "turn_x_deg", True),
    ("moment_y_Nmm", "turn_y_deg", True), ("moment_z_Nmm", "turn_z_deg", False),
)  # fmt: skip
"""Forces and moments, the coordinates in place of which they stand, and whether only a solid has them."""


def _tangential(place: Place, leg: LegTable, before: LegTable | None, solid: bool) -> list[str]:
    """Return a line about every force and moment that cannot act, and a coordinate that is missing after one."""
    lines = []
    for force, coordinate, only_solid in _FREE:
        what = f"{dotted((*place, force))} = {shown(value := getattr(leg, force))}"
        after_force = before is not None and getattr(before, force) is not None
        if value is None:
            if after_force and leg.depth_mm != 0.0 and coordinate not in leg.model_fields_set:
                had = f"the leg before has {force} = {shown(getattr(before, force))}"
                advice = f"give it here, too, or {coordinate} to which the object then moves"
                lines.append(f"{dotted((*place, force))} is missing: {had}; {advice}")
        elif only_solid and not solid:
            lines.append(f"{what}: must be left out in a 2D domain")
        elif getattr(leg, coordinate):
            kind = ("force", "slide") if force.startswith("force") else ("moment", "turn")
            other = f"{coordinate} = {shown(getattr(leg, coordinate))}"
            lines.append(f"{what}: must not stand beside {other}; give either a {kind[0]} or a {kind[1]}")
        elif before is None or before.depth_mm == 0.0 or leg.depth_mm == 0.0:
            acts = "tangential force" if force.startswith("force") else "moment"
            lines.append(f"{what}: there is no contact to hold it; give a {acts} in a leg that begins and ends pressed")
    return lines


def _target(leg: LegTable) -> tuple[float | None, ...]:
    slides, turns = (leg.slide_x_mm, leg.slide_z_mm), (leg.turn_x_deg, leg.turn_y_deg, leg.turn_z_deg)
    return leg.force_N, leg.depth_mm, *(getattr(leg, force) for force, _, _ in _FREE), *slides, *turns


def _sizes(mesh: MeshTable, design: Design, solid: bool) -> list[str]:
    if isinstance(design, GivenMesh) and (line := _beside_a_mesh(mesh, design)):
        return [line]
    for key in ("size_mm", "base_size_mm"):
        if mesh.tolerance is not None and (size := getattr(mesh, key)) is not None:
            beside = f"must not stand beside mesh.{key} = {shown(size)}; give either sizes or a tolerance"
            return [message(("mesh", "tolerance"), mesh.tolerance, beside)]
    if mesh.max_seconds is not None and mesh.tolerance is None:
        only = "only with mesh.tolerance, whose refining it ends"
        return [message(("mesh", "max_seconds"), mesh.max_seconds, only)]
    extent = smallest_mm(design, solid)
    section = smallest_mm(design, solid=False)
    if mesh.size_mm is not None and mesh.size_mm > extent:
        large = f"larger than the finger; must be at most {at_most(extent)}, its smallest extent"
        return [message(("mesh", "size_mm"), mesh.size_mm, large)]
    if mesh.base_size_mm is not None and mesh.base_size_mm > section:
        large = f"larger than the finger; must be at most {at_most(section)}, its smallest extent in the section"
        return [message(("mesh", "base_size_mm"), mesh.base_size_mm, large)]
    if mesh.size_mm and mesh.base_size_mm and mesh.base_size_mm < mesh.size_mm:
        fine = f"finer than the contact; must be at least mesh.size_mm = {shown(mesh.size_mm)}"
        return [message(("mesh", "base_size_mm"), mesh.base_size_mm, fine)]
    return []


def _beside_a_mesh(mesh: MeshTable, design: GivenMesh) -> str:
    """Return a line about a key that a finger that is a mesh cannot take; empty if there is none."""
    if mesh.tolerance is not None:
        return (
            f"mesh.tolerance = {shown(mesh.tolerance)}: the mesh {design.name} is used as it is; take it out, and "
            "lower mesh.size_mm, which halves cells at the contact, until the results agree"
        )
    for key, edge in (("size_mm", design.size_mm), ("base_size_mm", design.base_size_mm)):
        value = getattr(mesh, key)
        if value is not None and value > edge * (1.0 + 1e-9):
            has = f"the mesh {design.name} has edges of {shown(edge)} mm and is not made coarser"
            return message(("mesh", key), value, f"{has}; must be at most {at_most(edge)}, or be taken out")
    return ""


def _place(place: Place, it: GaugeTable | MarkerTable, along: Float, angle: float, design: Design) -> list[str]:
    """Check the place of a gauge or marker, and the ends of a gauge: distances `along` from its middle, mm."""
    half_length, height = design.half_length_mm, design.height_mm
    half_width, what = design.width_mm / 2.0, f"{place[0]} {shown(it.name)}"
    outside = f"{what} is outside the finger"
    ends = {"x_mm": (-half_length, half_length), "y_mm": (0.0, height), "z_mm": (-half_width, half_width)}
    for key, (low, high) in ends.items():
        if not low <= (value := getattr(it, key)) <= high:
            allowed = f"must be a number from {at_least(low)} to {at_most(high)}"
            return [message((*place, key), value, f"{outside}; {allowed}")]
    x, y = it.x_mm + along * math.cos(angle), it.y_mm + along * math.sin(angle)
    top = design.top(x, np.full_like(x, it.z_mm))
    slack = 1e-9 * height
    if np.all((y >= -slack) & (y <= top + slack)):
        return []
    here = float(design.top(np.array([it.x_mm]), np.array([it.z_mm]))[0])
    if math.isnan(here):
        nearer = f"must be nearer to 0 at x_mm = {shown(it.x_mm)}"
        return [message((*place, "z_mm"), it.z_mm, f"{outside}; {nearer}")]
    if isinstance(it, GaugeTable) and it.length_mm and it.y_mm <= here + slack:
        leaves = f"an end of {what} leaves the finger; must be shorter, or the gauge moved inward"
        return [message((*place, "length_mm"), it.length_mm, leaves)]
    allowed = f"must be a number from 0 to {at_most(here)} at x_mm = {shown(it.x_mm)}"
    return [message((*place, "y_mm"), it.y_mm, f"{outside}; {allowed}")]


def _grid(key: str, spacing_mm: float, design: Design, solid: bool) -> list[str]:
    """Check that a grid on the contact face has not too many places for a file, and more than one."""
    sides = (2.0 * design.half_length_mm, design.width_mm) if solid else (2.0 * design.half_length_mm,)
    least = (math.prod(sides) / _MOST_MARKERS) ** (1.0 / len(sides))
    if least <= spacing_mm <= max(sides):
        return []
    allowed = f"must be a number from {at_least(least)} to {at_most(max(sides))}"
    return [f"{key} = {shown(spacing_mm)}: {allowed}"]


def _taxel(index: int, taxel: TaxelTable, design: Design, solid: bool) -> list[str]:
    """Check that a taxel is on the base, and that it has a width if the base has."""
    width = (taxel.width_mm or 0.0) if solid else 0.0
    if solid and not width:
        return [f"{dotted(('taxel', index, 'width_mm'))} is missing: a number from 1e-6 to 1e6 is required of a solid"]
    leaves = f"taxel {shown(taxel.name)} leaves the base"
    halves = {"x_mm": (taxel.length_mm, design.half_length_mm), "z_mm": (width, design.width_mm / 2.0)}
    for key, (extent, half) in halves.items():
        most, value = half - 0.5 * extent, getattr(taxel, key)
        if abs(value) > most * (1.0 + 1e-9) and (solid or key == "x_mm"):
            allowed = f"must be from -{at_most(most)} to {at_most(most)}" if most > 0.0 else "must be smaller"
            return [message(("taxel", index, key), value, f"{leaves}; {allowed}")]
    corners = 0.5 * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]) * [taxel.length_mm, width]
    x, z = (1.0 - 1e-9) * (corners + [taxel.x_mm, taxel.z_mm]).T
    if np.isnan(design.top(x, z if solid else np.zeros_like(z))).any():
        nearer = f"{leaves}; must be smaller, or nearer to the middle"
        return [message(("taxel", index, "x_mm"), taxel.x_mm, nearer)]
    return []


def unit_mistakes(design: Design, obj: RigidObject) -> list[str]:
    """Return a line if a triangulated object is far too large or far too small for the finger."""
    if not isinstance(obj, MeshObject):
        return []
    longest = max(design.height_mm, 2.0 * design.half_length_mm, design.width_mm)
    extent = obj.surface.high - obj.surface.low
    ratio = float(extent.max()) / longest
    if 1.0 / _APART <= ratio <= _APART:
        return []
    box = " x ".join(f"{e:.4g}" for e in extent)
    relation = f"{ratio:.3g} times as large as" if ratio > 1.0 else f"{1.0 / ratio:.3g} times smaller than"
    advice = "0.001 if it was drawn in micrometres" if ratio > 1.0 else "1000 if it was drawn in metres, 25.4 in inches"
    return [
        f"object.path: the object's box is {box} mm, {relation} the finger of {longest:.4g} mm; is its unit right? "
        f"Give object.scale, for instance {advice}"
    ]
