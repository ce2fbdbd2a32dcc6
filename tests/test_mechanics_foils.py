"""Embedded gauges, and meshes refined around gauges."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d._types import Float
from finger3d.accuracy.cost import forecast
from finger3d.cli import main
from finger3d.contact.friction import Coulomb, TwoCoefficients
from finger3d.effects.viscosity import Effect as Viscosity
from finger3d.fem.assembly import Stiffness
from finger3d.fem.embedded import FoilPatches, InfiniteBody
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import CONTACT
from finger3d.fem.solvers.condense import condense, stiffened
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import companion, edge_ratio
from finger3d.mechanics.discretise.foils import discretised_foils
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import Plane
from tests.foil_cases import FOIL, LEGS, MIDDLE, block
from tests.models import marched
from tests.scenes import HALF_CYLINDER, changed, written
from validation._foil import wing

ASIDE = Gauge("a", 1.3, 1.7, 0.4, 0.5, 1.5)


@pytest.mark.parametrize("domain", ["plane-strain", "plane-stress", "solid"])
def test_condensed_foils_are_foils_in_the_stiffness(domain: str) -> None:
    model = FOIL.apply(block(domain=domain, material=Isotropic(1.0, 0.49), gauges=(MIDDLE, ASIDE)))
    problem = build(model)
    assert problem.factorizations == 1
    inlay = discretised_foils(model.inclusions, model, problem.mesh, problem.axes)
    added = sp.csr_matrix(inlay.rows.T @ sp.diags_array(inlay.bar_stiffness) @ inlay.rows)
    added.resize(problem.body.stiffness.upper.shape)
    stiffer = Stiffness(
        sp.csr_matrix(problem.body.stiffness.upper + sp.triu(added)), problem.body.stiffness.pressure_vertices,
        problem.body.stiffness.pressure_scale,
    )  # fmt: skip
    rows = problem.body.condensed.rows[: len(problem.system.active_dofs) + 2, : problem.mesh.points.size]
    direct = condense(stiffer, problem.body.fixed_dofs, rows).compliance
    r, mesh_alone = len(problem.system.active_dofs), problem.body.condensed.compliance.copy()
    mesh_alone[r:, r:] -= problem.inclusions.subgrid_compliance
    found = stiffened(mesh_alone, problem.inclusions.bar_stiffness)[: r + 2, : r + 2]
    assert found == pytest.approx(direct, abs=1e-8 * direct.max())


def test_a_foil_across_a_bar_shares_its_load() -> None:
    # nu = 0 between plates: strain is uniform, so a foil along the height only adds to the stiffness if it spans it;
    # one of half the height reads between 0 and the free strain, and the less the stiffer it is
    model = block(
        object=Plane(), material=Isotropic(1.0, 0.0), friction=Coulomb(0.0), domain="plane-strain",
        gauges=(Gauge("v", 0.0, 1.5, 0.0, np.pi / 2, 1.5),),
    )  # fmt: skip
    reads = []
    for modulus in (0.1, 10.0, 100.0, 1e4):
        last = marched(build(replace(FOIL, E_MPa=modulus).apply(model)))[-1]
        assert last.gauges["v_free"] == pytest.approx(-0.1, rel=1e-9)
        reads.append(last.gauges["v"] / last.gauges["v_free"])
    assert 1.0 > reads[0] > reads[1] > reads[2] > reads[3] > 0.0
    assert reads[0] > 0.99
    assert reads[3] < 0.05


def test_free_strain_is_that_of_the_scene_without_the_effect() -> None:
    # bars cover all of a foil but a hundredth of its length; and a solid's foil has a width, a line has none
    for domain, close in (("plane-strain", 0.01), ("solid", 0.05)):
        plain, foiled = (marched(build(m)) for m in (block(domain=domain), FOIL.apply(block(domain=domain))))
        for a, b in zip(plain, foiled, strict=True):
            assert set(b.gauges) == {"g", "g_free"}
            assert b.gauges["g_free"] == pytest.approx(a.gauges["g"], rel=close)
            assert 0.0 < b.gauges["g"] < 0.5 * b.gauges["g_free"]


def test_a_foil_as_soft_as_nothing_reads_the_free_strain() -> None:
    for frame in marched(build(replace(FOIL, E_MPa=1e-12).apply(block(gauges=(MIDDLE, ASIDE))))):
        for name in ("g", "a"):
            assert frame.gauges[name] == pytest.approx(frame.gauges[f"{name}_free"], rel=1e-11)


@pytest.mark.parametrize(
    ("gauges", "axes"),
    [
        ((MIDDLE,), ("x", "z")),
        ((ASIDE,), ()),
        ((replace(ASIDE, x_mm=0.0, angle=0.0),), ("x",)),
        ((replace(MIDDLE, angle=0.1),), ("z",)),
        ((replace(ASIDE, z_mm=0.0), Gauge("b", -1.3, 1.7, 0.0, np.pi - 0.5, 1.5)), ("x", "z")),
        ((replace(ASIDE, z_mm=0.0), Gauge("b", -1.3, 1.7, 0.0, np.pi - 0.5, 1.4)), ("z",)),
    ],
)
def test_foils_keep_the_planes_they_are_mirrored_in(gauges: tuple[Gauge, ...], axes: tuple[str, ...]) -> None:
    assert symmetry(FOIL.apply(block(gauges=gauges))) == axes
    assert symmetry(block(gauges=gauges)) == ("x", "z")


def test_quarter_and_whole_agree() -> None:
    pair = (replace(ASIDE, z_mm=0.0), Gauge("b", -1.3, 1.7, 0.0, np.pi - 0.5, 1.5), MIDDLE)
    model = FOIL.apply(block(gauges=pair))
    quarter, whole = build(model), build(replace(model, symmetry=()))
    assert (quarter.axes, whole.axes) == (("x", "z"), ())
    a, b = marched(quarter)[-1], marched(whole)[-1]
    for name in ("a", "b", "g", "a_free", "g_free"):
        assert a.gauges[name] == pytest.approx(b.gauges[name], rel=1e-8)
    assert a.gauges["a"] == pytest.approx(a.gauges["b"], rel=1e-12)
    force = [measure(p.points, f)["normal_force_N"] for p, f in ((quarter, a), (whole, b))]
    assert force[0] == pytest.approx(force[1], rel=1e-9)


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_neither_more_bars_nor_a_finer_mesh_change_much(domain: str) -> None:
    def ratio(size: float, **more: object) -> float:
        model = FOIL.apply(block(domain=domain, mesh=MeshOptions(size, 1.5 * size, "swept")))
        gauges = marched(build(replace(model, inclusions=replace(model.inclusions, **more))))[-1].gauges
        return gauges["g"] / gauges["g_free"]

    few = ratio(0.8)
    assert ratio(0.4) == pytest.approx(few, rel=0.02)
    assert ratio(0.8, patches=((32, 1), (24, 16))) == pytest.approx(few, rel=0.02)


def foil(along: np.ndarray, at: float = 0.0, turn: float = 0.0, width: float = 0.01) -> FoilPatches:
    direction = np.array([np.cos(turn), np.sin(turn), 0.0])
    return FoilPatches(np.array([at, 0.0, 0.0]), direction, along, np.array([-0.5 * width, 0.5 * width]))


def test_a_foil_in_a_thick_plate_reads_what_the_wing_equation_says() -> None:
    alone = FoilPatches.of(np.zeros(3), np.array([1.0, 0.0, 0.0]), 2.0, 1.0, 32, 1)
    bars = alone.strain_due_to(alone, InfiniteBody(1.0, 0.3, False, 4.0))
    springs = 3000.0 * 0.02 * alone.area
    strain = np.linalg.solve(np.eye(31) + bars * springs, np.ones(31))
    expected = wing(2.0, 3000.0 * 0.02 / 4.0, 1.0, 0.3)
    assert strain @ alone.area / alone.area.sum() == pytest.approx(expected, rel=0.002)


@pytest.mark.parametrize(
    "body", [InfiniteBody(2.0, 0.3), InfiniteBody(2.0, 0.3, True, 5.0), InfiniteBody(2.0, 0.3, False, 5.0)]
)
def test_a_bar_far_away_feels_a_pair_of_point_forces(body: InfiniteBody) -> None:
    E, nu = 2.0, 0.3
    if body.thickness is None:
        push = (1.0 + nu) / (8.0 * np.pi * E * (1.0 - nu)) * (4.0 - 4.0 * nu)  # u_x = push / x for 1 N along x, ahead
        wanted = -2.0 * push / 20.0**3
    else:
        plane, ratio = (E, nu) if body.plane_stress else (E / (1.0 - nu**2), nu / (1.0 - nu))
        wanted = -(1.0 + ratio) * (3.0 - ratio) / (4.0 * np.pi * plane * 5.0) / 20.0**2
    short = np.array([-0.02, 0.0, 0.02])
    assert foil(short, 20.0).strain_due_to(foil(short), body)[0, 0] == pytest.approx(wanted, rel=1e-3)
    # and so it does where patches are integrated: the first and the last bar of one foil
    long = foil(np.array([-0.02, 0.0, 0.02, 19.98, 20.0, 20.02]))
    unequal = long.strain_due_to(foil(short), body)[3, 0]  # from the last patch of 0.02 mm to the first
    assert long.strain_due_to(long, body)[3, 0] == pytest.approx(unequal, rel=1e-3)
    assert unequal == pytest.approx(wanted, rel=1e-3)


def test_what_two_foils_do_to_each_other_is_mutual() -> None:
    a = FoilPatches.of(np.zeros(3), np.array([1.0, 0.0, 0.0]), 2.0, 1.0, 8, 4)
    b = FoilPatches.of(np.array([0.3, 0.1, 0.3]), np.array([0.6, 0.8, 0.0]), 1.0, 1.0, 6, 4)
    for body in (InfiniteBody(1.0, 0.4), InfiniteBody(1.0, 0.4, False, 2.0)):
        forth, back = a.strain_due_to(b, body), b.strain_due_to(a, body)
        assert forth == pytest.approx(back.T, abs=1e-12)


@pytest.mark.parametrize("bulk", [True, False])
def test_a_foil_in_a_relaxing_body_does_not_relax(bulk: bool) -> None:
    prony = ((0.9, 0.01),)
    model = block(gauges=(MIDDLE,), friction=Coulomb(0.0), legs=(Leg(0.3, steps=1, duration_s=1e6),))
    slow = marched(build(Viscosity(prony, bulk).apply(FOIL.apply(model))))[-1]
    # at last: the body of a tenth of the shear modulus, around the same foil
    soft = Isotropic(0.1, 0.3)
    if not bulk:
        low, volume = 0.1 / 2.6, 1.0 / 1.2
        soft = Isotropic(9.0 * volume * low / (3.0 * volume + low), (1.5 * volume - low) / (3.0 * volume + low))
    wanted = marched(build(FOIL.apply(replace(model, material=soft))))[-1]
    close = 1e-6 if bulk else 0.01  # the foil's neighbourhood relaxes as if nu were constant
    assert slow.gauges["g"] == pytest.approx(wanted.gauges["g"], rel=close)
    assert slow.gauges["g_free"] == pytest.approx(wanted.gauges["g_free"], rel=close)
    assert slow.meshed_state.contact.force == pytest.approx(
        wanted.meshed_state.contact.force, abs=close * wanted.meshed_state.contact.force.max()
    )


def test_viscosity_with_and_without_bulk_agree_around_a_foil_in_an_incompressible_body() -> None:
    increments_as_given = TwoCoefficients(0.25, 0.99, "keep")  # with bulk alone, the first would be cut into parts
    model = block(gauges=(MIDDLE,), material=Isotropic(1.0, 0.5), legs=LEGS, friction=increments_as_given)
    model = FOIL.apply(model)
    problem = build(model)
    prony = ((0.5, 1.0), (0.2, 0.1))
    a, b = (marched(replace(problem, model=Viscosity(prony, bulk).apply(model)))[-1] for bulk in (True, False))
    assert a.meshed_state.contact.force == pytest.approx(
        b.meshed_state.contact.force, abs=1e-6 * a.meshed_state.contact.force.max()
    )
    for name in ("g", "g_free"):
        assert a.gauges[name] == pytest.approx(b.gauges[name], rel=1e-5)


def test_press_writes_both_strains(tmp_path: Path) -> None:
    text = changed(HALF_CYLINDER, width_mm=4.0, steps=3, domain="plane-strain", y_mm=3.5, angle_deg=20.0)
    foil = "[effects.embedded_gauge]\nE_MPa = 3000.0\nthickness_mm = 0.02\nwidth_mm = 3.0\n"
    scene = written(tmp_path, f"{text}length_mm = 1.5\n{foil}")
    out = tmp_path / "out"
    assert main(["press", str(scene), "--out", str(out), "--no-figures"]) == 0
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["cost"]["factorizations"] == 1
    assert summary["mesh"]["symmetry"] == []
    for step in summary["steps"]:
        assert set(step["gauges"]) == {"g", "g_free"}
        assert abs(step["gauges"]["g"]) < 0.5 * abs(step["gauges"]["g_free"])
    assert "gauge_g_free" in (out / "history.csv").read_text(encoding="utf-8").splitlines()[0]


ROUND = Isotropic(1.0, 0.49)
MUS = np.arange(0.1, 1.05, 0.1)


def model(size: float, refinement: float, **changes: Any) -> Model:
    """The Fig. 9 finger as a section, pressed 10 mm, with its gauge close to the edge of the contact."""
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    mesh = MeshOptions(size, 4.0 * size, "swept", gauge_refinement=refinement)
    gauge = Gauge("g", 36.0, 40.0, angle=np.radians(30.0))
    found = Model(design, ROUND, mesh, (Leg(10.0, steps=20),), gauges=(gauge,), domain="plane-strain")
    return replace(found, **changes)


def slope(size: float, refinement: float) -> Float:
    """Return the slope of the gauge's strain over mu between values 0.1 apart."""
    problem = build(model(size, refinement))
    presses = [list(march(replace(problem, model=replace(problem.model, friction=Coulomb(mu)))))[-1] for mu in MUS]
    return np.diff([press.gauges["g"] for press in presses]) / np.diff(MUS)


def test_the_slope_of_a_gauge_near_the_edge_of_contact_is_several_times_as_accurate() -> None:
    # without refinement cells at the gauge are as large as its distance from the edge of the contact
    plain, finer, much_finer = slope(4.0, 1.0), slope(4.0, 8.0), slope(1.0, 8.0)
    scale = np.abs(much_finer).max()
    error, error_finer = (np.abs(found - much_finer).max() / scale for found in (plain, finer))
    assert error > 0.2
    assert error_finer < 0.1
    assert error_finer < 0.3 * error


def test_the_contact_face_is_refined_close_to_the_gauge_and_the_body_below_it_is_not() -> None:
    usual, finer = build(model(4.0, 1.0)), build(model(4.0, 4.0))
    # the gauge lies 3.4 mm below the face, whose edges are shortest up to 2.5 times that distance from it
    x = np.unique(finer.surface.points[finer.surface.face == CONTACT, 0])
    near = np.abs(x[1:] - 36.0) < 6.0
    assert np.diff(x)[near].max() < 0.4 * 4.0
    far = x[x < 20.0]
    assert far == pytest.approx(np.unique(usual.surface.points[usual.surface.face == CONTACT, 0])[: len(far)], abs=1e-9)
    # 15 mm below the gauge edges are as long as they were
    below = np.abs(finer.mesh.points - [36.0, 25.0]).max(axis=1) < 4.0
    before = np.abs(usual.mesh.points - [36.0, 25.0]).max(axis=1) < 4.0
    assert np.count_nonzero(below) <= 1.5 * np.count_nonzero(before)


def test_a_larger_factor_makes_no_edge_of_the_contact_face_longer() -> None:
    longest = []
    for refinement in (1.0, 2.0, 4.0, 8.0, 16.0):
        surface = build(model(4.0, refinement, gauges=(Gauge("g", 36.0, 40.0),))).surface
        x = np.unique(surface.points[surface.face == CONTACT, 0])
        longest.append(np.diff(x)[np.abs(x[1:] - 36.0) < 6.0].max())
    assert all(finer <= coarser + 1e-9 for coarser, finer in pairwise(longest))
    # the gauge lies 3.4 mm under the face, whose edges are an eighth of that at least
    assert longest[-1] < 0.5 * longest[0]


def test_edges_are_short_along_the_whole_gauge_and_its_mirror_image() -> None:
    gauge = Gauge("long", -20.0, 40.0, length_mm=12.0)
    problem = build(model(8.0, 8.0, gauges=(gauge,)))
    assert problem.axes == ("x",)
    for x in (14.0, 20.0, 26.0):
        distance = np.linalg.norm(problem.mesh.points - [x, 40.0], axis=1)
        assert np.count_nonzero(distance < 1.5) > 5


def test_the_companion_of_an_error_bar_is_refined_alike() -> None:
    problem, usual = build(model(2.0, 4.0)), build(model(2.0, 1.0))
    beside = companion(problem)
    assert beside.model.mesh.gauge_refinement == 4.0
    # of the rest of the mesh, from which the errors of forces come; pressures count in one of the ratios only
    assert edge_ratio(problem, beside) == pytest.approx(edge_ratio(usual, companion(usual)), rel=0.02)


def test_a_forecast_counts_the_cells_around_gauges() -> None:
    finer = model(2.0, 4.0)
    expected, built = forecast(finer), build(finer)
    assert expected["cells"] == built.body.report.cells
    assert expected["dofs"] == built.body.stiffness.upper.shape[0]
