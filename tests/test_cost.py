"""The cost model."""

from __future__ import annotations

import pytest

from finger3d._cost import Budget, PressSize, mesh_gb, tets_made


def test_an_increment_at_finite_strain_costs_a_factorisation_and_its_iterations() -> None:
    one, two = PressSize(3, 1e6, 100.0), PressSize(3, 2e6, 100.0)
    # the ordering of the condensation is reused; iterations are proportional to the unknowns
    assert 0.5 * one.condensation_s < one.finite_strain_s < 1.5 * one.condensation_s
    iterations = one.finite_strain_s - 0.85 * one.condensation_s
    assert two.finite_strain_s - 0.85 * two.condensation_s == pytest.approx(2.0 * iterations, rel=0.01)


@pytest.mark.parametrize(
    ("dofs", "measured"), [(860, 0.044), (5276, 0.14), (17_895, 0.197), (47_312, 0.837), (102_596, 2.01)]
)
def test_increments_of_sections_at_finite_strain_take_what_was_measured(dofs: int, measured: float) -> None:
    # processor seconds an increment of the sections at large deformation of validation/cost_forecast.py
    assert 0.5 < PressSize(2, dofs, 50.0).finite_strain_s / measured < 2.0


def test_a_budget_is_a_share_of_the_press_and_at_least_its_seconds() -> None:
    size = PressSize(2, 10_000.0, 100.0)
    press = size.press_s(10)
    assert press == pytest.approx(size.condensation_s + 10 * size.contact_s)
    assert Budget(0.5, 0.0).seconds(press) == pytest.approx(0.5 * press)
    assert Budget(0.5, 100.0).seconds(press) == 100.0


def test_large_meshes_take_the_memory_that_was_measured() -> None:
    # of presses of the Fig. 9 finger with 522 540 and 1 009 778 unknowns
    for dofs, measured in ((522_540, 8.4), (1_009_778, 19.8)):
        assert mesh_gb(dofs / 4.65, 3) == pytest.approx(measured, rel=0.1)


@pytest.mark.parametrize(
    ("ratio", "wanted", "made"),
    [(15.0, 12_449, 7_092), (7.5, 4_906, 4_678), (5.0, 10_668, 9_557), (4.0, 4_775, 5_093), (13.3, 8_199, 5_719)],
)
def test_fewer_tets_are_made_where_sizes_differ_much(ratio: float, wanted: int, made: int) -> None:
    # by fTetWild, of a block under a ball and of the Fig. 9 finger
    assert tets_made(ratio) * wanted == pytest.approx(made, rel=0.15)
