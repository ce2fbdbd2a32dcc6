"""Law of the contact interface: friction, and the relation between the gap and the normal force."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb, FrictionLaw


class NormalLaw(ABC):
    """Relation between gap and normal force of a contact point."""

    @abstractmethod
    def compliance(self, area: Float) -> Float:
        """Return the compliance (c,) mm/N of the interface at points with tributary areas (c,) mm2."""


@dataclass(frozen=True)
class Signorini(NormalLaw):
    """Unilateral contact of bare surfaces (Maeno 2004, Eqs. 1 and 2): no gap where a force acts."""

    def compliance(self, area: Float) -> Float:
        """Return zeros."""
        return np.zeros(len(area))


@dataclass(frozen=True)
class ContactLaw:
    """Friction law and normal law of an interface."""

    friction: FrictionLaw = field(default_factory=Coulomb)
    normal: NormalLaw = field(default_factory=Signorini)
