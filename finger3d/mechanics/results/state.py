"""State of a press: that of contact, and that of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from finger3d._types import Float, freeze_arrays
from finger3d.contact.friction import OPEN
from finger3d.contact.state import ContactState
from finger3d.objects import Move

B = TypeVar("B")


@dataclass(frozen=True)
class State(Generic[B]):
    """State of the meshed part at one instant.

    Attributes
    ----------
    contact : state of the candidate contact points
    body : what the formulation of the body needs besides, see `finger3d.mechanics.formulation.Formulation`
    last : tuple of Move and (c, d) array, optional
        Motion of the object in the increment that led here, and the change of gap and tangential displacement, mm.
    """

    contact: ContactState
    body: B
    last: tuple[Move, Float] | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def share_until_touch(self, move: Move) -> Float:
        """Return the share (c,) of their last motion that open points make until they touch in a motion of the object.

        Their gap g and their place are expected to change as in the last increment, so that a point touches when
        g / (g - g') of the increment is over, where g' < 0 would be its gap at the end.  The share is zero where the
        path begins or turns.
        """
        ratio = None if self.last is None else move.length_ratio(self.last[0])
        if self.last is None or ratio is None:
            return np.zeros(len(self.contact.gap))
        closing, gap = -self.last[1][:, 0], np.maximum(self.contact.gap, 0.0)
        share = np.divide(gap, closing, out=np.full_like(gap, np.inf), where=closing > 0.0)
        return np.where(self.contact.status == OPEN, np.minimum(share, ratio), 0.0)

    def motion_until_touch(self, move: Move) -> Float:
        """Return the motion (c, d) mm, in x, y, z, of open points relative to the object until they touch.

        Its normal part counts, too, since normals turn as a gap closes.
        """
        if self.last is None:
            return np.zeros_like(self.contact.force)
        motion = self.share_until_touch(move)[:, None] * self.last[1]
        return np.asarray(np.einsum("ca,cak->ck", motion, self.contact.own_bases))
