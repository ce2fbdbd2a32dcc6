"""Emulator of a press: what it gives with any values of the free keys, interpolated between presses.

Presses are made on a face-centred central composite design (Box and Wilson 1951) first, then wherever the emulator is
asked to.  Between them the inverse hyperbolic sine of every number, which is linear for small ones and logarithmic for
large ones, is interpolated by cubic radial basis functions.  Young's modulus, where all stresses are proportional to
it, and the offset of the depth need no presses.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator

from finger3d._types import Float
from finger3d.analyses.free_keys import FreeKey, values_at
from finger3d.analyses.identify.material_tests import LawInTests
from finger3d.analyses.identify.presses import MODULI, OFFSET, SHARPEST, MeasuredPress, Simulation
from finger3d.errors import Finger3dError

_OFFSETS = np.linspace(0.0, 1.0, 33)
"""Shares of the offset between which numbers are interpolated linearly."""

_SMALL = 0.1
"""Part of the largest measured number of a column up to which the numbers of presses are interpolated as they are."""


@dataclass
class Emulator:
    """Numbers of all measured columns at their rows, n in all, for any shares of the k free keys.

    Parameters
    ----------
    simulation : makes the presses
    data : the measured press; `NO_PRESS` without one
    tested : law that gives the numbers of material tests, after those of the press, and without presses
    """

    simulation: Simulation
    data: MeasuredPress
    tested: LawInTests
    _presses: dict[tuple[float, ...], Float] = field(default_factory=dict)
    _failures: dict[tuple[float, ...], Finger3dError] = field(default_factory=dict)

    @property
    def free(self) -> tuple[FreeKey, ...]:
        """The free keys."""
        return self.simulation.free

    @cached_property
    def pressed(self) -> list[int]:
        """Numbers of the shares whose change needs a press."""
        if not self.data.columns:
            return []
        return [i for i, f in enumerate(self.free) if f.key != OFFSET and i not in self._modulus]

    @cached_property
    def _modulus(self) -> list[int]:
        """Number of the share of Young's modulus, if all stresses are proportional to it."""
        if not self.data.columns or not self.simulation.scales_with_modulus:
            return []
        return [i for i, f in enumerate(self.free) if f.key in MODULI]

    @cached_property
    def _offset(self) -> list[int]:
        return [i for i, f in enumerate(self.free) if f.key == OFFSET]

    @cached_property
    def _size(self) -> Float:
        """Size (n,) of small numbers."""
        sizes = [max(_SMALL * float(np.abs(v).max()), SHARPEST) for v in self.data.columns.values()]
        return np.repeat(sizes, len(self.data.at))

    def design(self) -> list[Float]:
        """Return the shares (k,) of the first presses: all corners, the middle, and the middles of all faces."""
        d = len(self.pressed)
        corners = [np.array(corner) for corner in itertools.product((0.0, 1.0), repeat=d)]
        middles = [np.full(d, 0.5) + sign * face for face in 0.5 * np.eye(d) for sign in (-1.0, 1.0)]
        found = [np.full(len(self.free), 0.5) for _ in range(1 if d == 0 else 1 + len(corners) + len(middles))]
        for shares, point in zip(found[1:], [*corners, *middles], strict=False):
            shares[self.pressed] = point
        return found

    def ends(self, designed: Sequence[Float]) -> list[Float]:
        """Return designed shares, and those with the least and the largest of all that need no press."""
        still = [i for i in range(len(self.free)) if i not in self.pressed]
        found = np.tile(designed, (3, 1))
        found[len(designed) :, still] = np.repeat([0.0, 1.0], len(designed))[:, None]
        return list(found)

    def press(self, shares: Float) -> None:
        """Press at shares (k,)."""
        point = tuple(float(s) for s in shares[self.pressed])
        at = shares.copy()
        at[self._modulus] = [self.free[i].share(self.free[i].middle) for i in self._modulus]
        rows = []
        try:
            for offset in _OFFSETS if self._offset else (0.0,):
                at[self._offset] = offset
                rows.append(np.concatenate([*self.simulation.at(values_at(self.free, at), self.data).values()]))
        except Finger3dError as error:
            self._failures[point] = error
        else:
            self._presses[point] = np.arcsinh(np.array(rows) / self._size)
        self.__dict__.pop("_interpolated", None)

    @property
    def count(self) -> int:
        """Number of presses that were asked for, known or not: a repeated identification asks for the same ones."""
        return len(self._presses) + len(self._failures)

    def check(self) -> None:
        """Raise what the first press that failed raised if too few did not."""
        if len(self._presses) <= len(self.pressed):
            raise next(iter(self._failures.values()))

    def distance(self, shares: Float) -> float:
        """Return the distance in shares (k,) from the nearest press."""
        known = np.array([*self._presses, *self._failures])
        return float(np.linalg.norm(known - shares[self.pressed], axis=1).min()) if self.pressed else 0.0

    def fails(self, shares: Float) -> NDArray[np.bool_]:
        """Return at which shares (s, k) the nearest press failed."""
        if not self._failures:
            return np.zeros(len(shares), dtype=bool)
        at, both = shares[:, None, self.pressed], (self._failures, self._presses)
        bad, good = (np.linalg.norm(at - np.array([*some]), axis=2).min(axis=1) for some in both)
        return np.asarray(bad < good)

    @cached_property
    def _interpolated(self) -> dict[str, RBFInterpolator]:
        """Interpolation of the presses, by kernel; empty if nothing needs a press."""
        if not self.pressed:
            return {}
        points, numbers = np.array([*self._presses]), np.array([*self._presses.values()])
        flat = numbers.reshape(len(points), -1)
        return {kernel: RBFInterpolator(points, flat, kernel=kernel, degree=1) for kernel in ("cubic", "linear")}

    def __call__(self, shares: Float, kernel: str = "cubic") -> Float:
        """Return the numbers (s, n) at shares (s, k)."""
        tested = self.tested.stress(shares)
        if not self.data.columns:
            return tested
        (first, *_) = self._presses.values()
        if self.pressed:
            found = self._interpolated[kernel](shares[:, self.pressed]).reshape(len(shares), *first.shape)
        else:
            found = np.broadcast_to(first, (len(shares), *first.shape))
        found = np.sinh(found) * self._size
        for i in self._offset:
            weight = np.maximum(0.0, 1.0 - np.abs(shares[:, i, None] - _OFFSETS) * (len(_OFFSETS) - 1.0))
            found = np.einsum("so,son->sn", weight, found)[:, None]
        found = found[:, 0]
        for i in self._modulus:
            free, modulus = self.free[i], MODULI[self.free[i].key]
            factor = [modulus(free.value(float(share))) / modulus(free.middle) for share in shares[:, i]]
            found = np.where(self._is_stress, np.array(factor)[:, None] * found, found)
        return np.concatenate([found, tested], axis=1)

    @cached_property
    def measured(self) -> dict[str, Float]:
        """Every measured column, and the stresses of every material test, by name."""
        return {**self.data.columns, **self.tested.columns}

    @cached_property
    def stds(self) -> dict[str, Float]:
        """Standard deviations by column, of those that have them."""
        return {**self.data.stds, **self.tested.stds}

    def columns(self, shares: Float) -> dict[str, Float]:
        """Return the numbers of every measured column at its rows, for shares (k,)."""
        ends = np.cumsum([len(values) for values in self.measured.values()])[:-1]
        return dict(zip(self.measured, np.split(self(shares[None])[0], ends), strict=True))

    @cached_property
    def _is_stress(self) -> NDArray[np.bool_]:
        """Whether each of the numbers (n,) is proportional to the stresses."""
        return np.repeat([name in self.simulation.stresses for name in self.data.columns], len(self.data.at))

    def error(self, shares: Float) -> Float:
        """Return the error (s, n) at shares (s, k): half of the difference to another interpolation."""
        if not self.pressed:
            return np.zeros((len(shares), sum(map(len, self.measured.values()))))
        return 0.5 * (self(shares) - self(shares, "linear"))
