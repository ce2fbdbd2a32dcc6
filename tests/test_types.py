"""Arrays of frozen dataclasses cannot be written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.contact.state import ContactState
from finger3d.fem.assembly import Stiffness
from finger3d.fem.solvers.condense import condense
from tests.meshes import grid


def test_arrays_and_arrays_in_mappings_are_read_only() -> None:
    mesh = grid((2, 2))
    with pytest.raises(ValueError, match="read-only"):
        mesh.points[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.facets["x-"][0] = 0
    with pytest.raises(ValueError, match="read-only"):
        replace(mesh, points=mesh.points + 1.0).points[0] = 1.0


def test_the_array_that_was_passed_stays_writable() -> None:
    gap = np.ones(3)
    state = ContactState.at_rest(gap, 2)
    gap[0] = 2.0
    assert state.gap[0] == 2.0


def test_the_compliance_of_a_condensed_body_is_read_only() -> None:
    rows = sp.csr_matrix(np.eye(1, 4, 3))
    stiffness = Stiffness(sp.csr_matrix(np.diag([1.0, 1.0, 1.0, 2.0])), np.zeros(0, dtype=np.int64), 1.0)
    condensed = condense(stiffness, np.arange(2), rows, "superlu")
    assert condensed.compliance[0, 0] == 0.5
    with pytest.raises(ValueError, match="read-only"):
        condensed.compliance[0, 0] = 1.0
