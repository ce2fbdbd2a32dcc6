"""Columns know the names of readings in calibrations and in tables."""

from __future__ import annotations

from finger3d.mechanics.readings.columns import (
    Column,
    by_key,
    displacement_columns,
    in_order,
    in_space,
    of_kind,
    pressure_column,
    strain_columns,
)


def test_columns_have_the_names_that_tables_and_calibrations_have() -> None:
    strain, free = strain_columns("g36")
    columns = (strain, free, *displacement_columns("m1", 2), pressure_column("t_1"), Column("wire", "elongation", "mm"))
    assert [column.name for column in columns] == ["g36", "g36_free", "m1.x", "m1.y", "t_1", "wire"]
    assert [column.key for column in columns] == [
        "gauge_g36", "gauge_g36_free", "marker_m1_x_mm", "marker_m1_y_mm", "taxel_t_1_MPa", "reading_wire_mm",
    ]  # fmt: skip
    assert columns[2].title == "displacement of marker m1 along x"
    assert of_kind(columns, "gauge") == (strain, free)


def test_tables_begin_with_gauges_and_have_all_components_of_a_displacement() -> None:
    row = dict(zip((*displacement_columns("m", 2), pressure_column("t"), *strain_columns("g")), range(5), strict=True))
    row = {Column("wire", "elongation"): -1.0} | row
    table = by_key(in_space(in_order(row)))
    assert list(table) == [
        "gauge_g", "gauge_g_free", "marker_m_x_mm", "marker_m_y_mm", "marker_m_z_mm", "taxel_t_MPa", "reading_wire",
    ]  # fmt: skip
    assert list(table.values()) == [3, 4, 0, 1, 0.0, 2, -1.0]
    solid = dict(zip(displacement_columns("m"), (1.0, 2.0, 3.0), strict=True))
    assert in_space(solid) == solid
