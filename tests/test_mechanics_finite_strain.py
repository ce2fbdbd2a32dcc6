"""Presses at finite strain: equations, increments, failures."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import trimesh

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.effects.large_deformation import Effect
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.hyperelastic import Hyperelastic
from finger3d.fem.laws import NeoHooke, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import most_distorted
from finger3d.fem.recovery import displacement
from finger3d.geometry.design import designs
from finger3d.geometry.surface import Triangles
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.body import DeformedBody, FiniteBody
from finger3d.mechanics.finite_strain.formulation import FiniteStrain
from finger3d.mechanics.finite_strain.increment import FiniteIncrement, cause_of_failure, fold_warnings, snap_warnings
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.history import State, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.objects import Cylinder, MeshObject, Move, ObjectPose, Plane, Sphere, Wedge
from tests.models import block, ended, half_cylinder, large_fig9, run


def test_light_load_is_small_strain() -> None:
    ratios = []
    for depth in (0.08, 0.01):
        model = large_fig9(0.49, legs=(Leg(depth, steps=8),), mesh=MeshOptions(0.2, 8.0))
        problem = build(model)
        small = list(march(replace(problem, model=replace(model, hyperelastic_law=None))))
        large = list(march(problem))
        a, b = (measure(problem.points, f[-1]) for f in (small, large))
        ratios.append(abs(b["normal_force_N"] / a["normal_force_N"] - 1.0))
    assert ratios[0] < 0.01
    assert ratios[1] < 0.6 * ratios[0]  # the strain goes with the root of the depth: 0.35


def test_quarter_and_whole_agree_in_3d_and_curved_objects_are_followed() -> None:
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(1.0, 1.5, "swept"), (Leg(0.6, steps=3),),
        object=Cylinder(radius_mm=3.0), friction=Coulomb(0.3),
    )  # fmt: skip
    ends = []
    for axes in (("x", "z"), ()):
        problem, end = ended(Effect().apply(replace(model, symmetry=axes)))
        ends.append(measure(problem.points, end))
        at = problem.points.points + 0.0
        u = np.zeros_like(at)
        touching = end.state.status != OPEN
        assert end.state.bases is not None
        # where it touches the flank, the force leans outward with the cylinder's normal
        world = problem.points.with_basis_of(end.state).to_global(end.state.force * [1.0, 0.0, 0.0])[touching]
        lean = world[:, 0] * np.sign(at[touching, 0])
        assert lean[np.abs(at[touching, 0]) > 0.4].min() > 0.0
        assert u.shape == at.shape
    for key in ("normal_force_N", "friction_sum_N", "dissipation_mJ", "external_work_mJ"):
        assert ends[0][key] == pytest.approx(ends[1][key], rel=1e-6)


COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_the_tangent_of_solid_and_foils_is_the_derivative_of_their_forces(nu: float) -> None:
    gauge = Gauge("g", 0.5, 1.5, 0.0, 0.3, 1.0)
    model = Foil(300.0, 0.02, 1.0).apply(block(mesh=COARSE, gauges=(gauge,)))
    problem = build(model)
    body = FiniteBody.of(problem, Hyperelastic.of(NeoHooke(0.4), nu, False))
    rng = np.random.default_rng(0)
    size = problem.mesh.points.size + (len(body.solid.pattern.vertices) if nu == 0.5 else 0)
    x, step, h = 0.01 * rng.normal(size=size), rng.normal(size=size), 1e-6
    difference = (body.internal_forces(x + h * step) - body.internal_forces(x - h * step)) / (2.0 * h)
    upper = body.tangent(x).upper
    whole = upper + sp.triu(upper, 1).T
    assert np.abs(whole @ step - difference).max() < 1e-6 * np.abs(difference).max()
    assert body.bars is not None
    assert np.abs(body.internal_forces(np.zeros(size))).max() < 1e-12


def test_an_unstable_law_names_the_stretches_that_are_reached_in_every_material() -> None:
    """The shear modulus scales all stresses of a law, so that the strains at which it is unstable are the same."""
    problem, law = build(block(mesh=COARSE)), Yeoh(0.4, -0.5, 0.0)
    alone = FiniteBody.of(problem, Hyperelastic.of(law, 0.3, False))
    part = np.arange(alone.points) % 2
    both = FiniteBody.of(problem, Hyperelastic.of_parts(law, (Isotropic(1.0, 0.3), Isotropic(5.0, 0.3)), part))
    stable = FiniteBody.of(problem, Hyperelastic.of(NeoHooke(0.4), 0.3, False))
    stretched = (problem.mesh.points * np.array([0.8, -0.5, 0.0])).ravel()
    assert "1.8" in alone.instability(stretched)
    assert both.instability(stretched) == alone.instability(stretched)
    assert (
        alone.instability(0.0 * stretched) == both.instability(0.0 * stretched) == stable.instability(stretched) == ""
    )


def solved_increment(model: Model) -> tuple[FiniteIncrement, State[DeformedBody]]:
    problem = build(LargeDeformation().apply(model))
    formulation = formulation_of(problem.model)
    assert isinstance(formulation, FiniteStrain)
    rest, pose = formulation.start(problem), targets(problem.model.legs)[0]
    increment = formulation.equations(problem, rest, Move(problem.origin, pose), formulation.workspace())
    state = increment.solve(None).state
    return increment, state


@pytest.fixture(scope="module")
def solved() -> tuple[FiniteIncrement, State[DeformedBody]]:
    return solved_increment(half_cylinder(1.0))


def test_a_solution_is_in_balance_and_a_displaced_one_is_not(
    solved: tuple[FiniteIncrement, State[DeformedBody]],
) -> None:
    increment, state = solved
    force = np.abs(state.contact.force).max()
    free = np.setdiff1d(np.arange(len(state.body.unknowns)), increment.problem.body.fixed_dofs)
    at_rest, displaced = (
        np.abs(increment.out_of_balance(increment.at(share * state.body.unknowns), state.contact.force)[free]).max()
        for share in (1.0, 1.001)
    )
    assert at_rest < 1e-7 * force
    assert displaced > 1e-4 * force


def test_a_cell_folded_at_a_bonded_rim_is_a_warning_and_not_the_end() -> None:
    """The strain at the bonded corner of the base grows without limit as the free surface folds over it.

    The same press on edges twice as long, whose cells fold later, and the stress at every node bound what it does to
    the results.
    """
    design = designs()["half_cylinder"](radius_mm=10.0, width_mm=10.0)
    forces = []
    for edge in (0.65, 1.3):
        mesh, leg = MeshOptions(edge, 2.0 * edge, "swept"), Leg(3.5, steps=5)
        model = Model(design, Isotropic(1.0, 0.49), mesh, (leg,), friction=Coulomb(2.0), domain="plane-strain")
        problem, frames = run(Effect().apply(model))
        forces.append(measure(problem.points, frames[-1])["normal_force_N"])
        if edge == 1.3:
            assert fold_warnings(problem, frames) == []
            continue
        (line,) = fold_warnings(problem, frames)
        assert line.endswith("avoid it")
        assert "most in increment 5" in line
        x, y = (float(part) for part in re.findall(r"[xy] = ([-\d.]+)", line)[:2])
        assert abs(x) > 9.0
        assert y < 1.0
        assert fold_warnings(problem, frames[:3]) == []
        state = frames[-1].meshed_state
        unknowns = next(formulation_of(problem.model).unknowns(problem, [state]))
        cell, ratio = most_distorted(problem.mesh, displacement(problem.mesh, unknowns))
        assert ratio < 0.0
        assert "folded over" in cause_of_failure(problem, displacement(problem.mesh, unknowns))
        _, strain, stress = formulation_of(problem.model).fields(problem, state)
        quadrature_points = FiniteStrain(NeoHooke(1.0)).body(problem).solid.slopes(unknowns)
        assert np.linalg.det(quadrature_points + np.eye(2)).min() > 0.0
        corners = problem.mesh.cells[cell]
        assert np.isfinite(stress[corners]).all()
        assert np.linalg.eigvalsh(2.0 * strain + np.eye(3)).min() > 0.0
    assert forces[0] == pytest.approx(forces[1], rel=0.02)


@pytest.mark.slow
def test_a_body_whose_equilibrium_ends_snaps_to_another_one_and_says_so() -> None:
    """The corners of a block fold under friction; at its end the force falls, and the base carries what is left."""
    design = designs()["block"](half_length_mm=8.76, height_mm=10.0, width_mm=10.36)
    mesh, leg = MeshOptions(1.2, 1.79, "swept"), Leg(3.8, steps=20)
    model = Model(design, Isotropic(1.0, 0.5), mesh, (leg,), friction=Coulomb(1.0), domain="plane-strain")
    problem = build(Effect().apply(model))
    frames = list(march(problem))
    assert [frame.outcome.ok for frame in frames] == [True] * 20
    force = [measure(problem.points, frame)["normal_force_N"] for frame in frames]
    (line,) = snap_warnings(frames)
    number = int(re.findall(r"in increment (\d+)", line)[0])
    assert min(np.diff(force[number - 2 :])) < 0.0
    assert min(np.diff(force[: number - 1])) > 0.0
    assert snap_warnings(frames[: number - 1]) == []
    state = frames[-1].meshed_state
    internal = FiniteStrain(NeoHooke(1.0)).body(problem).internal_forces(state.body.unknowns)
    base = internal[problem.body.fixed_dofs]
    down = base[problem.body.fixed_dofs % 2 == 1].sum() * 2 ** len(problem.axes)
    assert down == pytest.approx(force[-1], rel=1e-7)


def test_the_path_is_followed_where_an_increment_does_not_converge_from_afar() -> None:
    """A section is pressed 14 mm at once."""
    problem, frames = run(large_fig9(0.45, 4.0, legs=(Leg(14.0, steps=4),)))
    formulation, move = formulation_of(problem.model), Move(problem.origin, frames[-1].target)
    assert isinstance(formulation, FiniteStrain)
    rest, workspace = formulation.start(problem), formulation.workspace()
    assert formulation.increment(problem, rest, move, None, workspace).outcome.ok
    # a force is reached at a single go, too; it slips in other increments than the press in four
    wanted = measure(problem.points, frames[-1])["normal_force_N"]
    force = GeneralisedForces((0,), np.array([wanted]), wanted)
    found = formulation.increment(problem, rest, move, None, formulation.workspace(), force)
    there, _ = found.state.last
    assert there.start == move.start
    assert there.end.depth_mm == pytest.approx(14.0, rel=0.01)  # 4e-3
    assert -problem.world_force(found.state.contact)[:, 1].sum() == pytest.approx(wanted, rel=1e-8)


def test_there_is_no_increment_to_a_force_out_of_reach() -> None:
    problem = build(large_fig9(0.45, 4.0))
    formulation, move = formulation_of(problem.model), Move(ObjectPose(0.0), ObjectPose(1.0))
    start, wanted = formulation.start(problem), GeneralisedForces((0,), np.array([1e5]), 1e5)
    assert not formulation.increment(problem, start, move, None, formulation.workspace(), wanted).outcome.ok


def test_a_faceted_object_without_friction_takes_few_factorisations() -> None:
    """With a curvature that is smooth across its edges alone, Newton's method converges by .9 an iteration or not."""
    design = designs()["clipped_cylinder"](radius_mm=7.3, half_length_mm=5.9, edge_height_mm=3.6, width_mm=4.0)
    rod = trimesh.creation.cylinder(radius=6.8, height=8.0, sections=96)
    faceted = MeshObject(x_mm=0.36, surface=Triangles(np.array(rod.vertices), np.array(rod.faces)))
    model = Model(
        design, Isotropic(0.5, 0.45), MeshOptions(0.8, 1.0, "swept"), (Leg(1.6, steps=8),), object=faceted,
        friction=Coulomb(0.0), domain="plane-strain",
    )  # fmt: skip
    problem, workspace = build(Effect().apply(model)), formulation_of(Effect().apply(model)).workspace()
    assert all(step.outcome.ok for step in march(problem, workspace=workspace))
    assert workspace.factorizations <= 3 * 8  # 14 today, 122 with the smooth curvature alone


def test_without_contact_round_off_is_no_residual() -> None:
    """An incompressible block is pressed by 4e-3 of an edge of its mesh, and the object taken away."""
    small, edge = 0.003, block().mesh.size_mm
    assert small < 0.01 * edge
    legs = (Leg(small, steps=2), Leg(-small, steps=3))
    model = Effect().apply(block(object=Plane(), material=Isotropic(1.0, 0.5), domain="plane-strain", legs=legs))
    problem, workspace = build(model), formulation_of(model).workspace()
    frames = list(march(problem, workspace=workspace))
    assert all(step.outcome.ok for step in frames)
    assert not frames[-1].state.force.any()
    assert workspace.factorizations <= 3  # 1 today; hundreds, and no end, if round-off has to fall


def test_the_normal_force_is_the_reaction_of_the_base_under_an_object_sharper_than_the_mesh() -> None:
    sharp = Sphere(radius_mm=1.5)  # edges of the mesh have 0.8 mm
    problem, frames = run(Effect().apply(block(object=sharp, legs=(Leg(0.6, steps=2),))))
    assert all(step.outcome.ok for step in frames)
    state, formulation = frames[-1].meshed_state, formulation_of(problem.model)
    assert isinstance(formulation, FiniteStrain)
    internal = formulation.body(problem).internal_forces(state.body.unknowns)
    base = problem.body.fixed_dofs[problem.body.fixed_dofs % 3 == 1]
    down = internal[base].sum() * 2 ** len(problem.axes)
    force = measure(problem.points, frames[-1])["normal_force_N"]
    assert down == pytest.approx(force, rel=1e-7)  # residuals of 5e-9


BLOCK = designs()["block"](half_length_mm=7.0, height_mm=10.0, width_mm=10.0)
MODEL = Model(
    BLOCK, Isotropic(1.0, 0.4), MeshOptions(1.0, 2.0, "swept"), (Leg(1.0, steps=2),), object=Plane(),
    domain="plane-strain",
)  # fmt: skip


def test_a_tip_that_the_points_do_not_resolve_is_the_cause() -> None:
    problem = build(replace(MODEL, object=Wedge(angle=0.4, tip_radius_mm=1.2)))
    said = cause_of_failure(problem, np.zeros(problem.mesh.points.shape))
    assert said.startswith("object.tip_radius_mm = 1.2: ")
    assert "mesh.size_mm = 0.6 " in said


def test_a_cell_that_folds_at_a_sharp_edge_of_the_finger_is_named() -> None:
    problem = build(MODEL)
    points = problem.mesh.points
    assert not cause_of_failure(problem, np.zeros(points.shape))
    near = np.exp(-((points - [7.0, 10.0]) ** 2).sum(axis=1))[:, None]
    said = cause_of_failure(problem, -0.6 * near * (points - [7.0, 10.0]) * [0.0, 1.0])
    assert re.search(r" 0\.\d+ of its volume", said)
    assert re.search(r"fillet of [\d.]+ mm", said)
    middle = np.exp(-((points - [0.0, 5.0]) ** 2).sum(axis=1))[:, None]
    said = cause_of_failure(problem, -0.6 * middle * (points - [0.0, 5.0]) * [0.0, 1.0])
    assert re.search(r" 0\.\d+ of its volume", said)
    assert "fillet" not in said


def test_the_papers_rule_is_named_where_it_may_have_no_answer() -> None:
    problem = build(replace(MODEL, rule="paper"))
    assert "rule = 'projection'" in cause_of_failure(problem, np.zeros(problem.mesh.points.shape))
