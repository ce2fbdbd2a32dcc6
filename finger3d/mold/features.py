"""Features of a mold: solids that are added to its parts or cut from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from build123d import Solid


@dataclass(frozen=True)
class Feature:
    """Solids that are added to parts, and solids that are then cut from parts, both by the name of the part.

    Parts are half_a, half_b and lid; `parts` are further ones of the feature itself.
    """

    add: Mapping[str, Sequence[Solid]] = field(default_factory=dict)
    cut: Mapping[str, Sequence[Solid]] = field(default_factory=dict)
    parts: Mapping[str, Solid] = field(default_factory=dict)


def added(features: Iterable[Feature], name: str) -> list[Solid]:
    """Return all that features add to a part."""
    return [solid for feature in features for solid in feature.add.get(name, ())]


def cuts(features: Iterable[Feature], name: str) -> list[Solid]:
    """Return all that features cut from a part."""
    return [solid for feature in features for solid in feature.cut.get(name, ())]
