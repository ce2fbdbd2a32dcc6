"""Presses of sections along their exact path: independence of the steps, forces, energies, and where it is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.estimate import press_numbers
from finger3d.contact import events
from finger3d.contact.friction import OPEN, Coulomb, TwoCoefficients
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.small_strain.exact_path import has_exact_path
from finger3d.objects import Cylinder, Plane
from tests.foil_cases import FOIL
from tests.models import fig9, half_cylinder, small_section

PATHS = {
    "press": (Leg(8.0, steps=1),),
    "slide": (Leg(8.0, steps=1), Leg(8.0, slide_x_mm=1.0, steps=1), Leg(3.0, slide_x_mm=-0.5, steps=1)),
    "force": (
        Leg(8.0, steps=1, force_N=200.0),
        Leg(8.0, slide_x_mm=1.0, steps=1, force_N=200.0),
        Leg(8.0, slide_x_mm=1.0, steps=1, force_N=20.0),
    ),
}


def section(**changes: object) -> Model:
    return fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), symmetry=(), **changes)


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize(("mu", "nu"), [(0.0, 0.3), (0.06, 0.5), (0.4, 0.49), (1.0, 0.0)])
def test_no_number_depends_on_the_steps(name: str, mu: float, nu: float) -> None:
    model = section(
        friction=Coulomb(mu), material=Isotropic(1.0, nu), object=Plane(tilt=np.deg2rad(2.0)), legs=PATHS[name]
    )
    problem = build(model)
    ends = []
    for steps in (1, 7):
        legs = tuple(replace(leg, steps=steps) for leg in model.legs)
        frames = list(march(replace(problem, model=replace(model, legs=legs))))
        assert all(frame.outcome.ok for frame in frames)
        assert max(frame.residual for frame in frames) <= 1e-12
        ends.append((press_numbers(problem, frames[-1]), frames[-1]))
    (told, one), (again, _) = ends
    assert told == pytest.approx(again, rel=1e-9, abs=1e-9)
    assert balance(problem, one) <= 1e-9


def balance(problem, frame: StepResult) -> float:
    """Work less stored energy less dissipation, over the work."""
    force = problem.upright_force(frame.meshed_state.contact).ravel()
    stored = 0.5 * force @ problem.delassus.reshape(force.size, force.size) @ force * 2 ** len(problem.axes)
    return abs(frame.external_work_mJ - stored - frame.dissipation_mJ) / frame.external_work_mJ


def test_a_prescribed_force_is_reached_and_its_depth_gives_it_back() -> None:
    problem = build(section(legs=PATHS["force"][:1]))
    (by_force,) = march(problem)
    assert measure(problem.points, by_force)["normal_force_N"] == pytest.approx(200.0, rel=1e-12)
    depth = by_force.target.depth_mm
    (by_depth,) = march(replace(problem, model=replace(problem.model, legs=(Leg(depth, steps=1),))))
    assert by_depth.meshed_state.contact.force == pytest.approx(by_force.meshed_state.contact.force, abs=1e-9)


def test_increments_of_the_same_law_converge_to_the_path() -> None:
    # two equal coefficients keep increments
    model = section(friction=Coulomb(0.15), material=Isotropic(1.0, 0.3), legs=(Leg(8.0, steps=1),))
    problem = build(model)
    exact = measure(problem.points, list(march(problem))[-1])["friction_sum_N"]
    errors = []
    for steps in (40, 320):
        plain = replace(model, friction=TwoCoefficients(0.15, 1.0, "keep"), legs=(Leg(8.0, steps=steps),))
        end = list(march(replace(problem, model=plain)))[-1]
        errors.append(abs(measure(problem.points, end)["friction_sum_N"] / exact - 1.0))
    assert errors[1] < errors[0] / 4.0
    assert errors[1] < 1e-3


def test_the_half_cylinder_of_the_paper_has_the_reference_values() -> None:
    # validation/REFERENCES.md, the paper's half cylinder in plane stress: a fine mesh, 100 increments; ours is coarser
    problem = build(replace(half_cylinder(0.1), material=Isotropic(1.0, 0.3), domain="plane-stress"))
    numbers = measure(problem.points, list(march(problem))[-1])
    width = 2.0 * problem.points.half_width_mm
    assert numbers["normal_force_N"] / width == pytest.approx(1.01932, rel=5e-3)
    assert numbers["contact_half_length_mm"] == pytest.approx(2.297, abs=0.05)
    assert numbers["stick_half_length_mm"] == pytest.approx(2.230, abs=0.1)


def test_foils_and_mirrored_sections_follow_it_too() -> None:
    model = small_section(legs=(Leg(0.4, steps=1),))
    stiff = FOIL.apply(replace(model, gauges=model.gauges[1:]))
    assert has_exact_path(stiff)
    ends = []
    for axes in (None, ()):
        problem = build(replace(stiff, symmetry=axes))
        ends.append(press_numbers(problem, list(march(problem))[-1]))
    assert ends[0] == pytest.approx(ends[1], rel=1e-8, abs=1e-9)


def test_results_between_events_are_those_of_paths_that_end_there() -> None:
    slides = (0.0, 0.5)
    problem = build(section(legs=tuple(Leg(8.0, slide_x_mm=slide, steps=5) for slide in slides)))
    together = list(march(problem))
    depths = [8.0 * k / 5 for k in range(1, 6)]
    legs = [*(Leg(depth, steps=1) for depth in depths), *(Leg(8.0, slide_x_mm=0.1 * k, steps=1) for k in range(1, 6))]
    alone = list(march(replace(problem, model=replace(problem.model, legs=tuple(legs)))))
    for one, other in zip(together, alone, strict=True):
        assert press_numbers(problem, one) == pytest.approx(press_numbers(problem, other), rel=1e-9, abs=1e-9)
        assert one.meshed_state.contact.status.tolist() == other.meshed_state.contact.status.tolist()


def test_a_path_that_ends_early_keeps_the_results_before() -> None:
    problem = build(section(legs=(Leg(8.0, force_N=1e4, steps=100),)))
    *kept, failed = march(problem)
    assert failed.outcome is Outcome.FORCE_NOT_REACHED
    assert "10000 N asked; the largest force is" in failed.detail
    forces = [measure(problem.points, frame)["normal_force_N"] for frame in kept]
    assert len(forces) > 2
    assert forces == pytest.approx([100.0 * k for k in range(1, len(forces) + 1)], rel=1e-12)


@pytest.mark.parametrize(
    "changes",
    [
        {"domain": "solid"},
        {"object": Cylinder(radius_mm=40.0)},
        {"friction": TwoCoefficients(0.3, 0.7, "keep")},
        {"rule": "paper"},
        {"legs": (Leg(8.0), Leg(8.0, turn_z=0.01))},
    ],
)
def test_other_presses_keep_increments(changes: dict[str, object]) -> None:
    assert has_exact_path(section())
    assert not has_exact_path(replace(section(), **changes))
    assert not has_exact_path(LargeDeformation().apply(section()))


def test_events_without_end_are_an_outcome_with_the_place(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build(section(legs=(Leg(8.0, steps=1),)))
    monkeypatch.setattr(events, "_LEAST_EVENTS", 5)
    monkeypatch.setattr(events, "_EVENTS_A_POINT", 0)
    (frame,) = march(problem)
    assert frame.outcome is Outcome.EVENTS
    assert "x = " in frame.detail
    assert not np.any(frame.meshed_state.contact.force)


@pytest.mark.parametrize(("size", "nu", "mu", "end"), [(6.0, 0.49, 100.0, (9.5, 27)), (4.0, 0.0, 1e6, (0.0, 200))])
def test_a_path_goes_on_where_forces_jump_again_and_again(
    size: float, nu: float, mu: float, end: tuple[float, int]
) -> None:
    # held by much friction and lifted, forces jump within each part of the path, however short
    legs = (Leg(10.0, steps=1), Leg(10.0, slide_x_mm=3.0, steps=1), Leg(end[0], slide_x_mm=3.0, steps=end[1]))
    changes = {"material": Isotropic(1.0, nu), "mesh": MeshOptions(size, 4.0 * size), "friction": Coulomb(mu)}
    problem = build(fig9(domain="plane-strain", legs=legs, **changes))
    frames = list(march(problem))
    assert len(frames) == 2 + end[1]
    assert all(frame.outcome.ok for frame in frames)
    for contact in (frame.meshed_state.contact for frame in frames):
        assert not contact.force[contact.status == OPEN].any()  # no result lies within an increment over a jump
    assert sum(frame.iterations for frame in frames) < 1000
    assert balance(problem, frames[-1]) <= 1e-9
