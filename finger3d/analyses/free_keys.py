"""Free keys of a scene and their bounds, for searches and fits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from finger3d._types import Float, TreeView
from finger3d.errors import Finger3dError
from finger3d.scene import Scene, parse, tree
from finger3d.scene.material import modulus_of
from finger3d.scene.messages import shown

_DECADE = 10.0

Number = TypeVar("Number", float, Float)


@dataclass(frozen=True)
class FreeKey:
    """Free key of the scene and its bounds."""

    key: str
    low: float
    high: float

    @classmethod
    def of(cls, text: str, option: str = "--free", example: str = "for instance finger.radius_mm=60:200") -> FreeKey:
        """From ``KEY=LOW:HIGH``, which an option gave."""
        key, _, bounds = text.partition("=")
        try:
            low, high = (float(part) for part in bounds.split(":"))
        except ValueError:
            low = high = math.nan
        if not key.strip() or not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise Finger3dError(f"{option} {shown(text)}: must be KEY=LOW:HIGH with LOW below HIGH, {example}")
        return cls(key.strip(), low, high)

    def numbered(self, given: TreeView) -> str:
        """Return the key as it is set, with the number of a gauge in place of its name."""
        return tree.numbered(self.key, given, "--free")

    def start(self, given: TreeView) -> float:
        """Return the value of the scene as written, or the middle of the bounds where it lies outside.

        A modulus that the scene gives by a hardness or a silicone is that of this material.
        """
        key = self.numbered(given)
        own = tree.value_at(given, key) or modulus_of(given, key)
        return float(own) if isinstance(own, int | float) and self.low <= own <= self.high else self.middle

    @property
    def middle(self) -> float:
        """Middle of the bounds."""
        return 0.5 * (self.low + self.high)

    @property
    def is_logarithmic(self) -> bool:
        """Whether shares are those of the logarithm: of positive bounds that differ by more than a decade."""
        return self.low > 0.0 and self.high / self.low > _DECADE

    def value(self, share: Number) -> Number:
        """Return the value at a share of the range, from 0 to 1; of several shares (n,) the values (n,)."""
        if self.is_logarithmic:
            logarithmic: Number = self.low * (self.high / self.low) ** share
            return logarithmic
        return self.low + (self.high - self.low) * share

    def share(self, value: float) -> float:
        """Return the share of the range at a value."""
        if self.is_logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def values_at(free: Sequence[FreeKey], shares: Float) -> Float:
    """Return values (k,) of free keys at shares (k,) of their ranges."""
    return np.array([key.value(float(share)) for key, share in zip(free, shares, strict=True)])


Bounds = Mapping[str, tuple[float, float]] | Sequence[str]
"""Lower and upper bound by key, or texts such as ``material.E_MPa=0.05:5``."""


def free_keys(bounds: Bounds) -> tuple[FreeKey, ...]:
    """Return the free keys with these bounds."""
    if isinstance(bounds, Mapping):
        bounds = [f"{key}={low!r}:{high!r}" for key, (low, high) in bounds.items()]
    return tuple(map(FreeKey.of, bounds))


def check_distinct(keys: Sequence[str], option: str = "--free", advice: str = "") -> None:
    """Raise an error if an option gives a key twice."""
    for i, key in enumerate(keys):
        if key in keys[:i]:
            raise Finger3dError(f"{option} {key}: given twice{advice}")


def scene_with(given: TreeView, keys: Sequence[str], values: Sequence[float] | Float, path: Path | None) -> Scene:
    """Return the scene with new values of keys; the message about an invalid value names the option --free."""
    changes = [f"{key}={float(value)!r}" for key, value in zip(keys, values, strict=True)]
    changed = tree.override(dict(given), changes, "--free")
    return parse(changed, path=path, set_keys=dict.fromkeys(keys, "--free"))
