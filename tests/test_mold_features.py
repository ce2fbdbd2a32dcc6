"""Features of a mold."""

from __future__ import annotations

from finger3d.mold.features import Feature, added, cuts
from finger3d.mold.solids import between


def test_what_features_add_and_cut_is_collected_by_part() -> None:
    a, b, c = (between((i, 0, 0), (i + 1.0, 1, 1)) for i in range(3))
    features = [Feature(add={"lid": [a]}, cut={"half_a": [b]}), Feature(add={"lid": [c]})]
    assert added(features, "lid") == [a, c]
    assert cuts(features, "half_a") == [b]
    assert cuts(features, "half_b") == []
