"""Pictures of deformed fingers at one step and at several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STICK
from finger3d.fem.mesh.simplex import CONTACT
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.structured.swept import mesh_section
from finger3d.plotting.deformed import DeformedFinger, draw_fingers
from finger3d.plotting.panels import palette
from tests.designs import FIG9


@pytest.fixture(scope="module")
def finger() -> DeformedFinger:
    mesh, _ = mesh_section(FIG9, MeshOptions(5.0, 20.0, "swept"), (-44.0, 44.0, -10.0, 10.0), ())
    nodes = np.unique(mesh.facets["contact"][:, :2])
    nodes = nodes[np.argsort(mesh.points[nodes, 0])]
    middle = np.abs(mesh.points[nodes, 0]) < 10.0
    return DeformedFinger(
        mesh=mesh,
        displacement=np.zeros_like(mesh.points),
        pressure=np.where(middle, 2.0, 0.0),
        shear=np.zeros((len(nodes), 3)),
        status=np.where(middle, np.where(mesh.points[nodes, 0] < 0.0, SLIP, STICK), OPEN),
        nodes=nodes,
        faces=np.full(len(nodes), CONTACT),
        thing=None,
    )


def test_steps_share_one_frame_and_one_scale_of_pressure(finger: DeformedFinger) -> None:
    lifted = replace(finger, displacement=finger.displacement + [0.0, 30.0], pressure=0.5 * finger.pressure)
    figures, renderer = draw_fingers([finger, lifted])
    assert renderer == "matplotlib"
    first, second = (figure.axes[0] for figure in figures)
    assert first.get_xlim() == second.get_xlim()
    assert first.get_ylim() == second.get_ylim()
    assert first.get_ylim()[1] > FIG9.height_mm + 30.0
    for figure in figures:
        bar = figure.axes[2]
        assert bar.get_xlim() == (0.0, 2.0)


def test_each_half_of_a_facet_has_the_status_of_its_end(finger: DeformedFinger) -> None:
    (figure,), _ = draw_fingers([finger])
    halves = max(figure.axes[1].collections, key=lambda lines: len(lines.get_segments()))
    drawn = np.asarray(halves.get_colors())[:, :3]
    known = {int(node): int(state) for node, state in zip(finger.nodes, finger.status, strict=True)}
    ends = finger.mesh.facets["contact"][:, :2].ravel()
    assert drawn == pytest.approx(palette()[[known[int(node)] for node in ends]])
