"""The path of a press: its increments, their order, and how they are halved."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.friction import Coulomb, TwoCoefficients
from finger3d.contact.solve import RULES
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import FREE_FACES
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import (
    FEW_CUTS,
    all_steps,
    automatic,
    errors_of_runs,
    increment_error,
    march_automatic,
    refine,
    step_error,
)
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.objects import Cylinder, Plane
from tests.logs import Log
from tests.models import block, fig9, last, run
from validation import _increment_errors


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
    (cut,) = march(problem, report=(log := Log()))
    depths = [re.findall(r"depth of (\S+) mm: halved", line) for line in log.lines]
    assert depths == [["0.3"], ["0.1875"], ["0.3"]]  # contact begins in a quarter of the increment
    timid.gap = problem.gap(targets(problem.model.legs)[0].__class__(0.0))
    with pytest.raises(Finger3dError, match="did not converge"):
        all_steps(problem, cuts=FEW_CUTS)  # as for an estimate: two halvings are needed
    monkeypatch.undo()
    four = list(march(replace(problem, model=replace(problem.model, legs=(Leg(0.3, steps=4),)))))
    assert cut.method == "cut back"
    assert cut.outcome.ok
    np.testing.assert_allclose(cut.state.force, four[-1].state.force, atol=1e-14)
    assert cut.dissipation_mJ == pytest.approx(four[-1].dissipation_mJ, rel=1e-12)


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


NAMES = ("normal_force_N", "friction_sum_N", "dissipation_mJ")
COUNTS = (10, 20, 40, 80)
QUICK = ("section on a bar", "solid on a plane")
SLOW = ("at large deformation",)


def numbers(problem: Problem, count: int) -> np.ndarray:
    legs = tuple(replace(leg, steps=count) for leg in problem.model.legs)
    end = list(march(replace(problem, model=replace(problem.model, legs=legs))))[-1]
    assert end.outcome.ok
    measured = measure(problem.points, end)
    return np.array([measured[name] for name in NAMES])


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_errors_fall_at_second_order(name: str) -> None:
    # points touch one by one, so that single ratios scatter widely about 4: the median is taken, and the whole fall
    press = next(press for press in _increment_errors.presses(quick=False) if press.name == name)
    problem = build(replace(press.model, friction=Coulomb(press.mu)))
    exact = numbers(problem, 160 if press.model.finite_strain else 320)
    errors = np.abs([numbers(problem, count) / exact - 1.0 for count in COUNTS])
    assert np.median(errors[:-1] / errors[1:]) >= 3.3
    assert (errors[-1] <= errors[0] / 10.0).all()
    assert errors[1, 0] <= 1e-3
    assert errors[1, 1] <= 1e-2


def test_a_touch_so_light_that_gaps_are_at_the_round_off_of_coordinates_converges() -> None:
    # the first part of the increment is 7e-7 mm deep on a block 200 mm high, whose coordinates are exact to 3e-14 mm
    block = designs()["block"](half_length_mm=200.0, height_mm=200.0, width_mm=1.0)
    bar = Cylinder(radius_mm=1000.0)
    model = Model(
        block, Isotropic(1.0, 0.3), MeshOptions(0.05, 25.0, "swept"), (Leg(1.1e-5, steps=1),), object=bar,
        friction=Coulomb(0.25), domain="plane-strain",
    )  # fmt: skip
    (end,) = march(build(model, margin=-0.5))
    assert end.outcome.ok


def test_automatic_increments_end_within_their_estimate() -> None:
    problem = build(fig9(domain="plane-strain", object=Cylinder(radius_mm=80.0), legs=(Leg(10.0, steps="auto"),)))
    seen: list[tuple[int, int]] = []
    *_, (frames, estimate) = refine(problem, advanced=lambda done, total, step: seen.append((done, total)))
    assert seen[:6] == [*((k, 5) for k in range(1, 6)), (1, 10)]
    assert seen[-1] == (len(frames), len(frames))
    assert estimate is not None
    assert estimate.met
    assert max(estimate.normal_force, estimate.friction_sum, estimate.gauges) <= 0.01
    assert estimate.dissipation <= 0.05
    assert [count for count, _ in estimate.runs] == [5 * 2**k for k in range(len(estimate.runs))]
    assert len(estimate.runs) >= 3
    fine = list(march(replace(problem, model=replace(problem.model, legs=(Leg(10.0, steps=4 * len(frames)),)))))
    a, b = measure(problem.points, frames[-1]), measure(problem.points, fine[-1])
    assert a["normal_force_N"] == pytest.approx(b["normal_force_N"], rel=0.01)
    assert a["friction_sum_N"] == pytest.approx(b["friction_sum_N"], rel=0.01)
    assert a["dissipation_mJ"] == pytest.approx(b["dissipation_mJ"], rel=0.05)
    assert a["gauges"]["g36"] == pytest.approx(b["gauges"]["g36"], rel=0.01)


def stuck(**changes: object) -> Model:
    """The Fig. 9 section in plane stress under a bar, at a large coefficient of friction: nearly all of it sticks."""
    model = fig9(
        domain="plane-stress", material=Isotropic(1.0, 0.485), friction=Coulomb(0.988), mesh=MeshOptions(2.9, 11.6),
        object=Cylinder(radius_mm=80.0),
    )  # fmt: skip
    return replace(model, **changes)


def test_errors_of_a_press_that_sticks_are_within_twice_their_estimate() -> None:
    model = stuck()
    problem = build(model)
    told = {}
    for steps in (5, 10, 20, 40, 320):
        trial = replace(problem, model=replace(model, legs=(Leg(10.0, steps=steps),)))
        told[steps] = press_numbers(trial, list(march(trial))[-1])
        if steps < 320:
            bars = step_error(trial, told[steps], press_numbers, 2.0)
            told[steps] |= {f"bar {name}": bar for name, bar in bars.items()}
    for steps in (5, 10, 20, 40):
        for name in ("normal_force_N", "friction_sum_N", "gauge_g36", "external_work_mJ", "dissipation_mJ"):
            assert abs(told[steps][name] - told[320][name]) <= 2.0 * told[steps][f"bar {name}"], (steps, name)


@pytest.mark.parametrize("name", ["rule", "branch"])
def test_rules_that_have_no_limit_in_increments_take_ten(name: str) -> None:
    model = block(legs=(Leg(0.3, steps="auto"),), object=Plane(), friction=Coulomb(0.05))
    literal = {"rule": {"rule": "paper"}, "branch": {"friction": TwoCoefficients(0.1, 0.7, "paper")}}[name]
    assert automatic(model)
    frames, estimate = march_automatic(build(replace(model, **literal)))
    assert estimate is None
    assert len(frames) == 10


def test_a_failure_before_the_automatic_legs_is_not_repeated() -> None:
    legs = (Leg(0.2, steps=2, force_N=1e6), Leg(0.1))
    solved = list[StepResult]()
    ((results, estimate),) = refine(
        build(block(legs=legs, domain="plane-strain")), advanced=lambda done, total, step: solved.append(step)
    )
    assert [step.outcome for step in solved] == [step.outcome for step in results] == [Outcome.FORCE_NOT_REACHED]
    assert estimate is None


@pytest.mark.parametrize("ratio", [0.25, 0.5, 2.0])
def test_the_error_is_exact_at_first_order(ratio: float) -> None:
    value, other = (3.0 + 1.0 / n for n in (20.0, 20.0 * ratio))
    assert increment_error(value, other, ratio) == pytest.approx(1.0 / 20.0, rel=1e-9)


def test_two_runs_that_agree_by_chance_do_not_hide_the_error_of_those_before() -> None:
    runs = [(10, {"x": 1.4, "y": 1.0}), (20, {"x": 1.0, "y": 1.3}), (40, {"x": 1.0, "y": 1.0})]
    assert errors_of_runs(runs) == pytest.approx({"x": 0.4 * 0.5**1.5, "y": 0.3})
    assert errors_of_runs(runs[1:]) == pytest.approx({"x": 0.0, "y": 0.3})
