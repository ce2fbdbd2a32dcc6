"""The view of a solid in a page."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from finger3d.mechanics.model import Gauge
from finger3d.report.view3d import view_of
from finger3d.results.states import load_states


def test_the_view_keeps_to_its_budget(solid: Path, section: Path) -> None:
    states = load_states(solid / "steps.npz")
    whole = view_of(states)
    assert whole is not None
    assert len(whole.labels) == 4
    # every corner of every facet, once on the faces that may touch and once on the others
    on = states.on_contact
    assert len(whole.rest) == len(np.unique(states.corners[on])) + len(np.unique(states.corners[~on]))
    assert len(whole.body) + len(whole.contact) == len(states.facets)
    each = (len(whole.rest) * 17 + 3 * len(whole.contact)) * 4 // 3
    fixed = (states.corners.size + states.object_points.size + states.object_faces.size) * 16 // 3
    less = view_of(states, budget=fixed + 2 * each)
    one = view_of(states, budget=fixed + each)
    assert less is not None
    assert one is not None
    assert (less.labels[-1], one.labels) == (whole.labels[-1], whole.labels[-1:])
    assert len(less.labels) == 2
    assert view_of(states, budget=1000) is None
    assert view_of(load_states(section / "steps.npz")) is None
    slid = view_of(replace(states, target=states.target + [0.0, 1.5, 0.0, 0.0, 2.5, 0.0]))
    assert slid is not None
    assert re.findall(r"[\d.]+", slid.labels[-1]) == ["4", "0.5", "1.5", "2.5"]


def test_the_view_carries_the_gauges_of_every_step_on_the_face_in_front(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    view = view_of(states, [Gauge("g", 1.0, 4.0), Gauge("elsewhere", 1.0, 9.0)])
    assert view is not None
    assert view.gauge_labels == ("g, 0°, z = 0",)
    assert view.gauges.shape == (4, 1, 3, 3)
    # SOLID is 2 mm wide and pressed by 0.5 mm: at rest the gauge would be at (1, 4, 1)
    at = view.gauges[:, 0, 1]
    assert np.all(np.diff(at[:, 1]) < 0.0)
    assert np.all((at[:, 1] < 4.0) & (at[:, 1] > 3.5))
    assert np.all((at[:, 2] > 1.0) & (at[:, 2] < 1.3))
    none = view_of(states)
    assert none is not None
    assert none.gauges.shape == (4, 0, 3, 3)
