r"""Derivatives of the state along an exact path by parameters, from the equations of its active sets.

Between two events the forces r and the relative displacements ``w = W r + q`` solve linear equations; s is the share of
the path, and d' the derivative by a parameter p at fixed s::

    open    dr = 0
    stick   dw_n = 0,  dw_t = dw_t*
    slip    dw_n = 0,  dr_t = sigma (mu dr_n + dmu r_n)        with  dw = W dr + dW r + dq

w_t* is the tangential displacement where the point began to stick.  At an event a margin m (a gap, a normal force, or
mu r_n - |r_t|) vanishes, so that the event moves by ``ds = -dm / (dm/ds)``, and what it leaves behind changes by
``dw_t* = dw_t + (dw_t/ds) ds``.  Under a prescribed force the depth is one more unknown of the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import OPEN, SLIP, STICK, Status
from finger3d.contact.state import ContactState, Event
from finger3d.errors import Finger3dError
from finger3d.fem.tensors import rotated_delassus
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.history import StepResult
from finger3d.mechanics.small_strain.elastic import at_rest
from finger3d.mechanics.small_strain.exact_path import ExactPath
from finger3d.mechanics.small_strain.kinks import End, Sides, one_sided
from finger3d.mechanics.small_strain.variations import Side, Variation, changes_of_points
from finger3d.objects import vertical_frame

_SAME_PLACE = 1e-12
"""Difference of shares of the path below which two events are at the same place."""

_SHORT = 1e-8
"""Share of the path, over that up to a place, below which an event is at the same place for the slip since it."""

_JUMPED = 1e-6
"""Change of the forces in an increment over a jump, over the largest at the end of the path."""


@dataclass(frozen=True)
class PathTangent:
    """Derivatives at a place of the path by p parameters.

    Attributes
    ----------
    force, displacement : (p, c, 2), of forces, and of gaps and tangential displacements
    share, amplitude : (p,), of the place, and of the depth that follows from a prescribed force
    """

    force: Float
    displacement: Float
    share: Float
    amplitude: Float

    def changed(self, state: ContactState, k: int, t: float) -> ContactState:
        """Return the state at the place with parameter k changed by t."""
        moved = t * self.displacement[k]
        return replace(
            state,
            force=state.force + t * self.force[k],
            gap=state.gap + moved[:, 0],
            tangential_displacement=state.tangential_displacement + moved[:, 1:],
        )


class PlaceOnPath(NamedTuple):
    """Derivatives at a place on a path.

    Attributes
    ----------
    tangent : of the state
    motion : (p, 2), of the displacement of the object
    energies : (2, p), of work and dissipation up to there
    """

    tangent: PathTangent
    motion: Float
    energies: Float

    @classmethod
    def at_rest(cls, changes: Changes) -> PlaceOnPath:
        """Return the place before the first leg."""
        count, moved = len(changes.gap), np.stack([changes.gap, np.zeros_like(changes.gap)], axis=2)
        tangent = PathTangent(np.zeros_like(moved), moved, np.zeros(count), np.zeros(count))
        return cls(tangent, np.zeros((count, 2)), np.zeros((2, count)))


class Changes(NamedTuple):
    """What p parameters change in the body, and in the contact at rest.

    Attributes
    ----------
    variations : (p,)
    compliance : (p,) arrays (c d + g, c d) of contact points and readings of an upright object, or None
    gap, friction : (p, c) and (p,)
    bases : (p, c, 2, 2), directions of the points, which change with the share of an elastic object in the compliance
    """

    variations: Sequence[Variation]
    compliance: list[Float | None]
    gap: Float
    friction: Float
    bases: Float

    @classmethod
    def of(cls, problem: Problem, variations: Sequence[Variation]) -> Changes:
        """Return what variations of a problem change."""
        size, active = problem.surface.points.size, problem.system.active_dofs
        moved = changes_of_points(problem, variations, np.eye(size)[:, active])
        compliance, gap, bases = list[Float | None](), list[Float](), list[Float]()
        for k, one in enumerate(variations):
            whole = np.zeros((len(moved), size))
            whole[:, active] = moved[..., k]
            compliance.append(whole if one.body or one.thing else None)
            low, high = (at_rest(end) for end in one.ends)
            gap.append(one.difference(low.gap, high.gap))
            bases.append(one.difference(low.own_bases, high.own_bases))
        friction = [one.difference(*(end.model.friction.mu for end in one.ends)) for one in variations]
        return cls(variations, compliance, np.array(gap), np.array(friction), np.array(bases))


class PathTangents:
    """Derivatives along the path of a leg, at its events and between them.

    Parameters
    ----------
    path : of the leg
    changes : what p parameters change
    start : derivatives at the start of the leg
    leg : number of the leg
    """

    def __init__(self, path: ExactPath, changes: Changes, start: PlaceOnPath, leg: int) -> None:
        self.path, self._changes, variations = path, changes, changes.variations
        self._delassus = self._local(path.problem.delassus)
        size = path.problem.surface.points.size
        self._compliance = [None if own is None else self._local(own[:size]) for own in changes.compliance]
        for change, turn in zip(self._compliance, changes.bases, strict=True):
            if change is not None and turn.any():
                change += self._turned(turn)
        # gaps close along the normal of the object, which is not that of the points if it is elastic
        self._closing = path.bases.copy()
        surface, placed = path.problem.surface, path.problem.placed(path.move.start)
        self._closing[:, 0] = surface.average @ placed.distance(surface.samples)[1]
        self._weights: Float | None = None

        def goal(problem: Problem) -> Float:
            own = problem.model.legs[leg]
            return np.array([own.slide_x_mm, -own.depth_mm, own.force_N or 0.0])

        goals = np.array([one.difference(*map(goal, one.ends)) for one in variations]).reshape(-1, 3)
        end = goals[:, :2]
        if path.problem.model.legs[leg].force_N is not None:
            self._weights = -path.count[:, None] * path.bases[:, :, 1]
            end[:, 1] = start.motion[:, 1]
            self._turned_weights = -path.count[:, None] * changes.bases[..., 1]
            begin = np.einsum("ca,pca->p", self._weights, start.tangent.force)
            begin += np.einsum("pca,ca->p", self._turned_weights, path.start.state.force)
            self._force_slopes = begin, goals[:, 2]
        self._motions = start.motion, end
        self._events, self._energies = [path.start], [start.energies]
        self._tangents = [replace(start.tangent, amplitude=np.zeros(len(variations)))]
        for piece, event in enumerate(path.events):
            tangent = self._at_event(piece, event)
            self._energies.append(self._energies_at(piece, event, tangent))
            self._tangents.append(tangent)
            self._events.append(event)

    def at_share(self, share: float, status: Status | None = None) -> PlaceOnPath:
        """Return the derivatives at a share of the path, where the points may have other statuses (c,)."""
        event, done = self.path.at(share)
        piece = done - 1 if event is self._events[done] else done
        if status is not None:
            event = event._replace(state=replace(event.state, status=status))
        tangent, motion = self._solved(piece, event), self._motion(share)
        motion[:, 1] -= tangent.amplitude
        return PlaceOnPath(tangent, motion, self._energies_at(piece, event, tangent))

    def sides(self, step: StepResult, place: PlaceOnPath, status: Status | None = None) -> list[Side]:
        """Return the sides (2 p,) of an increment that ends at a place, where points may have other statuses (c,)."""
        problem, contact, sides = self.path.problem, step.meshed_state.contact, list[Side]()
        contact = contact if status is None else replace(contact, status=status)
        force = problem.upright_force(contact).ravel()
        for k, one in enumerate(self._changes.variations):
            rows = self._changes.compliance[k]
            read = 0.0 if rows is None else rows[len(force) :] @ force
            for end, t in zip(one.ends, (-one.step, one.step), strict=True):
                moved = place.tangent.changed(contact, k, t)
                moved = replace(moved, bases=moved.own_bases + t * self._changes.bases[k])
                side = Side(
                    end,
                    replace(step.meshed_state, contact=moved),
                    step.target.changed([1, 0], t * place.motion[k] * [1.0, -1.0]),
                    t * read + problem.system.reading_rows @ problem.upright_force(moved).ravel(),
                    step.external_work_mJ + t * place.energies[0, k],
                    step.dissipation_mJ + t * place.energies[1, k],
                )
                sides.append(side)
        return sides

    def one_sided(self, step: StepResult, share: float) -> tuple[Sides, Sides] | None:
        """Return the sides of falling and of growing parameters at a kink at the end of an increment; None elsewhere.

        Slip is counted from the last event that is not at the same place.
        """
        earlier = (i for i, event in enumerate(self._events) if i and event.share < share * (1.0 - _SHORT))
        last = max(earlier, default=0)
        before, tangent = self._events[last].state, self._tangents[last]
        here = End(self.path.problem, before, step.meshed_state.contact)
        if not here.is_kink:
            return None
        begun = [
            tangent.changed(before, k, t) for k, v in enumerate(self._changes.variations) for t in (-v.step, v.step)
        ]

        def solved(status: Status) -> tuple[list[Side], list[ContactState]]:
            return self.sides(step, self.at_share(share, status), status), begun

        return one_sided(here, solved, -1), one_sided(here, solved, 1)

    def _motion(self, share: float) -> Float:
        """Return the derivatives (p, 2) of the motion of the object at a share of the path, less the amplitude."""
        return np.asarray((1.0 - share) * self._motions[0] + share * self._motions[1])

    def _local(self, compliance: Float) -> Float:
        """Return a compliance (2 c, 2 c) in the directions of the points; given those of an upright object."""
        c = len(self.path.bases)
        turned = rotated_delassus(compliance.reshape(c, 2, c, 2), self.path.bases @ vertical_frame(2).T, np.arange(c))
        return np.asarray(turned.reshape(2 * c, 2 * c))

    def _turned(self, turn: Float) -> Float:
        """Return the derivative (2 c, 2 c) of the compliance as the directions of the points turn, by (c, 2, 2)."""
        own, other = (bases @ vertical_frame(2).T for bases in (self.path.bases, turn))
        half = np.einsum("cai,ciej,ebj->caeb", other, self.path.problem.delassus, own).reshape(2 * len(turn), -1)
        return np.asarray(half + half.T)

    def _energies_at(self, piece: int, event: Event, tangent: PathTangent) -> Float:
        """Return the derivatives (2, p) of work and dissipation up to a place; see `ExactPath.energies`."""
        path, before, first = self.path, self._events[piece], self._tangents[piece]
        count, passed = path.count[:, None], event.share - before.share
        mean = 0.5 * count * (before.state.force + event.state.force)
        change = 0.5 * count * (first.force + tangent.force)
        resultant = np.einsum("ca,cak->k", mean, path.bases)
        turned = np.einsum("pca,cak->pk", change, path.bases) + np.einsum("ca,pcak->pk", mean, self._changes.bases)
        if "x" in path.problem.axes:  # the halves of a mirrored finger cancel
            resultant[0] = turned[:, 0] = 0.0
        along = (path.move.end.displacement - path.move.start.displacement)[:2]
        way = passed * along
        way[1] -= event.amplitude - before.amplitude
        moved = (tangent.share - first.share)[:, None] * along + passed * (self._motions[1] - self._motions[0])
        moved[:, 1] -= tangent.amplitude - first.amplitude
        slid = _relative(event.state) - _relative(before.state)
        lost = np.einsum("pca,ca->p", change, slid)
        lost += np.einsum("ca,pca->p", mean, tangent.displacement - first.displacement)
        return np.asarray(self._energies[piece] + np.stack([turned @ way + moved @ resultant, -lost]))

    def _at_event(self, piece: int, event: Event) -> PathTangent:
        """Return the derivatives at an event, which ends a piece of the path and moves with the parameters."""
        before, last = self._events[piece], self._tangents[piece]
        way = event.share - before.share
        if way <= _SAME_PLACE:
            return self._at_touch(before, event, last) if event.amplitude > before.amplitude else last
        force, moved = event.state.force - before.state.force, _relative(event.state) - _relative(before.state)
        if event.is_increment and np.abs(force).max() > _JUMPED * np.abs(self.path.events[-1].state.force).max():
            raise Finger3dError("the forces jump on the path of this press, and have no derivatives there")
        found = self._solved(piece, event)
        if piece + 1 == len(self.path.events):
            return found
        old, new = event.state.status, self.path.events[piece + 1].state.status
        points = np.flatnonzero((old != new) & ((old != SLIP) | (new == OPEN)))
        if not len(points):
            return found
        change, rate = (
            self._margin(old[points[0]], new[points[0]], event.state.force[points[0]], *both)
            for both in (
                (found.force[:, points[0]], found.displacement[:, points[0]], self._changes.friction),
                (force[None, points[0]] / way, moved[None, points[0]] / way, np.zeros(1)),
            )
        )
        share = -change / rate
        return PathTangent(
            found.force + share[:, None, None] * (force / way),
            found.displacement + share[:, None, None] * (moved / way),
            share,
            found.amplitude + share * (event.amplitude - before.amplitude) / way,
        )

    def _margin(self, old: int, new: int, at: Float, force: Float, moved: Float, mu: Float) -> Float:
        """Return the change (p,) of what vanishes as a point leaves its set, by changes (p, 2) of its state."""
        if old == OPEN:
            return moved[:, 0]
        if new == OPEN:
            return force[:, 0]
        own = self.path.problem.model.friction.mu
        return np.asarray(own * force[:, 0] + mu * at[0] - np.sign(at[1]) * force[:, 1])

    def _at_touch(self, before: Event, event: Event, last: PathTangent) -> PathTangent:
        """Return the derivatives where the object touches first, to which it moves before there is any force."""
        point = int(np.argmin(event.state.gap))
        closing = self._closing[:, :, 1]
        amplitude = -last.displacement[:, point, 0] / closing[point, 0]
        moved = last.displacement + amplitude[:, None, None] * closing
        moved[:, :, 1] += (event.amplitude - before.amplitude) * self._changes.bases[:, :, 1, 1]
        return replace(last, displacement=moved, amplitude=last.amplitude + amplitude)

    def _solved(self, piece: int, event: Event) -> PathTangent:
        """Return the derivatives at a place within a piece of the path that itself does not move."""
        status, force, last = event.state.status, event.state.force, self._tangents[piece]
        c, count, share = len(status), len(self._changes.variations), event.share
        touches, sticks, slips = (np.flatnonzero(m) for m in (status != OPEN, status == STICK, status == SLIP))
        sign = np.zeros(c)
        slid = _relative(event.state)[:, 1] - _relative(self._events[piece].state)[:, 1]
        sign[slips] = np.sign(np.where(force[:, 1] != 0.0, force[:, 1], -slid))[slips]
        base = np.zeros((count, c, 2))
        base[:, slips, 1] = (self._changes.friction[:, None] * (sign * force[:, 0]))[:, slips]
        free = -np.einsum("cak,pk->pca", self._closing, self._motion(share))
        free[:, :, 0] += self._changes.gap
        free[:, :, 1] -= self._changes.bases[:, :, 1] @ self.path.pose(event).displacement[:2]
        for k, change in enumerate(self._compliance):
            if change is not None:
                free[k] += (change @ force.ravel()).reshape(c, 2)
        free += (base.reshape(count, -1) @ self._delassus.T).reshape(base.shape)
        rows, along = np.concatenate([2 * touches, 2 * sticks + 1]), self.path.problem.model.friction.mu * sign
        through = self._delassus[:, rows]
        through[:, : len(touches)] += along[touches] * self._delassus[:, 2 * touches + 1]
        target = np.zeros((count, c, 2))
        target[:, sticks, 1] = last.displacement[:, sticks, 1]
        matrix, right = through[rows], (target - free).reshape(count, -1)[:, rows]
        motion = np.zeros((2 * c, 0))
        if self._weights is not None:
            motion = self._closing[:, :, 1].reshape(-1, 1)
            resultant = self._weights.ravel()[rows]
            resultant[: len(touches)] += along[touches] * self._weights[touches, 1]
            wanted = (1.0 - share) * self._force_slopes[0] + share * self._force_slopes[1]
            wanted = wanted - np.einsum("ca,pca->p", self._weights, base)
            wanted -= np.einsum("pca,ca->p", self._turned_weights, force)
            matrix = np.block([[matrix, motion[rows]], [resultant[None], np.zeros((1, 1))]])
            right = np.column_stack([right, wanted])
        solved = np.linalg.solve(matrix, right.T) if len(matrix) else np.zeros((0, count))
        own, amplitude = solved[: len(rows)], solved[len(rows) :]
        moved = free + (through @ own + motion @ amplitude).T.reshape(count, c, 2)
        changed, still = base.reshape(count, -1), np.zeros(count)
        changed[:, rows] += own.T
        changed[:, 2 * touches + 1] += (along[touches, None] * own[: len(touches)]).T
        return PathTangent(base, moved, still, amplitude[0] if len(amplitude) else still)


def _relative(state: ContactState) -> Float:
    """Return gap and tangential displacement (c, 2)."""
    return np.column_stack([state.gap, state.tangential_displacement])
