"""State of a press: that of contact, and that of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from finger3d._types import freeze_arrays
from finger3d.contact.state import ContactState

B = TypeVar("B")


@dataclass(frozen=True)
class State(Generic[B]):
    """State of the meshed part at one instant.

    Attributes
    ----------
    contact : state of the candidate contact points
    body : what the formulation of the body needs besides, see `finger3d.mechanics.formulation.Formulation`
    """

    contact: ContactState
    body: B

    def __post_init__(self) -> None:
        freeze_arrays(self)
