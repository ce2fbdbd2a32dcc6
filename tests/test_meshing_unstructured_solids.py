"""What the unstructured meshers share: the solids, the size field in thin parts, and checks of what they return."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.refinement.sizing import sizing
from finger3d.meshing.structured.snap import UnusableMeshError
from finger3d.meshing.unstructured.solids import (
    box,
    check_tets,
    check_volume,
    finer_in_layers,
    glued_solids,
    on_cad,
    tessellated,
)
from tests.designs import FIG9
from tests.meshes import grid

TOLERANCE_MM = 0.1
SKINNED = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0, skin_mm=0.25)


def test_the_box_of_a_quarter_begins_on_its_symmetry_planes() -> None:
    low, high = box(FIG9, ("x", "z"))
    np.testing.assert_allclose(low, 0.0)
    np.testing.assert_allclose(high, [50.0, FIG9.height_mm, 10.0])
    np.testing.assert_allclose(box(FIG9, ())[0], [-50.0, 0.0, -10.0])


def test_tessellated_parts_have_their_volumes() -> None:
    body = tessellated(SKINNED, glued_solids(SKINNED, ("x",)), TOLERANCE_MM)
    assert body.part_labels == ("skin",)
    assert body.part(1).volume == pytest.approx(4.0 * 0.25 * 4.0)
    assert body.volume_mm3 == pytest.approx(4.0 * 3.0 * 4.0)
    check_volume(SKINNED, body, ("x",))
    with pytest.raises(Finger3dError, match=r"^block: .*volume_mm3"):
        check_volume(SKINNED, body, ())


def test_edges_in_a_thin_part_are_no_longer_than_it_is_thick() -> None:
    body = tessellated(SKINNED, glued_solids(SKINNED, ()), TOLERANCE_MM)
    field = sizing(SKINNED, MeshOptions(1.0, 1.0), (-1.0, 1.0, -1.0, 1.0), *box(SKINNED, ()))
    fine = finer_in_layers(field, body)
    inside = np.array([[0.5, 2.9, 0.5], [3.0, 2.8, -1.0]])
    assert (field.at(inside) > 0.9).all()
    # Twice the volume over the whole surface of the layer, whose rim counts too.
    layer = 2.0 * (8.0 * 4.0 * 0.25) / (2.0 * 8.0 * 4.0 + 2.0 * (8.0 + 4.0) * 0.25)
    assert (fine.at(inside) <= 1.6 * layer).all()
    assert fine.at(np.array([[0.0, 0.2, 0.0]]))[0] > 2.0 * layer


def test_tets_that_are_none_or_inverted_or_do_not_fill_the_body_are_refused() -> None:
    mesh = grid((2, 2, 2))
    check_tets(mesh.points, mesh.cells, 1.0)
    for tets, volume, text in (
        (mesh.cells[:0], 1.0, "no cells"),
        (mesh.cells[:, [1, 0, 2, 3]], 1.0, "inverted"),
        (mesh.cells, 2.0, "volume"),
    ):
        with pytest.raises(UnusableMeshError, match=text):
            check_tets(mesh.points, tets, volume)


def test_tets_in_the_wrong_place_are_no_part_of_a_body() -> None:
    body = tessellated(SKINNED, glued_solids(SKINNED, ()), TOLERANCE_MM)
    mesh = grid((2, 2, 2))
    with pytest.raises(UnusableMeshError):
        on_cad(mesh.points + 100.0, mesh.cells, body, "a mesher")
