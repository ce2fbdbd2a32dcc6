"""Values of free keys as shares of their ranges.

The scale is logarithmic where the bounds differ by more than a decade.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.analyses.free_keys import FreeKey

_DECADE = 10.0


@dataclass(frozen=True)
class Scale:
    """Values of a free key as shares of its range, from 0 to 1."""

    key: str
    low: float
    high: float

    @classmethod
    def of(cls, free: FreeKey) -> Scale:
        """Return the scale of a free key."""
        return cls(free.key, free.low, free.high)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the bounds are positive and differ by more than a decade."""
        return self.low > 0.0 and self.high / self.low > _DECADE

    def value(self, share: float) -> float:
        """Return the value at a share."""
        if self.is_logarithmic:
            return self.low * math.pow(self.high / self.low, share)
        return self.low + (self.high - self.low) * share

    def share(self, value: float) -> float:
        """Return the share of a value."""
        if self.is_logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, share: float) -> float:
        """Return d value / d share."""
        return self.value(share) * math.log(self.high / self.low) if self.is_logarithmic else self.high - self.low


def values_at(scales: Sequence[Scale], shares: Float) -> Float:
    """Return values (k,) at shares (k,)."""
    return np.array([scale.value(float(share)) for scale, share in zip(scales, shares, strict=True)])
