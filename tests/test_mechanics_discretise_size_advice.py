"""Advice on edge lengths: none of a mesh that does not fit into memory."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d._cost import mesh_gb, rows_gb
from finger3d.mechanics.discretise.resolution import unresolved_details
from finger3d.mechanics.discretise.size_advice import is_meshable_at, size_advice
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.meshing.generate import is_meshable
from finger3d.meshing.structured.swept import mesh_section
from finger3d.objects import Wedge
from tests.test_mechanics_discretise_resolution import FIG9, fig9


def test_an_edge_that_no_memory_holds_is_not_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(Wedge(angle=0.5, tip_radius_mm=0.02), 5.0, 4.0)
    (line,) = unresolved_details(model)
    assert "mesh.size_mm = 0.01 resolves it" in line
    zone, axes = model.first_contact.contact_box, symmetry(model)
    cells = mesh_section(FIG9, replace(model.mesh, size_mm=0.01), zone, axes)[1].cells
    rows = 2.0 * 11.0 / 0.01  # the wedge comes within 0.3 of its depth, 1.5 mm, over 11 mm on either side
    # 80 % of the memory is what a press may take (finger3d/_cost.py); cells are counted before they are made, to 11 %
    for share, fits in ((1.3, True), (0.7, False)):
        total = share * 1e9 * (mesh_gb(cells, 2) + rows_gb(rows)) / 0.8
        monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda total=total: (total, total))
        assert is_meshable_at(model, 0.01) == fits
        (line,) = unresolved_details(model)
        assert ("mesh.size_mm = " in line) == fits
        assert ("choose a larger object.tip_radius_mm" in line) != fits


@pytest.mark.parametrize(("size", "said"), [(0.1197, "0.11"), (0.12, "0.12"), (3.96, "3.9"), (0.00999, "0.0099")])
def test_advice_is_rounded_down(size: float, said: str) -> None:
    assert size_advice(fig9(Wedge(angle=0.5), 5.0, 4.0), size, "has enough", "") == f"mesh.size_mm = {said} has enough"


def test_advice_counts_the_memory_of_the_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(Wedge(angle=0.5, tip_radius_mm=0.02), 5.0, 4.0)
    # 8000 points of the half section have a dense compliance of 40 (2 * 8000)^2 bytes, 10 GB
    monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda: (10**10, 10**10))
    options, zone = replace(model.mesh, size_mm=1e-3), model.first_contact.contact_box
    assert is_meshable(FIG9, options, zone, 2, symmetry(model))
    assert not is_meshable_at(model, 1e-3)
