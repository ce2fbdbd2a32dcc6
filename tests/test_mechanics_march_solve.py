"""The paper's finger, pressed: reference values (validation/REFERENCES.md, 2.6) and properties that hold exactly."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.contact.rules import RULES
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import FREE_FACES
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import Press, march
from finger3d.mechanics.march.step_halving import FEW_CUTS, last_step
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.path import Station, stations, targets
from finger3d.mechanics.results.history import measure
from finger3d.objects import Move, ObjectPose, Plane
from tests.models import block, fig9, last, run


# validation/REFERENCES.md, 2.6, the paper's half cylinder; P within 1 %, lengths within .013 plus half a contact point
@pytest.mark.parametrize(
    ("depth", "force", "a", "c"),
    [(0.2, 0.12668, 0.862, 0.639), (0.5, 0.40495, 1.508, 1.376), (1.0, 1.01932, 2.297, 2.230)],
)
def test_half_cylinder_in_plane_stress(depth: float, force: float, a: float, c: float) -> None:
    size = 0.04
    finger = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    model = Model(
        finger, Isotropic(1.0, 0.3), MeshOptions(size, 0.5), (Leg(depth, steps=100),), friction=Coulomb(0.25),
        domain="plane-stress",
    )  # fmt: skip
    got = last(model)
    assert got["normal_force_N"] == pytest.approx(force, rel=0.01)
    assert got["contact_half_length_mm"] == pytest.approx(a, abs=0.013 + size)
    assert got["stick_half_length_mm"] == pytest.approx(c, abs=0.013 + size)
    assert abs(got["tangential_force_x_N"]) < 1e-12


def test_fig9_in_plane_strain_gives_26_4_newton_per_millimetre() -> None:
    got = last(fig9(domain="plane-strain", mesh=MeshOptions(1.0, 4.0)))
    assert got["normal_force_N"] / 20.0 == pytest.approx(26.4, rel=0.005)
    assert 74.0 <= 2.0 * got["contact_half_length_mm"] <= 78.0  # at rest


def test_fig9_as_a_solid_and_with_held_ends() -> None:
    free = last(fig9())
    assert free["normal_force_N"] == pytest.approx(305.0, rel=0.01)
    assert abs(free["outward_friction_z_N"]) > 2.0 * abs(free["outward_friction_x_N"])  # mostly along the width
    held = last(fig9(held_ends=True))
    section = last(fig9(domain="plane-strain", mesh=MeshOptions(1.0, 4.0)))
    assert held["normal_force_N"] == pytest.approx(section["normal_force_N"], rel=0.005)


@pytest.mark.slow
def test_swept_and_pytetwild_meshes_agree_within_one_percent() -> None:
    swept, tetwild = last(fig9()), last(fig9(mesh=MeshOptions(2.0, 8.0, "ftetwild")))
    assert tetwild["normal_force_N"] == pytest.approx(swept["normal_force_N"], rel=0.01)
    assert tetwild["normal_force_N"] == pytest.approx(305.0, rel=0.01)


def test_contact_forces_and_base_reaction_balance() -> None:
    problem, frames = run(
        block(symmetry=(), legs=(Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.1, slide_z_mm=0.05, steps=2)))
    )
    unknowns = problem.unknowns(frames[-1].meshed_state.contact.force)
    full = problem.body.stiffness.upper + sp.triu(problem.body.stiffness.upper, 1).T
    residual = (full @ unknowns)[: problem.mesh.points.size].reshape(problem.mesh.points.shape)
    base = np.unique(problem.mesh.facets["base"])
    contact = problem.points.to_global(frames[-1].state.force).sum(axis=0)
    scale = np.abs(frames[-1].state.force).sum()
    assert np.abs(residual[base].sum(axis=0) + contact).max() < 1e-10 * scale
    assert np.abs(residual.sum(axis=0)).max() < 1e-10 * scale  # K moves no rigid body, so inner forces cancel


def test_flat_block_under_a_flat_plate_has_uniform_pressure() -> None:
    # nu = 0: the clamped base does not disturb the bar, so p = E d / h everywhere
    problem, frames = run(block(material=Isotropic(2.0, 0.0), object=Plane(), friction=Coulomb(0.0)))
    pressure = frames[-1].state.force[:, 0] / problem.points.area
    assert (frames[-1].state.status != OPEN).all()
    assert np.abs(pressure - 2.0 * 0.3 / 3.0).max() < 1e-10


def test_press_slide_release_returns_to_rest() -> None:
    legs = (Leg(0.3, steps=3), Leg(0.3, slide_x_mm=0.5, steps=5), Leg(0.0, slide_x_mm=0.5, steps=3), Leg(0.3, steps=3))
    problem, frames = run(block(legs=legs))
    assert problem.axes == ("z",)
    slid, released = measure(problem.points, frames[7]), measure(problem.points, frames[10])
    pressed = frames[7].state.force[:, 0].sum()  # along the normals of the ball
    assert pressed > slid["normal_force_N"]
    assert slid["friction_sum_N"] == pytest.approx(0.25 * pressed, rel=1e-9)  # all slips
    assert released["normal_force_N"] == 0.0
    lost = [f.dissipation_mJ for f in frames]
    assert all(b >= a for a, b in zip(lost, lost[1:], strict=False))


def test_tilted_plane_pushes_along_its_own_normal() -> None:
    tilt = np.deg2rad(5.0)
    body = block(object=Plane(tilt=tilt), friction=Coulomb(0.0), legs=(Leg(0.5, steps=2),))
    problem, frames = run(body)
    world = problem.points.with_basis_of(frames[-1].state).to_global(frames[-1].state.force).sum(axis=0)
    assert world[0] / -world[1] == pytest.approx(np.tan(tilt), rel=1e-12)
    assert world[1] < 0


def test_an_increment_that_fails_is_cut_and_the_state_restored(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build(block(object=Plane(), legs=(Leg(0.3, steps=1),)))
    true_rule = RULES["projection"]

    def timid(contact, guess=None):  # fails on strides above a quarter of the leg
        found = true_rule(contact, guess)
        if np.abs(contact.free_motion[:, 0] - timid.gap).max() > 0.076:
            return replace(found, state=contact.previous, outcome=Outcome.NO_CONVERGENCE)
        timid.gap = contact.free_motion[:, 0]
        return found

    timid.gap = problem.gap(targets(problem.model.legs)[0].__class__(0.0))
    monkeypatch.setitem(RULES, "projection", timid)
    (cut,) = march(problem)
    timid.gap = problem.gap(targets(problem.model.legs)[0].__class__(0.0))
    with pytest.raises(Finger3dError, match="did not converge"):
        last_step(problem, cuts=FEW_CUTS)  # as for an estimate: two halvings are needed
    monkeypatch.undo()
    four = list(march(replace(problem, model=replace(problem.model, legs=(Leg(0.3, steps=4),)))))
    assert cut.method == "cut back"
    assert cut.outcome.ok
    np.testing.assert_allclose(cut.state.force, four[-1].state.force, atol=1e-14)
    assert cut.dissipation_mJ == pytest.approx(four[-1].dissipation_mJ, rel=1e-12)


def test_an_increment_from_whose_end_the_path_does_not_go_on_is_repeated_in_halves() -> None:
    """The energies are those of the halves, as on the path with one more station."""
    problem = build(block(object=Plane(), legs=(Leg(0.6, steps=2),)))
    press, dead_ends = Press(problem), list[ContactState]()
    true_increment = press.formulation.increment

    class WithDeadEnds:
        def __getattr__(self, name: str) -> Any:
            return getattr(formulation_of(problem.model), name)

        def increment(self, problem: Any, state: Any, move: Move, *rest: Any) -> Any:
            if any(state.contact is end for end in dead_ends):
                return ContactSolution(state, Outcome.NEWTON, np.inf, 1, "none")
            found = true_increment(problem, state, move, *rest)
            if not state.contact.force.any() and move.end.depth_mm > 0.2:
                dead_ends.append(found.state.contact)
            return found

    press.formulation = WithDeadEnds()
    first, second = (press.advance(station) for station in stations(problem.model.legs))
    assert first.outcome.ok
    assert second.outcome.ok
    other = Press(problem)
    for depth in (0.15, 0.3, 0.6):
        last = other.advance(Station(ObjectPose(depth)))
    np.testing.assert_allclose(second.state.force, last.state.force, rtol=1e-9, atol=1e-12)
    assert second.external_work_mJ == pytest.approx(last.external_work_mJ, rel=1e-9)
    assert second.dissipation_mJ == pytest.approx(last.dissipation_mJ, rel=1e-9)


def test_the_papers_rule_goes_on_from_a_state_in_which_friction_helps_slip() -> None:
    legs = (Leg(10.0, steps=1), Leg(10.0, slide_x_mm=0.5, steps=1))
    mesh, rule = MeshOptions(4.0, 6.0), "paper"
    model = fig9(domain="plane-strain", mesh=mesh, friction=Coulomb(1e-6), legs=legs, rule=rule)
    pressed, slid = march(build(replace(model, material=Isotropic(1.0, 0.3))))
    assert pressed.outcome is Outcome.WRONG_WAY
    assert pressed.state.force[:, 0].sum() > 1.0
    assert slid.outcome is Outcome.CONVERGED  # with all points slipping the same way
    assert slid.state.force[:, 0].sum() == pytest.approx(pressed.state.force[:, 0].sum(), rel=1e-6)


def test_held_ends_are_no_contact_points_at_large_deformation() -> None:
    """Their points cannot move along z, and would have no compliance in that direction."""
    problem = build(LargeDeformation().apply(fig9(held_ends=True)), margin=math.inf)
    assert FREE_FACES.index("ends") not in problem.surface.face
    assert np.diagonal(problem.delassus.reshape(problem.surface.points.size, -1)).min() > 0.0
