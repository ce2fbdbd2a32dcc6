"""Limits of sizes."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from tests.designs import FIG9, ZONE

BOTH = ("x", "z")


@pytest.mark.parametrize(("size", "text"), [(30.0, "mesh.size_mm"), (0.05, "tetrahedra, .* GB.*allowed")])
def test_sizes_that_hang_pytetwild_are_refused_before_cad(size: float, text: str) -> None:
    options = MeshOptions(size_mm=size, base_size_mm=30.0, mesher="ftetwild")
    with pytest.raises(Finger3dError, match=text):
        mesh_solid(FIG9, options, ZONE, BOTH)
