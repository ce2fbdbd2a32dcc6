"""Presses at small strain, elastic and viscoelastic."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.contact.friction import OPEN, Coulomb, TwoCoefficients
from finger3d.effects.viscosity import Effect
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import InternalVariables, Step
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import Press, march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.small_strain import carried_by_object
from finger3d.mechanics.viscoelastic import (
    ConstantBulkModulus,
    ConstantPoissonRatio,
    RelaxationWorkspace,
)
from finger3d.objects import Cylinder, Move, ObjectPose, Plane
from tests.models import block, marched, run
from tests.scenes import HALF_CYLINDER, changed, written
from tests.viscous_cases import RAMP, RAMP_AND_HOLD, TWO, UP_AND_DOWN, mean_relaxation, viscous
from tests.viscous_cases import block as viscous_block

COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("domain", ["solid", "plane-strain", "plane-stress"])
def test_fields_of_uniaxial_compression_are_uniform(domain: str) -> None:
    """With nu = 0 a flat press without friction is uniaxial: strain depth over height, stress E times that."""
    flat = {"object": Plane(), "material": Isotropic(2.0, 0.0), "friction": Coulomb(0.0), "domain": domain}
    problem, frames = run(block(mesh=COARSE, legs=(Leg(0.3, steps=1),), **flat))
    u, strain, stress = formulation_of(problem.model).fields(problem, frames[-1].meshed_state)
    assert u[:, 1] == pytest.approx(-0.1 * problem.mesh.points[:, 1], abs=1e-9)
    uniform = np.zeros((3, 3))
    uniform[1, 1] = -0.1
    assert np.allclose(strain, uniform, atol=1e-8)
    assert np.allclose(stress, 2.0 * uniform, atol=1e-8)
    assert np.abs(frames[-1].state.force[:, 0] / problem.points.area - 2.0 * 0.1).max() < 1e-10


def test_the_object_carries_points_by_its_slide_and_its_turn() -> None:
    problem = build(block(mesh=MeshOptions(2.0, 2.0, "swept")))
    at = np.zeros_like(problem.surface.points)
    slid = carried_by_object(problem, Move(ObjectPose(0.1), ObjectPose(0.3, 0.5, -0.25)), at)
    assert np.allclose(slid, [0.5, -0.2, -0.25])
    angle = 0.2
    turned = carried_by_object(problem, Move(ObjectPose(0.1), ObjectPose(0.1, turn_y=angle)), at)
    # the mean over each hat of the turn that brought the object's material there, about the vertical in the middle
    x, z = problem.surface.samples[:, 0], problem.surface.samples[:, 2]
    c, s = 1.0 - np.cos(angle), np.sin(angle)
    mean = problem.surface.average @ np.stack([c * x + s * z, 0.0 * x, c * z - s * x], axis=1)
    assert turned == pytest.approx(mean, abs=1e-12)


def test_in_an_incompressible_body_both_kinds_are_one() -> None:
    # two ways to the same numbers: row forces over the compliance, and displacements over new factors
    increments_as_given = TwoCoefficients(0.25, 0.99, "keep")  # with bulk alone, the first would be cut into parts
    problem = build(viscous_block(material=Isotropic(1.0, 0.5), friction=increments_as_given))
    a, b = (marched(viscous(problem, TWO, bulk)) for bulk in (True, False))
    largest = max(np.abs(f.meshed_state.contact.force).max() for f in a)
    for f, g in zip(a, b, strict=True):
        assert np.abs(f.meshed_state.contact.force - g.meshed_state.contact.force).max() <= 1e-6 * largest
        assert f.gauges["g"] == pytest.approx(g.gauges["g"], rel=1e-6)
    stresses = [formulation_of(p.model).fields(p, f[9].meshed_state)[2] for p, f in
                ((viscous(problem), a), (viscous(problem, TWO, False), b))]  # fmt: skip
    assert np.abs(stresses[0] - stresses[1]).max() <= 1e-5 * np.abs(stresses[0]).max()


@pytest.mark.parametrize("nu", [0.3, 0.49])
@pytest.mark.parametrize("kind", [ConstantPoissonRatio, ConstantBulkModulus])
def test_the_compliance_of_a_step_is_the_difference_quotient_of_its_response(kind: type, nu: float) -> None:
    problem = build(viscous_block(domain="plane-strain", material=Isotropic(1.0, nu), legs=RAMP))
    body = kind(problem)
    rng = np.random.default_rng(0)
    rows = len(problem.body.condensed.compliance)
    memory = InternalVariables(np.zeros(body.size), np.zeros((2, body.size)))
    workspace = RelaxationWorkspace()
    for seconds in (0.3, 0.7):  # so that there is a past
        step = Step(TWO, seconds)
        response = body.respond(step, memory, workspace)
        force = rng.normal(size=rows)
        now = response.shape(force)
        assert body.read(now) == pytest.approx(response.moved + response.compliance @ force, rel=1e-9, abs=1e-12)
        change = rng.normal(size=rows)
        moved = body.read(response.shape(force + change)) - body.read(now)
        assert moved == pytest.approx(response.compliance @ change, rel=1e-7, abs=1e-9)
        memory = step.after(memory, now)


def dome(**changes: object) -> Model:
    """A half cylinder under a plane, whose normals do not turn as it yields."""
    body = designs()["half_cylinder"](radius_mm=4.0, width_mm=4.0)
    return viscous_block(design=body, mesh=MeshOptions(0.6, 1.5, "swept"), object=Plane(), gauges=(), **changes)


def forces(problem: Problem, frames: list[StepResult]) -> np.ndarray:
    return np.array([measure(problem.points, f)["normal_force_N"] for f in frames])


@pytest.mark.parametrize("mu", [0.0, 1e6], ids=["frictionless", "full stick"])
def test_a_growing_contact_is_the_convolution_of_the_elastic_one_to_round_off(
    mu: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the elastic press is not cut where contact begins, as the viscous one is not
    monkeypatch.setattr(Press, "moves_to", lambda press, pose: (Move(press.pose, pose),))
    # Lee and Radok 1960: while contact grows, f(t) = int r(t - s) df_e; linear within a step, as the integrator has it
    problem = build(dome(legs=RAMP_AND_HOLD, friction=Coulomb(mu)))
    elastic, slow = marched(problem), marched(viscous(problem))
    t = np.array([0.0] + [f.target.time_s for f in elastic])
    rates = np.diff(
        np.array(
            [np.zeros_like(elastic[0].meshed_state.contact.force)] + [f.meshed_state.contact.force for f in elastic]
        ),
        axis=0,
    )
    for n, frame in enumerate(slow, start=1):
        weight = mean_relaxation(TWO, t[n] - t[1 : n + 1], t[n] - t[:n])
        wanted = np.einsum("k,kcd->cd", weight, rates[:n])
        assert np.abs(frame.meshed_state.contact.force - wanted).max() <= 1e-12 * np.abs(wanted).max()


def test_the_error_of_the_step_falls_with_its_square() -> None:
    # points come into contact one by one, which makes single ratios scatter about 4: the mean of three is taken
    section = viscous_block(
        legs=RAMP, friction=Coulomb(0.0), domain="plane-strain", object=Cylinder(radius_mm=4.0, axis="z"),
        mesh=MeshOptions(0.1, 1.0, "swept"), gauges=(),
    )  # fmt: skip
    problem = build(section)
    counts = (5, 10, 20, 40, 80)
    ends = [forces(problem, marched(viscous(problem, legs=(replace(RAMP[0], steps=n),))))[-1] for n in counts]
    changes = np.diff(ends)
    assert (changes[0] / changes[-1]) ** (1.0 / 3.0) == pytest.approx(4.0, rel=0.3)


def test_a_hold_is_exact_in_one_step() -> None:
    problem = build(dome(legs=RAMP_AND_HOLD, friction=Coulomb(0.0)))
    many, one = marched(viscous(problem)), marched(viscous(problem, legs=(*RAMP, replace(RAMP_AND_HOLD[1], steps=1))))
    assert one[-1].meshed_state.contact.force == pytest.approx(many[-1].meshed_state.contact.force, abs=1e-12)


@pytest.mark.parametrize("bulk", [True, False])
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_quick_presses_are_instantaneous_and_slow_ones_relaxed(nu: float, bulk: bool) -> None:
    model = viscous_block(friction=Coulomb(0.0), material=Isotropic(1.0, nu))
    shear, volume = 0.5 / (1.0 + nu), 1.0 / (3.0 * (1.0 - 2.0 * nu))
    left = 1.0 - sum(g for g, _ in TWO)
    low = left * shear
    soft = Isotropic(left, nu)
    if not bulk:
        soft = Isotropic(
            9.0 * volume * low / (3.0 * volume + low), (3.0 * volume - 2.0 * low) / (6.0 * volume + 2.0 * low)
        )
    quick, slow = ((Leg(0.3, steps=2, duration_s=s),) for s in (1e-9, 1e9))
    problem = build(replace(model, legs=quick))
    for legs, material in ((quick, model.material), (slow, soft)):
        wanted = build(replace(model, legs=legs, material=material))
        # one form for all: mixed and displacement elements differ by their mesh error
        assert wanted.body.elastic.mixed == problem.body.elastic.mixed or not bulk
        got, elastic = marched(viscous(problem, TWO, bulk, legs=legs))[-1], marched(wanted)[-1]
        close = 1e-7 if wanted.body.elastic.mixed == problem.body.elastic.mixed else 0.01
        assert got.meshed_state.contact.force == pytest.approx(
            elastic.meshed_state.contact.force, abs=close * elastic.meshed_state.contact.force.max()
        )
        assert got.gauges["g"] == pytest.approx(elastic.gauges["g"], rel=close)


@pytest.mark.parametrize(("domain", "nu", "bulk"), [
    ("plane-strain", 0.3, False), ("plane-strain", 0.49, False), ("plane-strain", 0.3, True),
    ("plane-stress", 0.3, True), ("solid", 0.3, False), ("solid", 0.49, False),
])  # fmt: skip
def test_stress_carries_the_force(domain: str, nu: float, bulk: bool) -> None:
    # virtual work of y: int s_yy dV = - force * height under a flat plate without friction
    problem = build(viscous_block(material=Isotropic(1.0, nu), object=Plane(), friction=Coulomb(0.0), domain=domain,
                          legs=RAMP_AND_HOLD))  # fmt: skip
    held = viscous(problem, TWO, bulk)
    frame = marched(held)[-1]
    sigma = formulation_of(held.model).fields(held, frame.meshed_state)[2]
    assert sigma.shape[1:] == (3, 3)
    parts = 2 ** len(problem.axes)
    volume = _nodal_volume(problem) * problem.body.thickness * parts
    force = measure(problem.points, frame)["normal_force_N"]
    assert -float(volume @ sigma[:, 1, 1]) == pytest.approx(3.0 * force, rel=0.01)
    if domain == "plane-strain" and not bulk:
        # across the section only the lateral stress of a body held there, between nu and nu of the relaxed moduli
        ratio = (volume @ sigma[:, 2, 2]) / (volume @ (sigma[:, 0, 0] + sigma[:, 1, 1]))
        assert nu < ratio < 0.5


def _nodal_volume(problem: Problem) -> np.ndarray:
    from finger3d.fem.mesh import quadrature

    mesh = problem.mesh
    bary, w = quadrature(mesh.dim, 2)
    _, det = mesh.element.physical_gradients(mesh.points[mesh.cells], bary)
    out = np.zeros(len(mesh.points))
    np.add.at(out, mesh.cells, (det * w) @ mesh.element.shape(bary))
    return out


@pytest.mark.parametrize("bulk", [True, False])
def test_quarter_and_whole_agree(bulk: bool) -> None:
    quarter, whole = (build(viscous_block(symmetry=axes)) for axes in (("x", "z"), ()))
    a, b = (marched(viscous(p, TWO, bulk)) for p in (quarter, whole))
    assert forces(quarter, a) == pytest.approx(forces(whole, b), abs=1e-9)
    assert [f.gauges["g"] for f in a] == pytest.approx([f.gauges["g"] for f in b], rel=1e-8)


@pytest.mark.parametrize("bulk", [True, False])
def test_a_finger_let_go_creeps_back_and_is_met_later(bulk: bool) -> None:
    again = (*UP_AND_DOWN, Leg(0.3, steps=6, duration_s=1.0))
    problem = build(viscous_block())
    frames = marched(viscous(problem, TWO, bulk, legs=again))
    free = frames[11:17]  # out of contact before the object is back at first touch
    assert all(
        (f.meshed_state.contact.status == OPEN).all() and not f.meshed_state.contact.force.any() for f in frames[14:17]
    )
    strains = np.array([f.gauges["g"] for f in free])
    assert (strains > 0.0).all()
    assert (np.diff(strains) < 0.0).all()
    first, later = forces(problem, frames)[:6], forces(problem, frames)[17:]
    assert (later < first).all()  # the dent is not yet filled
    long = marched(viscous(problem, TWO, bulk, legs=(*UP_AND_DOWN, Leg(0.0, steps=1, duration_s=1e6))))[-1]
    assert abs(long.gauges["g"]) < 1e-6
    assert np.abs(long.meshed_state.contact.gap - problem.gap(problem.origin)).max() < 1e-6


def test_summary_counts_the_factorisations(tmp_path: Path) -> None:
    import json

    legs = "".join(f"[[press.leg]]\ndepth_mm = 0.5\nsteps = {steps}\nduration_s = 1\n" for steps in (5, 2))
    text = HALF_CYLINDER.replace("[press]\ndepth_mm = 0.5\nsteps = 4\n", legs)
    text = changed(text, domain="plane-strain") + "[effects.viscosity]\nprony = [[0.3, 0.5]]\nbulk = false\n"
    scene = written(tmp_path, text)
    out = tmp_path / "out"
    assert main(["press", str(scene), "--out", str(out), "--no-figures"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["effects"] == ["viscosity"]
    assert summary["cost"]["factorizations"] == 6  # the body, two lengths, and three parts of the first increment
    assert [s["time_s"] for s in summary["steps"]] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0])
    top = [s["normal_force_N"] for s in summary["steps"]]
    assert top[4] > top[5] > top[6] > 0.7 * top[4]


def test_a_model_turned_to_plane_stress_is_refused_too() -> None:
    model = Effect(TWO, False).apply(viscous_block())
    with pytest.raises(Finger3dError, match="plane stress"):
        next(march(build(replace(model, domain="plane-stress"))))


def test_what_is_elastic_beside_the_body_stays_elastic() -> None:
    # a foundation in series under every point of the object: its compliance is not divided by alpha
    problem = build(
        viscous_block(object=Plane(), material=Isotropic(1.0, 0.0), friction=Coulomb(0.0), legs=RAMP_AND_HOLD)
    )
    c, d = problem.delassus.shape[:2]
    soft = 3.0 / problem.surface.area  # as soft as the bar below, of E = 1 and height 3
    series = problem.delassus.reshape(c * d, c * d).copy()
    series[np.arange(c) * d, np.arange(c) * d] += soft
    frames = marched(
        viscous(replace(problem, system=replace(problem.system, delassus=series.reshape(c, d, c, d))), ((0.5, 1.0),))
    )
    # two springs of 1 in series, one of them relaxing, pulled by 0.1 in 1 s; in fine steps
    t = np.linspace(0.0, 4.0, 40001)
    pulled, stress, branch, strain = 0.1 * np.minimum(t, 1.0), np.zeros_like(t), 0.0, 0.0
    for n in range(1, len(t)):
        dt = t[n] - t[n - 1]
        fade = np.exp(-dt)
        feed = 0.5 * (1.0 - fade) / dt
        # stress = 0.5 e + h, h = fade h + feed (e - e0), e = pulled - stress
        new = (pulled[n] - (feed * strain - fade * branch) / (0.5 + feed)) / (1.0 / (0.5 + feed) + 1.0)
        e = pulled[n] - new
        branch = fade * branch + feed * (e - strain)
        strain, stress[n] = e, new
    for frame in frames:
        wanted = np.interp(frame.target.time_s, t, stress)
        assert frame.meshed_state.contact.force[:, 0] / problem.surface.area == pytest.approx(wanted, rel=2e-3)


def test_an_elastic_object_does_not_relax_with_the_finger() -> None:
    from finger3d.effects.elastic_object import Effect as ElasticObject

    slow = (Leg(0.3, steps=2, duration_s=1e9),)
    model = ElasticObject(0.5, 0.3).apply(viscous_block(friction=Coulomb(0.0), legs=slow, object=Plane()))
    problem = build(model)
    relaxed = viscous(problem, ((0.7, 1.0),))
    wanted = build(replace(model, material=Isotropic(0.3, 0.3)))
    assert forces(problem, marched(relaxed))[-1] == pytest.approx(forces(wanted, marched(wanted))[-1], rel=1e-7)
