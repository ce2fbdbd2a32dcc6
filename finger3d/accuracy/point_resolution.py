"""Resolution of the zones of contact and stick by the contact points: lower bounds of the error bars of their size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, FrictionLaw
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings.columns import AREAS, MAIN
from finger3d.mechanics.results.history import ContactPoints, StepResult, measure
from finger3d.mechanics.results.zones import Zone, zone_area

_ALONG_Z = 0.5
"""Friction along z has a relative error of about this times (h/b)^2, h the spacing of points along z, b the half extent
of contact: 11, 5.3, 1.6 and 0.4 % were found at 5, 3.3, 2 and 1 mm on Fig. 9 (b = 10 mm, nu = 0.49, mu = 0.25)."""

_IN_SECTIONS = 0.25
"""Friction in a section has a relative error of about this times h/a, h the spacing of points, a the half-length of
contact, even where its companion agrees by chance: in plane stress 93 % of the cases of validation/error_bars.py then
lie within twice the bar, and 89 % with a factor of 0.1."""

_FEW_POINTS, _OF_LIMIT = 8.0, 0.375
"""Relative error of friction over (h/a)^3: a zone of few points has errors of higher order, too.  Friction counts as at
least this share of its limit: what remains of it after a release or a roll of few points may be found by chance."""

_CORNER = 0.25
"""Error of the place of the edge of contact over the distance of the points, at most and under an object with edges."""


@dataclass(frozen=True)
class _Places:
    """Calibrated errors of the places of borders over the distance of the points; see validation/error_bars.py.

    Attributes
    ----------
    contact : of the edge of contact: at least, and over the square of that distance over the half-width of contact
    slip : of the border of stick where points slip beyond it: in an area, and at an end on a line
    open : of the border of stick where it reaches open points: at least, and over the square of the share of the limit
        of friction that its points use, since a strip of slip may hide between the points
    thin : of the border of stick where the zone is not three points wide
    """

    contact: tuple[float, float]
    slip: tuple[float, float]
    open: tuple[float, float]
    thin: float


_PLACES = {
    (2, False): _Places((0.036, 0.12), (0.4, 0.4), (0.05, 0.5), 0.33),
    (2, True): _Places((0.04, 0.12), (0.35, 0.35), (0.3, 0.0), 0.3),
    (3, False): _Places((0.022, 0.06), (0.15, 0.35), (0.075, 0.2), 0.35),
    (3, True): _Places((0.022, 0.06), (0.15, 0.35), (0.075, 0.2), 0.35),
}
"""By dimension, in small strain and at large deformation."""

_THIN = 0.35
"""Error of an end of stick on a line over the length before it in which the zone is not three points wide."""

_AT_ENDS, _AT_END_OF_WIDTH = {2: 1.0, 3: 3.8}, 5.5
"""Error of an end of contact on a line over that of its edge on average: on a plane of symmetry hats are others.  The
second is that at half the width on unstructured meshes and at large deformation."""

_ONE_POINT = 0.375
"""Error of the area of a zone of one point, or of none that may hide between the points, over that of a point."""


@dataclass(frozen=True)
class PointResolution:
    """Resolution of the contact zone by its points.

    Attributes
    ----------
    spacing_mm : spacing of the points along x
    share : the larger of `along` and of the spacing along z over the half width
    least : by name, lower bounds of the error bars of lengths, areas and friction; see `least_bars`
    along : spacing of the points along x over the half-length of contact
    few_N : error of the friction that a zone of few points leaves open
    """

    spacing_mm: float
    share: float
    least: Mapping[str, float] = field(default_factory=dict)
    along: float = 1.0
    few_N: float = 0.0

    @property
    def zone_bars(self) -> dict[str, float]:
        """Error bars of lengths and areas of contact and stick by name."""
        names = (*MAIN, *AREAS, "contact_half_length_end_mm")
        return {name: self.least[name] for name in names if name in self.least and not name.endswith("_N")}

    @classmethod
    def of(cls, problem: Problem, step: StepResult) -> PointResolution:
        """Return the resolution of an increment; medians over the points in contact."""
        points, reach = problem.points, measure(problem.points, step)["contact_half_length_mm"]
        half_width, touching = points.half_width_mm, step.state.status != OPEN
        if points.dim == 3 and problem.model.mesh.mesher != "swept":
            spacing = along_z = float(np.sqrt(np.median(points.area)))
            edges = _edge_length(points, touching)
        else:
            at = np.round(points.points, 9)
            line = np.unique(at[at[:, 2] == 0.0, 0])
            near = line[np.abs(line - step.lowest[0]) <= 1.2 * reach]
            spacings = np.diff(near if len(near) > 1 else line)
            spacing = float(np.median(spacings)) if len(spacings) else problem.model.mesh.size_mm
            rows = np.diff(np.unique(at[:, 2]))
            edges = along_z = float(np.median(rows)) if len(rows) else 0.0
        share = _share(spacing, reach, along_z, half_width)
        least = least_bars(points, step, edges, problem.model)
        along, state = _along(spacing, reach), step.state
        friction = float(np.linalg.norm(state.force[:, 1:], axis=1).sum())
        limit = problem.model.friction.coefficients(state.status, state.force[:, 0] / points.area) @ state.force[:, 0]
        scale = max(friction, _OF_LIMIT * float(limit))
        few, of_rows = (min(1.0, _FEW_POINTS * h**3) * scale for h in (along, max(along, along_z / half_width)))
        by_spacing = _IN_SECTIONS * share * friction if points.dim == 2 else least.get("friction_sum_N", 0.0)
        least |= {"friction_sum_N": max(few, by_spacing), "outward_friction_x_N": few, "outward_friction_z_N": of_rows}
        least["friction_sum_N_per_mm"] = least["friction_sum_N"] / (2.0 * half_width)
        return cls(spacing, share, least, along, few)


def _along(along: float, reach: float) -> float:
    return along / max(reach, along)


def _share(along: float, reach: float, across: float, half_width: float) -> float:
    return min(1.0, max(_along(along, reach), across / half_width))


def _edge_length(points: ContactPoints, touching: NDArray[np.bool_]) -> float:
    """Median length (mm) of the edges between points that touch, of all edges where there is none."""
    i, j = points.edges.T
    length = np.linalg.norm(points.points[i] - points.points[j], axis=1)
    both = touching[i] & touching[j]
    return float(np.median(length[both] if both.any() else length)) if len(length) else 0.0


def least_bars(points: ContactPoints, step: StepResult, along_z_mm: float, model: Model) -> dict[str, float]:
    """Lower bounds of error bars that follow from the size of the zones in points, by name (mm, mm2, N, N/mm).

    An area is uncertain by a share of the area of the facets that the border of its zone cuts: the length of the border
    times the error of its place; a zone that the face ends has the border of as many points side by side.  A
    half-length is uncertain by a share of the mean distance from its ends to the next points of the line z = 0.  In a
    solid a zone that is nowhere three points wide may be absent or longer, and its half-length is uncertain by half of
    itself; that of stick by a share of what is that thin at its ends.  Friction along z is uncertain by the spacing of
    the points along z.

    Parameters
    ----------
    along_z_mm : spacing of the points along z
    model : whose object may have edges, at which the pressure does not fall to zero
    """
    zones = dict(zip(("contact", "stick"), points.zones(step.state), strict=True))
    touching, line = step.state.status != OPEN, points.middle_line()
    reach = measure(points, step)["contact_half_length_mm"]
    one = _ONE_POINT * float(np.median(points.area[touching])) if touching.any() else 0.0
    places = _PLACES[points.dim, model.finite_strain]
    edge = _edge_error(points, zones["contact"], places.contact, model.object.has_edges)
    at_edge = np.full(len(touching), min(_AT_ENDS[points.dim] * edge, _CORNER))
    at_open = places.open[0] + places.open[1] * _used_friction(points, step.state, model.friction) ** 2
    slips = np.where(touching, places.slip[1], np.nan)
    at_ends = {"contact": (at_edge, at_edge, 0.0), "stick": (slips, at_open, _THIN)}
    found: dict[str, float] = {}
    for name, zone in zones.items():
        wide, reaches, thin = _cut_facets(points, zone.inside, ~touching)
        by_place = places.slip[0] * wide + places.thin * thin
        by_place += reaches * np.where(zone.inside, at_open, 0.0)[points.facets].max(axis=1)
        error = edge * (wide | reaches | thin) if name == "contact" else by_place
        count = np.count_nonzero(zone.inside)
        rim = one / _ONE_POINT * edge * 2.0 * (points.dim - 1) * count ** (1.0 - 1.0 / (points.dim - 1))
        found[f"{name}_area_mm2"] = max(float(points.facet_area @ error), rim if count > 1 else one)
        found[f"{name}_half_length_mm"] = _half_length_bar(points, at_ends[name], zone.inside, line, reach)
        found[f"{name}_length_mm"] = 2.0 * found[f"{name}_half_length_mm"]
    if points.dim == 3:
        end = points.end_line()
        if model.finite_strain or model.mesh.mesher != "swept":
            at_edge = np.full(len(touching), min(_AT_END_OF_WIDTH * edge, _CORNER))
        reach = 0.5 * float(np.ptp(end[0][touching[end[1]]])) if touching[end[1]].any() else 0.0
        found["contact_half_length_end_mm"] = _half_length_bar(points, (at_edge, at_edge, 0.0), touching, end, reach)
    found["contact_length_end_mm"] = 2.0 * found.get("contact_half_length_end_mm", found["contact_half_length_mm"])
    if points.dim == 3 and touching.any():
        extent = max(0.5 * float(np.ptp(points.points[touching, 2])), along_z_mm)
        friction = float(np.abs(points.with_basis_of(step.state).friction(step.state.force)[:, 2]).sum())
        force = _ALONG_Z * (along_z_mm / extent) ** 2 * friction if extent > 0.0 else 0.0
        width = 2.0 * points.half_width_mm
        found["friction_sum_N"] = force
        found["friction_sum_N_per_mm"] = found["friction_along_z_N_per_mm"] = force / width
    return found


def _used_friction(points: ContactPoints, state: ContactState, law: FrictionLaw) -> Float:
    """Return the share (m,) of the limit of friction that every point uses; 0 where it is open."""
    normal, friction = state.force[:, 0], np.linalg.norm(state.force[:, 1:], axis=1)
    limit = law.coefficients(state.status, normal / points.area) * normal
    return np.asarray(np.where(limit > friction, friction / np.where(limit > 0.0, limit, 1.0), state.status != OPEN))


def _cut_facets(
    points: ContactPoints, inside: NDArray[np.bool_], is_open: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which facets (f,) the border of a zone cuts.

    They are those where the zone is wide and slip begins beyond it; where it reaches open points; and where it is thin.
    """
    among = inside[points.facets]
    cut = np.asarray(among.any(axis=1) & ~among.all(axis=1))
    reaches = cut & is_open[points.facets].any(axis=1)
    wide = cut & ~reaches & (points.resolved(inside)[points.facets] & among).any(axis=1)
    return wide, reaches, cut & ~reaches & ~wide


def _edge_error(points: ContactPoints, contact: Zone, place: tuple[float, float], has_edges: bool) -> float:
    """Return the error of the place of the edge of contact over the distance of points; `place`: `_Places.contact`."""
    if has_edges:
        return _CORNER
    area = zone_area(points.facets, points.facet_area, contact)
    among = contact.inside[points.facets]
    cut = float(points.facet_area[among.any(axis=1) & ~among.all(axis=1)].sum())
    return min(place[0] + place[1] * (cut / area) ** 2, _CORNER) if area > 0.0 else _CORNER


def _half_length_bar(
    points: ContactPoints,
    errors: tuple[Float, Float, float],
    zone: NDArray[np.bool_],
    line: tuple[NDArray[np.float64], NDArray[np.int64]],
    reach: float,
) -> float:
    """Return the error bar (mm) of the half-length of a zone on a line: x, and the number of the nearest point.

    Parameters
    ----------
    errors : of an end over the distance to the next point, (m,) by that point, and by the last one where that is nan;
        and over the length of what is thin before the end
    """
    at, nearest = line
    on = zone[nearest]
    ends = _to_next_points(at, on, errors[0][nearest], errors[1][nearest])
    if ends == 0.0 and np.count_nonzero(on) == 1:  # a single point, and no other on the line: what it stands for
        return 0.5 * float(points.area[nearest[on]].sum()) / (2.0 * points.half_width_mm)
    if points.dim == 2 or not on.any():
        return ends
    wide, half = on & points.resolved(zone)[nearest], 0.5 * float(np.ptp(at[on]))
    if wide.any():
        return max(errors[2] * (half - 0.5 * float(np.ptp(at[wide]))), ends)
    return max(0.5 * max(half, reach - half), ends)


def _to_next_points(line: Float, on: NDArray[np.bool_], by_next: Float, by_last: Float) -> float:
    """Return the mean error (mm) of the ends of a zone: distances to the next points of its line times their errors.

    For an empty zone it is the median distance of the points, which may hide a zone between them, times the largest.

    Parameters
    ----------
    by_next, by_last : (k,) errors over the distance, by the next point, and by the last one where that is nan
    """
    if not on.any():
        spacings = np.diff(np.unique(line))
        errors = np.where(np.isnan(by_next), by_last, by_next)
        return float(np.median(spacings) * errors.max()) if len(spacings) else 0.0
    mean = 0.0
    for end, beyond in ((line[on].min(), line < line[on].min()), (line[on].max(), line > line[on].max())):
        if beyond.any():
            distance = np.where(beyond, np.abs(line - end), np.inf)
            last, following = int(np.argmax(on & (line == end))), int(np.argmin(distance))
            error = by_last[last] if np.isnan(by_next[following]) else by_next[following]
            mean += 0.5 * float(distance[following] * error)
    return mean
