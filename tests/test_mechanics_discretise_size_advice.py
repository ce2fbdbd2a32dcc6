"""Advice on edge lengths: none of a mesh that does not fit into memory."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d._cost import mesh_gb
from finger3d.mechanics.discretise.resolution import unresolved_details
from finger3d.mechanics.discretise.size_advice import is_meshable_at
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.meshing.structured.swept import mesh_section
from finger3d.objects import Wedge
from tests.test_mechanics_discretise_resolution import FIG9, fig9


def test_an_edge_that_no_memory_holds_is_not_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(Wedge(angle=0.5, tip_radius_mm=0.02), 5.0, 4.0)
    (line,) = unresolved_details(model)
    assert "mesh.size_mm = 0.01 resolves it" in line
    cells = mesh_section(FIG9, replace(model.mesh, size_mm=0.01), model.first_contact.contact_box, symmetry(model))[
        1
    ].cells
    # 80 % of the memory is what a mesh may take (finger3d/_cost.py); cells are counted before they are made, to 11 %
    for share, is_meshable in ((1.3, True), (0.7, False)):
        total = share * 1e9 * mesh_gb(cells, 2) / 0.8
        monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda total=total: (total, total))
        assert is_meshable_at(model, 0.01) == is_meshable
        (line,) = unresolved_details(model)
        assert ("mesh.size_mm = " in line) == is_meshable
        assert ("choose a larger object.tip_radius_mm" in line) != is_meshable
