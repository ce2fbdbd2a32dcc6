"""Edge lengths of a scene's mesh that the scene leaves open: from the finger's height and the box of contact."""

from __future__ import annotations

import math

from finger3d._ranges import four_digits
from finger3d.geometry.design import Design
from finger3d.mechanics.model import Domain, MeshOptions
from finger3d.meshing.given import GivenMesh
from finger3d.objects import RigidObject
from finger3d.scene.tables import MeshTable

Box = tuple[float, float, float, float]

SIZE_SHARE = {"section": 1 / 100, "swept": 1 / 25, "ftetwild": 1 / 27.5, "netgen": 1 / 27.5}
BASE_SHARE = {"section": 1 / 25, "swept": 1 / 6.25, "ftetwild": 1 / 3, "netgen": 1 / 3}
"""Default edge lengths at the contact and far from it as shares of the finger's height. They leave less than 1 % of the
force, and .3 % of a gauge in a section (validation/cost_of_accuracy.py). A pad under a ball has 151 000 unknowns with
1/6.25 at the base, and 27 000 with 1/3, which changes the force by 0.03 %; in a swept Fig. 9 it would add 1 %, and in a
section twice 1/25 halves the unknowns, and more than doubles the error of the force."""

MOST_OF_EXTENT = 0.4
"""Largest of these lengths over the least extent of the finger. On Fig. 9, 20 mm wide, the largest edges of 8 mm leave
error bars as they are at large deformation, where 10 and 17 mm double and triple those of stick area and force."""

_ACROSS = {"section": 20.0, "swept": 20.0, "ftetwild": 33.0, "netgen": 33.0}
"""Number of edges across the overlap of a curved object, which is about 1.4 times as wide as the contact. Penetration
between points at the edge of contact has, over 38 presses of random solids, a median of 0.8 (edges across)^-1.6 times
the depth, and is below 1 % of it from 20 edges on, except at sharp tips and at rims of the finger. Unstructured meshes,
whose edges differ in length, need more."""

_LEAST_ACROSS = 12.0
"""The same if the overlap ends at edges of the finger or the object, and contact extends over all of it; also the least
number of edges in a wavelength."""

_PER_WAVE = 25.0
"""Edges in a wavelength, whose crests touch over up to some 0.8 of it."""

_MOST_POINTS = 600.0
"""Contact points of a solid across the overlap from which edges stay at `_LEAST_ACROSS`: a press under a long edge took
88 s instead of 18 s to lower the penetration from 1.3 to 0.8 % of the depth."""

_AT_STICK = 3.5
"""Default edge length at the contact of a solid over that at the border of stick. On Fig. 9 it takes the error of the
area of stick, a zone one point wide, from unknown to 2 %, and its bar to 11 %, in 1.5 times the time of a press."""

_AT_GAUGES = 2.0
"""Default edge length at the contact of a solid over that around gauges.  On Fig. 9 in small strain an error of 3 % in
the gauge takes 31 000 unknowns, without 193 000."""

_IN_LAYERS, _LARGEST_SCALE = 1.2, 2.5
"""Length that edges follow in layers over the shorter side of the overlap, and at most over the height. On a pad of gel
2.5 times as wide in contact as it is high, edges of a tenth and 0.4 of the height leave 1 % of depth and contact area;
those of a finger as high would take ten times the unknowns. Under seven balls whose overlap is about as wide as the
finger is high, penetration stays below 1 % of the depth with 1.2, and reaches 1.3 % with 1.25."""

_FINEST = {"section": 0.05, "swept": 0.2, "ftetwild": 0.05, "netgen": 0.05}
"""Least edge length over the default: finer is left to those who ask for it.  Lines of a swept solid run through all of
it: under a ball of 0.4 mm on a block of 20 mm it has 700 000 unknowns with 0.2; one by fTetWild 45 000 with 0.05."""


def mesh_options(
    table: MeshTable,
    design: Design,
    domain: Domain,
    obj: RigidObject,
    box: Box,
    refine: bool = False,
) -> MeshOptions:
    """Return the mesh options, with sizes chosen where they are absent, from all else and the box of contact.

    Parameters
    ----------
    refine : whether a solid without sizes gets shorter edges at the border of stick, unless the table says
    """
    local = table.gauge_refinement or 1.0, table.stick_refinement or 1.0
    if isinstance(design, GivenMesh):
        finest = table.size_mm or design.size_mm
        longest = max(table.base_size_mm or design.base_size_mm, finest)
        return MeshOptions(finest, longest, table.mesher, gauge_refinement=local[0], stick_refinement=local[1])
    solid = domain == "solid"
    kind = table.mesher if solid else "section"
    scale = _scale(design, obj, box) if solid else design.height_mm
    size, base = table.size_mm, table.base_size_mm
    if solid and size is None and base is None and table.tolerance is None:
        local = table.gauge_refinement or _AT_GAUGES, table.stick_refinement or (_AT_STICK if refine else 1.0)
    if size is None:
        # A thin finger gets two elements across its width; four significant digits keep scene.toml readable.
        coarse = min(scale * SIZE_SHARE[kind], smallest_mm(design, solid) / 2.0, base or math.inf)
        size = four_digits(max(min(coarse, _detail(obj, design, box, kind)), coarse * _FINEST[kind]))
    if base is None:
        base = max(four_digits(min(scale * BASE_SHARE[kind], MOST_OF_EXTENT * smallest_mm(design, solid))), size)
    return MeshOptions(size, base, table.mesher, gauge_refinement=local[0], stick_refinement=local[1])


def _scale(design: Design, obj: RigidObject, box: Box) -> float:
    """Return the length, mm, that the edges of a solid follow: its height, or more if it is a layer.

    The stresses in a layer that is thinner than the contact is wide change over both lengths.
    """
    if obj.is_flat:
        return design.height_mm
    side = min(box[1] - box[0], box[3] - box[2])
    return max(design.height_mm, min(_IN_LAYERS * side, _LARGEST_SCALE * design.height_mm))


def _detail(obj: RigidObject, design: Design, box: Box, kind: str) -> float:
    """Return the edge length, mm, that gives a curved contact some elements across, or those of a crest.

    A flat object sets none along a side over all of which it touches.
    """
    solid = kind != "section"
    sides, edges = [box[1] - box[0], box[3] - box[2]], _ACROSS[kind]
    halves = (design.half_length_mm, 0.5 * design.width_mm) if solid else (design.half_length_mm,)
    wanted, least = [math.inf], [math.inf]
    for side, low, high, half in zip(sides, box[::2], box[1::2], halves, strict=False):
        opens_inside = min(-low, high) < half * (1.0 - 1e-9) and not obj.has_edges
        if obj.is_flat and not opens_inside:
            continue
        wanted.append(side / (edges if opens_inside else _LEAST_ACROSS))
        least.append(side / _LEAST_ACROSS)
    detail = obj.detail
    if detail and detail.kind == "wavelength":
        wanted.append(detail.length_mm / _PER_WAVE)
        least.append(detail.length_mm / _LEAST_ACROSS)
    if not solid:
        return min(wanted)
    return max(min(wanted), min(min(least), math.sqrt(math.prod(sides) / _MOST_POINTS)))


def smallest_mm(design: Design, solid: bool) -> float:
    """Return the smallest extent of the meshed part, mm."""
    return min(design.height_mm, 2.0 * design.half_length_mm, design.width_mm if solid else math.inf)
