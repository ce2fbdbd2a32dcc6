"""Readings: gauges, markers, taxels, their columns and quantities."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.analyses.reduced import ReducedModel
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.recovery import displacement
from finger3d.fem.surface import displacement_row
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure, table_row
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.marker_grid import MarkerGrid, grid_markers, marker_table
from finger3d.mechanics.readings import (
    Column,
    Marker,
    MeshedBody,
    Taxel,
)
from finger3d.meshing.generate import mesh_solid
from finger3d.objects import Plane
from finger3d.results.summary import steps_of
from tests.models import block, run

WHOLE = Taxel("whole", 0.0, 0.0, 8.0, 4.0)
"""All of the base of `tests.models.block`."""

CURVED = 1e-2
"""At large deformation the normals of a ball of 4 mm turn within the hat of a point by an angle whose mean square is
2e-2 on edges of 0.8 mm; the force of the point, along their mean, is larger than the resultant by half of that."""


def pressed(**changes: object) -> tuple[Problem, list[StepResult]]:
    return run(block(**changes))


def base_force(problem: Problem, frame: StepResult) -> float:
    """Force on the base, N, by the taxel that covers it; a section has the width of its body."""
    return frame.taxels["whole"] * WHOLE.length_mm * problem.model.design.width_mm


def test_a_marker_moves_with_the_field_on_both_sides_of_a_symmetry_plane() -> None:
    at = (0.93, 1.41, 0.57)
    problem, frames = pressed(markers=(Marker("m", *at), Marker("image", -at[0], at[1], -at[2])))
    u = displacement(problem.mesh, problem.unknowns(problem.upright_force(frames[-1].meshed_state.contact)))
    rows = [displacement_row(problem.mesh, np.array(at), axis) for axis in np.eye(3)]
    assert frames[-1].markers["m"] == pytest.approx([(row @ u.ravel())[0] for row in rows], rel=1e-9)
    assert frames[-1].markers["image"] == pytest.approx(np.multiply(frames[-1].markers["m"], [-1, 1, -1]), rel=1e-12)


@pytest.mark.parametrize("domain", ["solid", "plane-strain", "plane-stress"])
def test_a_taxel_reads_the_pressure_of_a_uniform_state_exactly(domain: str) -> None:
    """With nu = 0 a flat press without friction is uniaxial: E depth / height everywhere."""
    taxels = (Taxel("middle", 1.3, -0.4, 2.0, 1.5), WHOLE)
    flat = {"object": Plane(), "material": Isotropic(2.0, 0.0), "domain": domain, "taxels": taxels}
    _, frames = pressed(**flat)
    for frame in frames:
        stress = 2.0 * frame.target.depth_mm / 3.0
        assert [*frame.taxels.values()] == pytest.approx([stress, stress], rel=1e-8)


EFFECTS = {
    "none": (),
    "large_deformation": (LargeDeformation(),),
    "viscosity": (Viscosity(((0.5, 1.0),)),),
    "viscosity, bulk modulus constant": (Viscosity(((0.5, 1.0),), bulk=False),),
    "foil": (Foil(3000.0, 0.02, 1.0),),
    "elastic object": (ElasticObject(10.0, 0.3),),
    "kinetic friction": (KineticFriction(0.7),),
    "large deformation, viscosity and foil": (
        LargeDeformation(), Viscosity(((0.5, 1.0),)), Foil(3000.0, 0.02, 1.0),
    ),
}  # fmt: skip


def with_effects(model: Model, *effects: object) -> Model:
    for effect in effects:
        model = effect.apply(model)
    return model


@pytest.mark.parametrize("name", EFFECTS)
def test_the_base_carries_the_force_of_the_object_under_every_effect(name: str) -> None:
    """Equilibrium; a hold shows that the taxel follows the relaxed stress."""
    legs = (Leg(0.3, steps=2, duration_s=1.0), Leg(0.3, steps=2, duration_s=2.0))
    gauge = Gauge("g", 0.5, 1.5, 0.0, 0.0, 1.0)
    model = block(material=Isotropic(1.0, 0.49), legs=legs, taxels=(WHOLE,), gauges=(gauge,))
    problem, frames = run(with_effects(model, *EFFECTS[name]))
    close = CURVED if "large_deformation" in name.replace(" ", "_") else 1e-7
    for frame in frames:
        force = measure(problem.points, frame)["normal_force_N"]
        assert base_force(problem, frame) == pytest.approx(force, rel=close)
    relaxes = frames[-1].taxels["whole"] < 0.95 * frames[1].taxels["whole"]
    assert relaxes == ("viscosity" in name)


def test_readings_at_a_small_depth_do_not_depend_on_the_strain_measure() -> None:
    """The difference is of the order of depth over height."""
    depth = 1e-3
    readings = {
        "legs": (Leg(depth, steps=1),),
        "markers": (Marker("m", 1.0, 2.0, 0.5),),
        "taxels": (Taxel("t", 1.5, 0.5, 2.0, 1.0),),
    }
    small, finite = (
        run(with_effects(block(object=Plane(), **readings), *e))[1][-1] for e in ((), (LargeDeformation(),))
    )
    assert finite.markers["m"] == pytest.approx(small.markers["m"], rel=5.0 * depth, abs=5.0 * depth**2)
    assert finite.taxels["t"] == pytest.approx(small.taxels["t"], rel=5.0 * depth)


def test_taxels_that_tile_the_base_share_its_force() -> None:
    quarters = tuple(Taxel(f"{i}{k}", 2.0 * i, k, 4.0, 2.0) for i in (-1, 1) for k in (-1, 1))
    _, frames = pressed(taxels=(WHOLE, *quarters), legs=(Leg(0.3, steps=1),))
    whole, *parts = frames[-1].taxels.values()
    assert np.mean(parts) == pytest.approx(whole, rel=1e-9)
    assert parts == pytest.approx([parts[0]] * 4, rel=1e-9)


def test_markers_and_gauges_do_not_feel_the_rows_of_taxels() -> None:
    """Rows are read, and change nothing; also of a foil, whose rows come last."""
    gauge, marker = (Gauge("g", 0.5, 1.5, 0.0, 0.0, 1.0),), (Marker("m", 1.0, 2.0, 0.5),)
    model = block(gauges=gauge, legs=(Leg(0.3, steps=1),))
    for effects in ((), (Foil(3000.0, 0.02, 1.0),)):
        alone = run(with_effects(model, *effects))[1][-1]
        beside = run(with_effects(replace(model, markers=marker, taxels=(WHOLE,)), *effects))[1][-1]
        assert beside.gauges == pytest.approx(alone.gauges, rel=1e-9)


def test_a_reduced_model_reads_what_the_press_reads(tmp_path) -> None:
    problem, frames = pressed(markers=(Marker("m", 1.0, 2.0, 0.5),), taxels=(WHOLE,), gauges=(Gauge("g", 0.5, 1.5),))
    ReducedModel.of(problem).save(tmp_path / "reduced.npz")
    last = ReducedModel.load(tmp_path / "reduced.npz").press().steps[-1]
    assert last.markers["m"] == pytest.approx(frames[-1].markers["m"], rel=1e-9)
    assert last.taxels == pytest.approx(frames[-1].taxels, rel=1e-9)
    assert last.gauges == pytest.approx(frames[-1].gauges, rel=1e-9)


@dataclass(frozen=True)
class Elongation:
    """Change of the distance between two markers that share x and z, as a draw wire reads it; one number, mm."""

    name: str
    low: Marker
    high: Marker

    def columns(self, dim: int) -> tuple[Column, ...]:
        return (Column(self.name, "elongation"),)

    def mirrored(self, name: str) -> tuple[Elongation, tuple[float, ...]]:
        return replace(self, name=name, low=self.low.mirrored("")[0], high=self.high.mirrored("")[0]), (1.0,)

    def rows(self, body: MeshedBody) -> sp.csr_matrix:
        return self.high.rows(body)[1] - self.low.rows(body)[1]

    def at_finite_strain(self, body: MeshedBody, u: Float, forces: Float) -> Float:
        low, high = (m.place[: body.mesh.dim] + m.at_finite_strain(body, u, forces) for m in (self.low, self.high))
        return np.array([np.linalg.norm(high - low) - (self.high.y_mm - self.low.y_mm)])


@pytest.mark.parametrize("effect", [None, LargeDeformation()])
def test_a_reading_of_another_kind_needs_a_class_and_nothing_else(effect: object) -> None:
    """Its column stands in summary.json and has an error bar; it agrees with the two markers that it is made of."""
    ends = Marker("low", 0.5, 0.4, 0.3), Marker("high", 0.5, 1.6, 0.3)
    legs = (Leg(0.3, steps=3, duration_s=1.0),)
    model = block(object=Plane(), legs=legs, markers=ends, other_readings=(Elongation("wire", *ends),))
    problem, frames = run(effect.apply(model) if effect else model)
    low, high = (np.array(frames[-1].markers[m.name]) + m.place for m in ends)
    along = high[1] - low[1] if not isinstance(effect, LargeDeformation) else np.linalg.norm(high - low)
    read = frames[-1].readings[Column("wire", "elongation")]
    assert read == pytest.approx(along - 1.2, rel=1e-9)
    entry = measure(problem.points, frames[-1])
    assert entry["other_readings"] == {"wire": read}
    assert table_row(problem.points, frames[-1])["reading_wire"] == read
    (step,) = steps_of({"steps": [entry]})
    assert step.other_readings == {"wire": read}
    if effect is None:
        bar = estimate(problem, frames, numbers=press_numbers).discretisation["reading_wire"]
        assert 0.0 < bar < abs(read)


def test_gauge_reads_the_field_without_recovering_it() -> None:
    at, angle = (0.93, 1.41, 0.57), 0.4  # inside a cell
    gauges = (
        Gauge("point", *at, angle),
        Gauge("mirror", -at[0], at[1], -at[2], np.pi - angle),
        Gauge("short", *at, angle, 1e-3),
        Gauge("long", 0.0, 1.5, 0.0, 0.0, 2.0),
    )
    problem, frames = run(block(gauges=gauges))
    read = frames[-1].gauges
    assert read["point"] == pytest.approx(read["mirror"], rel=1e-12)
    assert read["point"] == pytest.approx(read["short"], rel=1e-6)
    u = displacement(problem.mesh, problem.unknowns(problem.upright_force(frames[-1].meshed_state.contact)))
    row = displacement_row(problem.mesh, np.array([1.0, 1.5, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert read["long"] == pytest.approx((row @ u.ravel())[0], rel=1e-9)  # elongation 2 u_x(1) over length 2


COARSE = MeshOptions(1.5, 1.5, "swept")


COARSE = MeshOptions(1.5, 1.5, "swept")


@pytest.mark.parametrize("symmetry", [None, ()])
def test_markers_cover_the_face_of_the_whole_finger_and_follow_a_field(symmetry: tuple[str, ...] | None) -> None:
    problem = build(block(mesh=COARSE, symmetry=symmetry))
    markers = MarkerGrid.of(problem, 1.0)
    # the block is 8 mm by 4 mm and 3 mm high
    assert {tuple(np.round(p, 9)) for p in markers.places} == {
        (float(x), 3.0, float(z)) for x in range(-4, 5) for z in range(-2, 3)
    }
    slope = (
        np.array([[0.2, 0.1, 0.0], [0.0, -0.1, 0.0], [0.0, 0.3, 0.05]]) if symmetry == () else np.diag([0.2, -0.1, 0.3])
    )
    assert markers.displacements(problem.mesh.points @ slope.T) == pytest.approx(markers.places @ slope.T, abs=1e-12)


def test_the_table_has_every_marker_after_every_increment() -> None:
    problem = build(block(mesh=COARSE, markers=(Marker("m", 1.0, 3.0, -1.0),)))
    steps = list(march(problem))
    table = marker_table(problem, steps, MarkerGrid.of(problem, 2.0), {"marker_m_x_mm": 0.1, "marker_grid_1_y_mm": 0.2})
    count = 1 + 5 * 3
    assert [len(column) for column in table.values()] == [count * len(steps)] * len(table)
    assert list(table["marker"][:2]) == ["m", "grid_1"]
    assert table["depth_mm"][-1] == steps[-1].target.depth_mm
    # the marker of the scene is read by its own rows
    assert table["displacement_y_mm"][-count] == pytest.approx(steps[-1].markers["m"][1])
    # errors are known after the last increment only
    told = {name: np.flatnonzero(np.isfinite(table[f"error_{name}_mm"])).tolist() for name in "xyz"}
    assert told == {"x": [count * (len(steps) - 1)], "y": [count * (len(steps) - 1) + 1], "z": []}
    assert marker_table(problem, steps, None)["marker"] == ["m"] * len(steps)


def test_a_marker_beside_the_facets_of_a_rim_is_read_at_the_nearest() -> None:
    problem = build(block(mesh=COARSE))
    markers = [Marker("a", -3.0, 3.0, 1.0), Marker("b", 4.01, 3.0, -0.5), Marker("c", 0.3, 3.0, 0.2)]
    there = MarkerGrid.at(problem, markers).displacements(problem.mesh.points)
    assert there == pytest.approx(np.array([[-3.0, 3.0, 1.0], [4.0, 3.0, -0.5], [0.3, 3.0, 0.2]]), abs=1e-7)


@pytest.mark.slow
def test_the_grid_follows_the_shape_whatever_the_mesh() -> None:
    """A round rim: chords of a coarse mesh leave out dots that those of a fine one cover."""
    design = designs()["hemisphere"](radius_mm=5.0)
    wanted = {(x, z) for x in range(-5, 6) for z in range(-5, 6) if x * x + z * z <= 25}
    markers = grid_markers(design, 1.0, 3)
    assert [(m.x_mm, m.z_mm) for m in markers] == sorted(wanted)
    assert [m.y_mm for m in markers] == pytest.approx([math.sqrt(25.0 - x * x - z * z) for x, z in sorted(wanted)])
    for size in (1.5, 3.0):
        mesh = mesh_solid(design, MeshOptions(size, 3.0), (-1.0, 1.0, -1.0, 1.0))[0]
        there = MarkerGrid.at(SimpleNamespace(mesh=mesh, dim=3, axes=()), markers).displacements(mesh.points)
        # steep at the rim, where a chord of 3 mm is .23 mm inside the circle
        assert np.abs(there - MarkerGrid(markers, *[None] * 2).places)[:, ::2].max() < 0.25
