"""Condensed bodies: candidate points, symmetry and solvers."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.results.history import measure
from tests.logs import Log
from tests.models import block, fig9, last, run


@pytest.mark.parametrize("domain", ["solid", "plane-strain"])
def test_points_that_touch_come_first(domain: str) -> None:
    """The object sinks into the points in nearly the order of their distance: products end with the last that bears."""
    problem, frames = run(fig9(domain=domain))
    for frame in frames:
        touching = np.flatnonzero(frame.meshed_state.contact.force[:, 0])
        assert touching[-1] < 1.1 * len(touching) + 1
    assert len(touching) < 0.9 * len(problem.surface.nodes)


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_quarter_and_whole_model_agree_on_a_mirrored_mesh(nu: float) -> None:
    quarter, whole = (block(material=Isotropic(1.0, nu), symmetry=axes) for axes in (("x", "z"), ()))
    (p, f), (q, g) = run(quarter), run(whole)
    a, b = measure(p.points, f[-1]), measure(q.points, g[-1])
    assert (p.axes, q.axes) == (("x", "z"), ())
    for key in ("normal_force_N", "friction_sum_N", "contact_area_mm2", "dissipation_mJ", "external_work_mJ"):
        # the dissipation of few points that slip is known as well as the work, of which it is a small share
        assert a[key] == pytest.approx(b[key], rel=1e-8, abs=1e-9 * b["external_work_mJ"])
    assert abs(b["tangential_force_x_N"]) < 1e-10 * b["normal_force_N"]
    order_a, order_b = (np.lexsort(np.round(r.points.points, 9).T) for r in (p, q))
    assert np.abs(f[-1].state.force[order_a] - g[-1].state.force[order_b]).max() < 1e-9


def test_solvers_behind_the_same_interface_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    a = last(block())
    monkeypatch.setenv("FINGER3D_SOLVER", "superlu")
    b = last(block())
    assert b["normal_force_N"] == pytest.approx(a["normal_force_N"], rel=1e-11)


def test_a_long_press_is_announced_before_it_is_condensed(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(domain="plane-strain")
    said = {}
    for seconds in (0.0, 1e3):
        monkeypatch.setattr("finger3d.mechanics.discretise.build._LONG_S", seconds)
        build(model, log := Log())
        said[seconds] = [line for line in log.lines if line.startswith("warning: mesh.size_mm = 2 takes about ")]
    assert len(said[0.0]) == 1
    assert not said[1e3]
