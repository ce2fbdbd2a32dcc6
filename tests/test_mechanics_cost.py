"""Cost that effects add."""

from __future__ import annotations

import pytest

from finger3d.mechanics.cost import AddedCost, finite_strain_s


def test_an_increment_at_finite_strain_costs_a_factorisation_and_its_iterations() -> None:
    assert finite_strain_s(0.0, 10.0) / finite_strain_s(0.0, 1.0) == pytest.approx(10.0)
    # the ordering of the condensation is reused; iterations are proportional to the unknowns
    assert 0.5 < finite_strain_s(0.0, 1.0) <= 1.0
    assert finite_strain_s(2e6, 1.0) - finite_strain_s(1e6, 1.0) == pytest.approx(finite_strain_s(1e6, 0.0))


def test_a_cost_is_told_with_its_reason() -> None:
    text = str(AddedCost(seconds=12.345, memory_mb=678.9, reason="a mesh of its own"))
    assert "12 s" in text
    assert "6.8e+02 MB" in text
    assert text.endswith("a mesh of its own")
