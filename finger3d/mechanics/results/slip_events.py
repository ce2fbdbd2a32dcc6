"""Slip events: where and at what pose a region of the contact first slips, and at what pose it slips as a whole.

An event lies between the ends of two increments, at the pose at which the margin of the point or of the whole contact,
or the gap of a point that slips as it touches, vanishes if it falls as it did in the increment before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d._types import Float, Tree
from finger3d.contact.friction import OPEN, SLIP
from finger3d.errors import Outcome
from finger3d.fem.mesh.simplex import FREE_FACES
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.readings.reading import Reading, Taxel
from finger3d.mechanics.results.history import StepResult, pose_entry
from finger3d.mechanics.results.slip_margin import limits, margins, slip_margin
from finger3d.objects import Move, ObjectPose
from finger3d.objects.placed import TIME

Mask = NDArray[np.bool_]

ROUND_OFF = 1e-9
"""Motion, mm and rad, that is round-off."""

_MARGIN_POWER = {2: 1.0, 3: 2.0 / 3.0}
"""Power of the margin of a whole contact that falls in proportion to a slide, by dimension.

It is that of a ball (Mindlin 1949); the margin of a flat contact and of a section falls in proportion itself.
"""


def regions_of(points: ContactPoints, readings: Sequence[Reading]) -> dict[str, Mask]:
    """Return the points (m,) of each region: the whole contact, those above each taxel's patch, and each face."""
    x, z = points.points[:, 0], points.points[:, 2]
    regions = {"whole": np.ones(len(x), dtype=bool)}
    for taxel in readings:
        if isinstance(taxel, Taxel):
            above = np.abs(x - taxel.x_mm) <= 0.5 * taxel.length_mm
            if taxel.width_mm is not None and points.dim == 3:
                above &= np.abs(z - taxel.z_mm) <= 0.5 * taxel.width_mm
            regions[f"taxel_{taxel.name}"] = above
    return regions | {FREE_FACES[face]: points.face == face for face in np.unique(points.face)}


def slip_events(
    points: ContactPoints, steps: Sequence[StepResult], margin: Sequence[float], readings: Sequence[Reading]
) -> Tree:
    """Return the entries of summary.json on slip.

    Parameters
    ----------
    points : of the whole finger, m of them
    steps : increments in order; the last may have failed
    margin : the slip margins after them
    readings : those of the model; the patches of its taxels are regions

    Returns
    -------
    dict
        ``first_slip``, by region the pose at which one of its points first slips, with the increment and the place of
        that point (mm, at rest), or None; ``slip_margins``, by region the margin after the last increment, None without
        contact; ``gross_slip``, the pose at which the whole contact first slips, with the increment, or None.
    """
    regions, good = regions_of(points, readings), [step for step in steps if step.outcome.ok]
    return {
        "first_slip": _first_slips(points, good, regions),
        "gross_slip": _gross_slip(points, steps, np.array(margin)),
        "slip_margins": {name: _margin(points, good, region) for name, region in regions.items()},
    }


def _margin(points: ContactPoints, steps: Sequence[StepResult], region: Mask) -> float | None:
    if not steps or not (steps[-1].state.status[region] != OPEN).any():
        return None
    return slip_margin(points, steps[-1].state, steps[-1].friction, region)


def _first_slips(
    points: ContactPoints, steps: Sequence[StepResult], regions: Mapping[str, Mask]
) -> dict[str, Tree | None]:
    """Return the first slip of every region."""
    found: dict[str, Tree | None] = dict.fromkeys(regions)
    left = [_left(points, step) for step in steps]
    for number, step in enumerate(steps):
        slips = (step.state.status == SLIP) & (limits(points, step.state, step.friction) > 0.0)
        shares = np.ones(len(slips))
        if number > 1:
            same = left[number - 1][1] == left[number - 2][1]
            trend = _share(left[number - 2][0], left[number - 1][0], _ratio(steps, number))
            shares = np.where(same, trend, 1.0)
        for name, region in regions.items():
            if found[name] is None and (there := np.flatnonzero(slips & region)).size:
                first = there[np.argmin(shares[there])]
                place = {f"{axis}_mm": float(points.points[first, k]) for k, axis in enumerate("xyz")}
                found[name] = _event(steps, number, float(shares[first])) | place
    return found


def _gross_slip(points: ContactPoints, steps: Sequence[StepResult], margin: Float) -> Tree | None:
    """Return the event in which no point of the contact sticks any more while the object moves along it.

    Under a prescribed force that the contact cannot hold it is the last pose at which it held.
    """
    left = margin ** _MARGIN_POWER[points.dim]
    for number, step in enumerate(steps):
        if step.outcome is Outcome.SLIPS:
            return _event(steps, number, 0.0)
        along = np.delete(Move(_pose_before(steps, number), step.target).change, [0, TIME])
        if (
            margin[number] > 0.0
            or np.abs(along).max() <= ROUND_OFF
            or not limits(points, step.state, step.friction).any()
        ):
            continue
        known = number > 1 and margin[number - 1] > 0.0
        share = _share(left[number - 2], left[number - 1], _ratio(steps, number)) if known else 1.0
        return _event(steps, number, float(share))
    return None


def _left(points: ContactPoints, step: StepResult) -> tuple[Float, Mask]:
    """Return what is left (m,) until a point slips, its margin or, mm, its gap; and whether it is open."""
    is_open = step.state.status == OPEN
    return np.where(is_open, step.state.gap, margins(points, step.state, step.friction)), is_open


def _share(before: ArrayLike, last: ArrayLike, ratio: float | None) -> Float:
    """Return after what share of an increment numbers vanish that fall as in the last one; 1 where they do not.

    Parameters
    ----------
    before, last : two and one increments ago
    ratio : length of the increment over that of the last one; None where the path has turned
    """
    last = np.asarray(last, dtype=float)
    fall = (np.asarray(before) - last) * (ratio or 0.0)
    return np.asarray(np.clip(np.divide(last, fall, out=np.ones_like(last), where=fall > 0.0), 0.0, 1.0))


def _pose_before(steps: Sequence[StepResult], number: int) -> ObjectPose:
    return steps[number - 1].target if number else ObjectPose(0.0)


def _ratio(steps: Sequence[StepResult], number: int) -> float | None:
    """Return the length of an increment over that of the one before."""
    moves = [Move(_pose_before(steps, k), steps[k].target) for k in (number - 1, number)]
    return moves[1].length_ratio(moves[0])


def _event(steps: Sequence[StepResult], number: int, share: float) -> Tree:
    pose = Move(_pose_before(steps, number), steps[number].target).at(share)
    return {"step": number + 1, **pose_entry(pose)}
