"""Force control: the depth at which the object presses with a prescribed force, and a forecast of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import barycentric_interpolate
from scipy.optimize import brentq

from finger3d.contact.state import ContactSolution
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.model import Leg
from finger3d.mechanics.results.state import State
from finger3d.objects import ContactPath, ObjectPose, PlacedObject, first_touch

_DEEPEST = 0.99
"""Largest depth at which a force is searched for, over that at which the object would reach the finger's base."""

FORCE_TOLERANCE = 1e-6
"""Largest relative error of a prescribed force that counts as reached."""

_TARGET, _TARGET_IF_FACTORED = 1e-12, 1e-8
"""Relative error of the force at which the search ends, in small strain and where increments factor the stiffness;
where round-off prevents it, one up to a hundred times as large."""

_RESOLUTION, _NEAREST = 1e-12, 1e-6
"""Width of a bracket, over the largest depth, in which the force jumps; distance to a failed trial that ends it."""

_TRIALS, _FAILURES = 80, 8
"""Largest number of trials, and of those that fail."""

_STIFFENING = 5.0
"""Rate of the force beyond the deepest trial, over the largest rate up to it, at most."""

_NEARER = (0.5, 0.25, 0.125)
"""Shares of the first stride at which contact is looked for if there is none at its end."""

_SIMILAR = 0.5
"""Relative change of the depth up to which increments are similar."""

_GRADED = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 100)])
"""Distances from the place of first touch at which the overlap is found for a forecast, over the finger's extent."""

_ENDS = np.array([-1.0, 1.0])

_BEYOND = 1.1
"""Depth reached, over its forecast, from which the contact may lie beyond the fine part of the mesh."""


def deepest(way: ContactPath, first_contact_mm: float, height: float) -> float:
    """Return the largest depth (mm) at which a force is looked for: neither finger nor object reaches the base there.

    Parameters
    ----------
    way : the object, and the extents of the finger; its poses are not looked at
    first_contact_mm : height of the object's lowest point at first touch
    height : of the finger, mm
    """
    lowest = first_contact_mm
    if way.object.is_flat:  # it has no lowest point; over the base it is lowest at a corner
        x, z = np.meshgrid(way.half_length_mm * _ENDS, way.half_width_mm * _ENDS)
        lowest = float(PlacedObject.of(way.object, first_contact_mm).height(x.ravel(), z.ravel()).min())
    return _DEEPEST * min(height, lowest)


@dataclass(frozen=True)
class Trial:
    """An increment to a trial depth.

    Attributes
    ----------
    depth : mm
    solution : of the increment
    force : normal force at its end, N; NaN if the increment failed
    before : what an increment that failed led to until then; None if it failed at once
    """

    depth: float
    solution: ContactSolution[State[Any]]
    force: float
    before: Trial | None = None

    @property
    def ok(self) -> bool:
        """Whether the increment converged."""
        return self.solution.outcome.ok


def target(finite_strain: bool) -> float:
    """Return the relative error of the force at which the search ends."""
    return _TARGET_IF_FACTORED if finite_strain else _TARGET


def is_similar(depth: float, other: float) -> bool:
    """Return whether increments to two depths (mm) are similar, so that one may begin at the end of the other."""
    return abs(depth - other) < _SIMILAR * abs(depth)


@dataclass
class DepthSearch:
    """Search for the depth at which the normal force is the one wanted: interpolation inside a bracket.

    An increment that fails bounds the search, which goes on nearer to a depth that has converged.  So does one that
    ends with less force than a smaller depth and none to show for it: the object has passed through the finger.

    Attributes
    ----------
    increment : function of a depth (mm) and of the trials that have converged, the last one last
    wanted : force, N
    start : depth before the increment, mm
    begin : state before the increment as a trial, where only the depth changes, from which forces are interpolated too
    most : largest depth, mm; a turn or a slide may lift the object above first touch by as much, to negative depths
    target : relative error of the force
    """

    increment: Callable[[float, Sequence[Trial]], Trial]
    wanted: float
    start: float
    most: float
    begin: Trial | None = None
    target: float = _TARGET
    good: list[Trial] = field(default_factory=list, init=False)
    failed: list[Trial] = field(default_factory=list, init=False)

    def run(self, guess: float) -> Trial:
        """Return the trial that has the force, or one whose outcome and detail say why there is none."""
        depth = min(max(guess, -self.most), self.most)
        stride = max(abs(depth - self.start), 1e-3 * self.most)
        errors = [math.inf, math.inf]
        for _ in range(_TRIALS):
            trial = self._tried(depth)
            if trial.ok:
                error = abs(trial.force - self.wanted) / self.wanted
                if error <= self.target or 0.3 * errors[-1] < error <= 100.0 * self.target:
                    return trial
                errors.append(error)
            low, high = self._bracket()
            if low and high:
                if high.depth - low.depth <= _RESOLUTION * self.most:
                    nearer = min(low, high, key=lambda trial: abs(trial.force - self.wanted))
                    if abs(nearer.force - self.wanted) <= FORCE_TOLERANCE * self.wanted:
                        return nearer
                    text = f"{low.force:.6g} N and {high.force:.6g} N on either side of {low.depth:.6g} mm"
                    return self._ended(Outcome.FORCE_JUMPS, text)
            elif (low and low.depth >= self.most) or (high and high.depth <= -self.most):
                return self._ended(Outcome.FORCE_NOT_REACHED, self._extreme())
            bounds = self._bounds(low, high)
            if bounds[1] - bounds[0] <= _NEAREST * self.most and not (low and high):
                break
            if len(self.failed) > _FAILURES or self._falls_short(low, bounds[1]):
                break
            depth = self._next(low, high, bounds, stride, len(errors) > 4 and errors[-1] > 0.5 * errors[-3])
            stride *= 2.0
        cause = self.failed[-1].solution.outcome if self.failed else Outcome.FORCE_NOT_REACHED
        untouched = self.good and all(t.force <= 0.0 for t in self.good)
        if cause.is_cycle or untouched:  # no later increment starts from another force, as it does from a cycle
            cause = Outcome.FORCE_NOT_REACHED
        return self._ended(cause, self._extreme())

    def expected_ends(self, depth: float) -> tuple[tuple[State[Any], State[Any]], float]:
        """Return the ends of two trials, and the share of their difference to add to the first for a depth (mm)."""
        one, other = self.good[-1], self.good[-2] if len(self.good) > 1 else self.begin
        if other is None:
            return (one.solution.state, one.solution.state), 0.0
        share = (depth - one.depth) / (one.depth - other.depth) if one.depth != other.depth else 0.0
        return (one.solution.state, other.solution.state), share if abs(share) < 1.0 else 0.0

    def _tried(self, depth: float) -> Trial:
        """Try a depth; one without force is tried again nearer, since the object may have passed through the finger."""
        trial = self._sorted_in(depth)
        if not trial.ok or trial.force > 0.0 or depth <= self.start or self.good[:-1]:
            return trial
        for fraction in _NEARER:
            nearer = self._sorted_in(self.start + fraction * (depth - self.start))
            if nearer.ok and nearer.force > 0.0:
                self.good.remove(trial)
                self.failed.append(_passed_through(trial))
                return nearer
        return trial

    def _sorted_in(self, depth: float) -> Trial:
        trial = self.increment(depth, self.good)
        pushed = any(t.force > 0.0 and t.depth < depth for t in self.good)
        if trial.ok and (trial.force < -FORCE_TOLERANCE * self.wanted or (pushed and trial.force <= 0.0)):
            trial = _passed_through(trial)
        (self.good if trial.ok else self.failed).append(trial)
        if trial.before is not None:
            self.good.append(trial.before)
        return trial

    def _bracket(self) -> tuple[Trial | None, Trial | None]:
        """Return the deepest trial with too little force, and the shallowest deeper one with too much."""
        high = min((t for t in self.good if t.force > self.wanted), key=lambda t: t.depth, default=None)
        below = [t for t in self.good if t.force <= self.wanted and (high is None or t.depth < high.depth)]
        return max(below, key=lambda t: t.depth, default=None), high

    def _bounds(self, low: Trial | None, high: Trial | None) -> tuple[float, float]:
        """Return the depths between which the next trial lies; those that failed are approached by halves."""
        if not self.good:
            nearest = min((t.depth for t in self.failed), key=lambda depth: abs(depth - self.start))
            return min(self.start, nearest), max(self.start, nearest)
        lowest, highest = low.depth if low else -self.most, high.depth if high else self.most
        anchor = self.good[-1].depth
        above = [t.depth for t in self.failed if anchor < t.depth < highest]
        below = [t.depth for t in self.failed if lowest < t.depth < anchor]
        return max([lowest, *below]), min([highest, *above])

    def _falls_short(self, low: Trial | None, barrier: float) -> bool:
        """Return whether the force stays too small up to a depth that failed, at `_STIFFENING` times the rate."""
        if low is None or len(self.good) < 2 or all(t.depth != barrier for t in self.failed):
            return False
        known = sorted([*([self.begin] if self.begin else []), *self.good], key=lambda trial: trial.depth)
        rates = [(b.force - a.force) / (b.depth - a.depth) for a, b in pairwise(known) if b.depth > a.depth]
        return bool(rates) and low.force + _STIFFENING * max(rates) * (barrier - low.depth) < self.wanted

    def _next(
        self, low: Trial | None, high: Trial | None, bounds: tuple[float, float], stride: float, slow: bool
    ) -> float:
        """Return the next depth: interpolated from the last trials unless that is out of bounds or too slow."""
        middle = 0.5 * (bounds[0] + bounds[1])
        if not self.good:
            return middle
        one, depth = self.good[-1], self._interpolated()
        if low and high:
            return depth if bounds[0] < depth < bounds[1] and not slow else middle
        side = 1.0 if low else -1.0
        if not side * (depth - one.depth) > 0.0:
            depth = one.depth + side * stride
        depth = one.depth + side * min(abs(depth - one.depth), stride)
        barred = any(t.depth in bounds for t in self.failed)
        lowest, highest = (0.5 * (bounds[0] + one.depth), 0.5 * (bounds[1] + one.depth)) if barred else bounds
        return min(max(depth, lowest), highest)

    def _interpolated(self) -> float:
        """Return the depth of the force by inverse quadratic interpolation of the last trials; NaN if they do not rise.

        A single trial counts as one of a force proportional to the depth.
        """
        rest = Trial(0.0, self.good[-1].solution, 0.0)
        begin = [self.begin] if self.begin and all(t.depth != self.begin.depth for t in self.good) else []
        last = [*begin, *self.good][-3:]
        last = sorted(last if len(last) > 1 else [rest, *last], key=lambda trial: trial.depth)
        depths, forces = [t.depth for t in last], [t.force for t in last]
        if not (np.diff(forces) > 0.0).all() or not (np.diff(depths) > 0.0).all():
            return math.nan
        return float(barycentric_interpolate(forces, depths, self.wanted))

    def _extreme(self) -> str:
        """Return the force found that is nearest to the one wanted, with its depth, and at how many there was none."""
        cycles = sum(trial.solution.outcome.is_cycle for trial in self.failed)
        if cycles:
            rule = f"the paper's rule has no answer at {cycles} of the depths tried; use [contact] rule = 'projection'"
            return f"{self._nearest()}; {rule}"
        return self._nearest()

    def _nearest(self) -> str:
        if not self.good:
            return f"{self.wanted:.6g} N asked; no depth that was tried gave a solution"
        forces = [trial.force for trial in self.good]
        kind = "largest" if max(forces) < self.wanted else "least" if min(forces) > self.wanted else "nearest"
        best = min(self.good, key=lambda trial: (abs(trial.force - self.wanted), -trial.depth))
        if best.force <= 0.0:
            return f"{self.wanted:.6g} N asked; the object does not touch the finger down to {best.depth:.4g} mm"
        return f"{self.wanted:.6g} N asked; the {kind} force is {best.force:.6g} N, at a depth of {best.depth:.4g} mm"

    def _ended(self, outcome: Outcome, detail: str) -> Trial:
        last = (self.failed or self.good)[-1]
        kept = last.solution.detail if last.solution.outcome is outcome else ""
        detail = "; ".join(text for text in (kept, detail) if text)
        return replace(last, solution=replace(last.solution, outcome=outcome, detail=detail), force=math.nan)


def _passed_through(trial: Trial) -> Trial:
    return replace(trial, solution=replace(trial.solution, outcome=Outcome.NO_CONVERGENCE), force=math.nan)


def forecast_depth(way: ContactPath, material: Isotropic, force: float, height: float, width: float) -> float:
    """Return a rough depth (mm) for a force (N): an elastic foundation under the overlap of object and finger.

    Its modulus is E / (1 - nu^2).  Its thickness is 1.2 times the finger's height, or b max(1.2, log(2.8 l / b) - 0.5)
    if that is less, with the half width b of the overlap and the finger's height l, or half the length of the overlap
    if that is less and ends on the finger.  These are 1.2 times those that give the depth of a layer, and that of a
    line contact (Johnson 1985, eq. 5.56).  In 13 presses of sections and solids the forecast was 0.75 to 2.3 times the
    depth, in sections under round objects 0.9 to 1.1 times.
    It serves to mesh the contact and to choose candidate points; the press finds the depth.
    """
    touch = first_touch(way)
    lines = [
        np.unique(np.clip(middle + np.outer([-1.0, 1.0], 2.0 * half * _GRADED), -half, half))
        for half, middle in zip((way.half_length_mm, way.half_width_mm), touch.place, strict=True)
    ]
    x, z = np.meshgrid(*lines, indexing="ij")
    weight = [0.5 * (np.diff(line, append=line[-1]) + np.diff(line, prepend=line[0])) for line in lines]
    plan = np.outer(weight[0], weight[1] if way.half_width_mm else [width])
    gap = PlacedObject.of(way.object, touch.height_mm, ObjectPose(0.0)).height(x, z) - way.top(x, z)
    gap = np.where(np.isfinite(gap), gap, np.inf)
    modulus = material.E_MPa / (1.0 - material.nu**2)

    def pressed(depth: float) -> float:
        overlap = np.maximum(depth - gap, 0.0)
        inside = overlap > 0.0
        halves = [0.5 * float(np.ptp(side[inside])) + 1e-6 * height if inside.any() else height for side in (x, z)]
        ends = [half for half, most in zip(halves, (way.half_length_mm, way.half_width_mm), strict=True) if half < most]
        b, length = min(ends, default=height), min(max(ends), height) if len(ends) == 2 else height
        thickness = min(b * max(1.2, math.log(2.8 * length / b) - 0.5), 1.2 * height)
        return modulus * float((overlap * plan).sum()) / thickness

    most = deepest(way, touch.height_mm, height)
    depth = brentq(lambda depth: pressed(depth) - force, 0.0, most) if pressed(most) > force else most
    return float(f"{depth:.4g}")


def at_depth_reached(legs: tuple[Leg, ...], reached_mm: float) -> tuple[Leg, ...] | None:
    """Return the legs with the depth reached in place of a forecast that was too small; None if none was."""
    forced = [leg.depth_mm for leg in legs if leg.force_N is not None]
    if not forced or reached_mm <= _BEYOND * max(forced):
        return None
    return tuple(leg if leg.force_N is None else replace(leg, depth_mm=reached_mm) for leg in legs)
