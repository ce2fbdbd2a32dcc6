"""What the contact points resolve: refusals, warnings and advice; companion meshes."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d._cost import mesh_gb, rows_gb
from finger3d.cli import main
from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.errors import UnresolvedError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarse_companions, coarser, companion
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.resolution import (
    UnresolvedOverlap,
    is_meshable_at,
    landmarks_of,
    size_advice,
    unresolved_details,
    unresolved_overlap,
    warnings_before_meshing,
)
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface, penetration_warnings
from finger3d.meshing.swept import mesh_section
from finger3d.objects import MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from tests.bodies import box
from tests.models import ended, swept_fig9
from tests.scenes import SWEPT_FINGER, changed

FIG9 = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
SCENE = (
    changed(SWEPT_FINGER, nu=0.45, depth_mm=5.0, steps=2, size_mm=4.0, base_size_mm=8.0, name="g", x_mm=10.0, y_mm=30.0)
    + '[object]\nshape = "sphere"\nradius_mm = 0.5\n[model]\ndomain = "plane-strain"\n'
)


def fig9(obj: RigidObject, depth: float, size: float, **changes: object) -> Model:
    model = Model(
        FIG9, Isotropic(1.0, 0.45), MeshOptions(size, 8.0, "swept"), (Leg(depth, steps=2),), object=obj,
        friction=Coulomb(0.25), domain="plane-strain",
    )  # fmt: skip
    return replace(model, **changes)


def overlap_of(problem: Problem) -> UnresolvedOverlap:
    landmarks = landmarks_of(problem.model, problem.system.first_contact_mm, problem.system.place_mm)
    return unresolved_overlap(problem.model, problem.surface, problem.system.first_contact_mm, landmarks, problem.axes)


@pytest.mark.parametrize(
    ("obj", "depth", "size"),
    [
        (Sphere(radius_mm=0.5), 5.0, 4.0),
        (Plane(), 0.01, 4.0),
    ],
    ids=["ball", "shallow"],
)
@pytest.mark.parametrize("finite", [False, True])
def test_what_touches_no_point_is_refused_with_the_size_that_resolves_it(
    obj: RigidObject, depth: float, size: float, finite: bool
) -> None:
    model = fig9(obj, depth, size)
    with pytest.raises(UnresolvedError) as refused:
        build(Effect().apply(model) if finite else model)
    finer = refused.value.size_mm
    assert finer is not None
    assert f"mesh.size_mm = {finer:g}" in str(refused.value)
    resolved = fig9(obj, depth, finer)
    problem = build(resolved)
    assert overlap_of(problem).ratio <= 0.1
    *_, end = march(problem)
    assert end.outcome.ok
    assert measure(problem.points, end)["normal_force_N"] > 0.0


@pytest.mark.parametrize("obj", [Wedge(angle=math.radians(89.99)), Wave(wavelength_mm=20.0, amplitude_mm=1e6)])
@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_needles_are_refused(obj: RigidObject, domain: str) -> None:
    with pytest.raises(UnresolvedError) as refused:
        build(fig9(obj, 5.0, 4.0, domain=domain))
    # the overlap is 5 mm deep and as wide as 2 * 5 / tan(angle), or 2 sqrt(5 * 2 / curvature): a few edges at most
    width = 10.0 / math.tan(math.radians(89.99)) if isinstance(obj, Wedge) else 2.0 * math.sqrt(10.0 / 1e5)
    if domain == "solid":  # 20 mm wide: more than 1000 layers of more than 1000 facets
        assert refused.value.size_mm is None
        assert "press deeper, or with a thicker or blunter object" in str(refused.value)
        return
    assert refused.value.size_mm is not None
    assert 0.02 * width < refused.value.size_mm < width


def test_a_point_beside_a_blunt_bump_does_not_hide_a_needle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda: (1e15, 1e15))
    bump, needle = box(30.0, 2.0, 40.0, (0.0, 1.0, 0.0)), box(0.2, 2.0, 0.2, (9.1, 0.5, 5.1))
    both = replace(
        bump, points=np.vstack([bump.points, needle.points]), faces=np.vstack([bump.faces, needle.faces + 8])
    )
    block = designs()["block"](half_length_mm=20.0, height_mm=10.0, width_mm=20.0)
    model = fig9(MeshObject(surface=both), 0.7, 2.0, design=block, domain="solid")
    with pytest.raises(UnresolvedError) as refused:  # it is 0.5 mm below the bump, so 0.5 of 0.7 mm are not seen
        build(replace(model, mesh=MeshOptions(2.0, 5.0, "swept")))
    assert refused.value.size_mm is not None
    assert 0.02 < refused.value.size_mm < 0.2


@pytest.mark.parametrize(
    ("obj", "depth", "size"),
    [
        (Plane(), 10.0, 4.0),
        (Sphere(radius_mm=20.0), 5.0, 2.0),
        (MeshObject(surface=box(10.0, 5.0, 40.0)), 3.0, 2.0),
    ],
)
@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_what_points_see_well_is_neither_refused_nor_warned_of(
    obj: RigidObject, depth: float, size: float, domain: str
) -> None:
    model = fig9(obj, depth, size, domain=domain, legs=(Leg(depth, steps=2), Leg(0.5 * depth, steps=1)))
    assert overlap_of(build(model)).ratio < 0.1
    assert not warnings_before_meshing(model, symmetry(model))


def test_a_flank_that_touches_the_wall_is_resolved_by_points_of_the_wall() -> None:
    """The plane is all but parallel to the wall: it comes 0.09 mm closer to it as it goes down 5 mm."""
    problem, end = ended(fig9(Plane(tilt=math.radians(89.0)), 5.0, 1.0))
    walls = problem.points.face == 1
    assert (end.state.status[walls] != OPEN).any()
    force = problem.world_force(end.meshed_state.contact)
    pushed, down = np.abs(force[:, :2].sum(axis=0))
    assert math.atan2(down, pushed) == pytest.approx(math.radians(1.0) + math.atan(0.25), abs=0.01)  # it slides down


def test_what_is_hidden_is_the_sagitta_of_the_hats() -> None:
    # a parabola of curvature 1/R, as the finger has one of 100 mm and a level plane none: its mean over a hat of
    # spacing h is h^2 / 12 R higher than its lowest point at the vertex, and nothing is deeper in between
    for size in (4.0, 2.0, 1.0):
        problem = build(fig9(Plane(), 0.5, size))
        spacing = np.diff(np.sort(problem.surface.points[:, 0]))[0]
        found = overlap_of(problem)
        assert found.depth_mm == pytest.approx(spacing**2 / (12.0 * 100.0), rel=0.02)
        assert found.ratio == found.depth_mm / 0.5


@pytest.mark.parametrize(
    ("obj", "lengths"),
    [
        (Wave(wavelength_mm=0.1, amplitude_mm=0.1), ("0.1", "0.025")),
        (Wedge(angle=0.5, tip_radius_mm=0.2), ("0.2", "0.1")),
    ],
)
def test_details_that_points_cannot_see_are_warned_of(obj: RigidObject, lengths: tuple[str, str]) -> None:
    told = warnings_before_meshing(fig9(obj, 5.0, 0.5), ())
    assert len(told) == 1
    assert all(re.search(rf"\b{re.escape(length)}\b", told[0]) for length in lengths)
    assert not warnings_before_meshing(replace(fig9(obj, 5.0, 0.5), mesh=MeshOptions(float(lengths[1]), 8.0)), ("x",))


def written(tmp_path: Path, text: str = SCENE) -> str:
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    "command",
    [
        ["press"], ["calibrate", "--gauge", "g"],
    ],
    ids=lambda c: c[0],
)  # fmt: skip
def test_no_command_gives_numbers(tmp_path: Path, command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    code = main([command[0], written(tmp_path), "--out", str(tmp_path / "out"), *command[1:]])
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert code == 3
    assert "mesh.size_mm = 4" in last
    assert "mesh.size_mm = 0.25" in last


def test_a_sweep_refuses_the_depth_that_its_body_does_not_resolve(tmp_path: Path) -> None:
    command = ["sweep", written(tmp_path), "--set", 'object={shape="plane"}', "--vary", "press.depth_mm=0.01,5"]
    assert main([*command, "--out", str(tmp_path / "out")]) == 3
    rows = (tmp_path / "out" / "results.csv").read_text(encoding="utf-8").splitlines()[1:]
    assert ["converged" in row for row in rows] == [False, True]


def test_a_condensed_body_refuses_a_path_that_its_points_do_not_see(tmp_path: Path) -> None:
    from finger3d.analyses.reduced import ReducedModel

    body = ReducedModel.of(build(fig9(Plane(), 5.0, 4.0)))
    assert body.press(legs=[Leg(2.0, steps=1)]).outcome.ok
    with pytest.raises(UnresolvedError):
        body.press(legs=[Leg(0.01, steps=1)])


def test_a_companion_that_does_not_see_the_object_is_none() -> None:
    from finger3d.mechanics.discretise.companions import companion

    problem = build(fig9(Plane(), 0.1, 4.0))
    assert companion(problem).model.mesh.size_mm < 4.0


def test_increments_without_contact_are_told(tmp_path: Path) -> None:
    command = ["press", written(tmp_path), "--set", 'object={shape="plane"}', "--out", str(tmp_path / "out")]
    many = ["--set", "press.depth_mm=0.5", "--set", "press.steps=100", "--no-figures", "--no-error"]
    assert main([*command, *many]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    missed = sum(s["contact_area_mm2"] == 0.0 for s in summary["steps"])
    assert missed > 0
    assert any(text.startswith(f"{missed} of 100 ") for text in summary["warnings"])


@pytest.mark.parametrize("finite", [False, True])
def test_the_end_of_a_press_tells_how_deep_the_object_is_between_the_points(finite: bool) -> None:
    cases = [(Wave(wavelength_mm=4.0, amplitude_mm=1.0), 3.0, 2.0), (Sphere(radius_mm=5.0), 2.0, 1.0)]
    shares = []
    for obj, depth, size in cases:
        model = fig9(obj, depth, size, legs=(Leg(depth, steps=4),))
        problem = build(Effect().apply(model) if finite else model)
        *_, end = march(problem)
        checks = check_surface(problem, [end])
        shares.append(checks[0].penetration_mm / depth)
        # what is hidden at rest, measured vertically, foretells the distance
        assert shares[-1] == pytest.approx(overlap_of(problem).ratio, abs=0.08)
        assert len(penetration_warnings(problem, checks)) == (shares[-1] > 0.1)
    assert shares[0] > 0.1 > shares[1]


def test_an_edge_that_cuts_between_points_which_moved_is_told() -> None:
    # at rest the points see the flat box; at finite strain the surface slides by some of the box's length, and its
    # edge comes to lie between them
    model = fig9(MeshObject(surface=box(10.0, 5.0, 40.0)), 4.0, 2.5, legs=(Leg(4.0, steps=5),))
    problem = build(Effect().apply(model))
    *_, end = march(problem)
    assert overlap_of(problem).ratio < 0.01
    assert len(penetration_warnings(problem, check_surface(problem, [end]))) == 1


def test_an_object_that_slides_off_is_no_mistake() -> None:
    legs = (Leg(1.0, steps=1), Leg(1.0, slide_x_mm=60.0, steps=12))
    problem, end = ended(fig9(Sphere(radius_mm=20.0), 1.0, 2.0, legs=legs))
    assert (end.state.status == OPEN).all()


def test_an_edge_that_no_memory_holds_is_not_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(Wedge(angle=0.5, tip_radius_mm=0.02), 5.0, 4.0)
    (line,) = unresolved_details(model)
    assert "mesh.size_mm = 0.01 resolves it" in line
    zone, axes = model.first_contact.contact_box, symmetry(model)
    cells = mesh_section(FIG9, replace(model.mesh, size_mm=0.01), zone, axes)[1].cells
    rows = 2.0 * 11.0 / 0.01  # the wedge comes within 0.3 of its depth, 1.5 mm, over 11 mm on either side
    # 80 % of the memory is what a press may take (finger3d/_cost.py); cells are counted before they are made, to 11 %
    for share, fits in ((1.3, True), (0.7, False)):
        total = share * 1e9 * (mesh_gb(cells, 2) + rows_gb(rows)) / 0.8
        monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda total=total: (total, total))
        assert is_meshable_at(model, 0.01) == fits
        (line,) = unresolved_details(model)
        assert ("mesh.size_mm = " in line) == fits
        assert ("choose a larger object.tip_radius_mm" in line) != fits


@pytest.mark.parametrize(("size", "said"), [(0.1197, "0.11"), (0.12, "0.12"), (3.96, "3.9"), (0.00999, "0.0099")])
def test_advice_is_rounded_down(size: float, said: str) -> None:
    assert size_advice(fig9(Wedge(angle=0.5), 5.0, 4.0), size, "has enough", "") == f"mesh.size_mm = {said} has enough"


def test_the_companion_stays_within_the_finger() -> None:
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=3.0)
    options = MeshOptions(2.0, 40.0, "ftetwild")
    model = Model(design, Isotropic(1.0, 0.3), options, (Leg(1.0),))
    found = coarser(model).mesh
    # as wide as the finger is, and as high: the 36.6 mm of its edge are rounded, its top lies at 49.997 mm
    assert (found.size_mm, found.base_size_mm, found.mesher) == (3.0, design.height_mm, "swept")


def test_companions_that_the_finger_makes_alike_are_left_out() -> None:
    """Edges are no longer than the finger is wide, 4 mm."""
    narrow = designs()["block"](half_length_mm=12.0, height_mm=12.0, width_mm=4.0)
    model = replace(swept_fig9(2.5), design=narrow, mesh=MeshOptions(2.5, 5.0, "swept"), legs=(Leg(1.0, steps=2),))
    ratios = [ratio for ratio, _ in coarse_companions(build(model))]
    assert ratios[:1] == [pytest.approx(1.6)]
    assert len(ratios) < 3


def rows_along_z(problem: Problem) -> int:
    return len(np.unique(np.abs(problem.points.points[:, 2]).round(9)))


@pytest.mark.parametrize("size", [8.0, 2.8])
def test_the_companion_of_a_swept_solid_is_coarser_along_the_width_too(size: float) -> None:
    problem = build(swept_fig9(size))
    assert rows_along_z(companion(problem)) < rows_along_z(problem)
