"""Quantities: those that follow Young's modulus, and the names of an increment."""

from __future__ import annotations

import pytest

from finger3d.mechanics.readings.columns import Column, displacement_columns, pressure_column, strain_columns
from finger3d.mechanics.readings.quantities import OF_INCREMENT, Quantity
from finger3d.results.summary import PressStep


@pytest.mark.parametrize(
    ("column", "follows"),
    [
        (strain_columns("g")[0], False),
        (displacement_columns("m")[0], False),
        (pressure_column("t"), True),
        (Column("base", "base", "N", "x"), True),
        (Column("base", "base", "mm"), False),
    ],
)
def test_a_reading_follows_the_modulus_by_its_kind_or_its_unit(column: Column, follows: bool) -> None:
    assert Quantity.of(column).is_stress is follows


def test_every_number_of_a_step_is_a_quantity() -> None:
    numbers = {name for name, kind in PressStep.__annotations__.items() if kind.startswith("float")}
    assert {one.name for one in OF_INCREMENT} == numbers - {"residual"}
