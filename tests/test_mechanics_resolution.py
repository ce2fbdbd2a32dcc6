"""What the contact points resolve: refusals, warnings and advice; companion meshes."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from finger3d._cost import mesh_gb, rows_gb
from finger3d.accuracy import companion_presses
from finger3d.accuracy.estimate import estimate, main_numbers
from finger3d.cli import main
from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import UnresolvedError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise import companions
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarse_companions, coarser, companion, finer_companions
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.resolution import (
    UnresolvedOverlap,
    landmarks_of,
    unresolved_details,
    unresolved_overlap,
    warnings_before_meshing,
)
from finger3d.mechanics.discretise.size_advice import is_meshable_at, size_advice
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import ElasticObject, Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface, penetration_warnings
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.meshing.generate import is_meshable
from finger3d.meshing.structured.swept import mesh_section, mesh_swept
from finger3d.meshing.unstructured import tetwild
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave, Wedge
from tests.bodies import ball, box, write_stl
from tests.models import ended, large_fig9, run, swept_fig9
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
        (Cylinder(40.0, radius_mm=0.5), 3.0, 4.0),
        (Plane(), 0.01, 4.0),
        (Cylinder(radius_mm=1.0), 2.0, 8.0),
    ],
    ids=["ball", "beside the apex", "shallow", "cylinder"],
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
        (Plane(tilt=0.3), 5.0, 2.0),
        (Sphere(radius_mm=20.0), 5.0, 2.0),
        (Wedge(angle=0.5), 5.0, 2.0),
        (Wave(wavelength_mm=20.0, amplitude_mm=1.0), 5.0, 2.0),
        (MeshObject(surface=ball(20.0)), 5.0, 2.0),
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
        (Wave(wavelength_mm=1.5, amplitude_mm=0.01), ("1.5", "0.37")),
        (Cylinder(radius_mm=0.9), ("0.9", "0.45")),
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
        ["press"], ["compare"], ["calibrate", "--gauge", "g"], ["sweep", "--vary", "friction.mu=0.1,0.2"],
        ["optimise", "--free", "gauge.g.x_mm=10:30"],
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


def test_a_tolerance_begins_with_a_mesh_that_resolves_the_object() -> None:
    from finger3d.accuracy.refine import refine_mesh

    found = refine_mesh(fig9(Sphere(radius_mm=4.0), 0.3, 4.0), 0.9)
    assert found.rounds[0].size_mm < 4.0
    assert found.met


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


def test_triangles_of_a_body_from_a_file_are_seen(tmp_path: Path) -> None:
    write_stl(tmp_path / "ball.stl", ball(0.5))
    text = SCENE.replace('shape = "sphere"\nradius_mm = 0.5', 'shape = "mesh"\npath = "ball.stl"')
    assert main(["press", written(tmp_path, text), "--out", str(tmp_path / "out")]) == 3


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


def test_advice_counts_the_memory_of_the_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    model = fig9(Wedge(angle=0.5, tip_radius_mm=0.02), 5.0, 4.0)
    # 8000 points of the half section have a dense compliance of 40 (2 * 8000)^2 bytes, 10 GB
    monkeypatch.setattr("finger3d.meshing.limits.memory_bytes", lambda: (10**10, 10**10))
    options, zone = replace(model.mesh, size_mm=1e-3), model.first_contact.contact_box
    assert is_meshable(FIG9, options, zone, 2, symmetry(model))
    assert not is_meshable_at(model, 1e-3)


def test_the_companion_stays_within_the_finger() -> None:
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=3.0)
    options = MeshOptions(2.0, 40.0, "ftetwild")
    model = Model(design, Isotropic(1.0, 0.3), options, (Leg(1.0),))
    found = coarser(model).mesh
    # as wide as the finger is, and as high: the 36.6 mm of its edge are rounded, its top lies at 49.997 mm
    assert (found.size_mm, found.base_size_mm, found.mesher) == (3.0, design.height_mm, "swept")


@dataclass(frozen=True)
class Lump:
    """A block that does not tell that it has a section, so that it takes the way of a body that cannot be swept."""

    block: Any
    name: ClassVar[str] = "lump"

    def __getattr__(self, name: str) -> Any:
        if name == "block":
            raise AttributeError(name)
        return getattr(self.block, name)

    def section(self) -> None:
        """A body without a section cannot be swept."""


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the bodies that had to be meshed; sweeping stands in for pytetwild, of a roller for a ball."""
    names: list[str] = []

    def mesh(design: Any, options: Any, zone: Any, symmetry: tuple[str, ...], report: Any) -> tuple[Mesh, float, float]:
        names.append(design.name)
        if isinstance(design, Lump):
            body = design.block
        else:
            body = designs()["half_cylinder"](radius_mm=design.radius_mm, width_mm=2.0 * design.radius_mm)
        found, report = mesh_swept(body, options, zone, symmetry)
        return found, report.cad_volume_mm3, 0.0

    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(tetwild, "new_mesh", mesh)
    return names


def unstructured(**more: Any) -> Model:
    block = designs()["block"](half_length_mm=4.0, height_mm=4.0, width_mm=8.0)
    return Model(
        Lump(block), Isotropic(0.5, 0.45), MeshOptions(0.4, 1.0, "ftetwild"), (Leg(0.3, steps=2),),
        object=Sphere(radius_mm=4.0), friction=Coulomb(0.5), **more,
    )  # fmt: skip


def test_a_cached_mesh_without_its_companion_gets_one_and_pays_once(made: list[str]) -> None:
    # small meshes are not coarsened, see below
    model = replace(unstructured(), mesh=MeshOptions(0.3, 0.7, "ftetwild"))
    run(model)
    problem, frames = run(model)
    assert problem.body.report.from_cache
    assert made == ["lump"]
    found = companion(problem)
    assert (found.model.mesh.size_mm, found.model.mesh.base_size_mm) == (0.6, 1.4)
    assert made == ["lump", "lump"]
    assert (companion(problem).mesh.points == found.mesh.points).all()
    assert made == ["lump", "lump"]


def test_a_finer_companion_has_half_the_edges(made: list[str]) -> None:
    problem, _ = run(unstructured())
    found = next(finer_companions(problem))[1].model.mesh
    assert (found.size_mm, found.base_size_mm) == (0.2, 0.5)
    assert made == ["lump", "lump"]


def test_three_companions_are_pressed_once_in_the_increments_of_the_press(monkeypatch: Any) -> None:
    problem, frames = run(large_fig9(0.45, 1.0, legs=(Leg(4.0, steps=4),)))
    pressed: list[tuple[float, Any]] = []

    def counted(beside: Problem, *more: Any, **options: Any) -> StepResult:
        pressed.append((beside.model.mesh.size_mm, beside.model.legs[0].steps))
        return last_step(beside, *more, **options)

    monkeypatch.setattr(companion_presses, "last_step", counted)
    found = estimate(problem, frames)
    assert found.steps["normal_force_N"] > 0.0
    assert pressed == [(pytest.approx(size), 4) for size in (2.0, 2.0**0.5, 4.0)]


def test_companions_that_the_finger_makes_alike_are_left_out() -> None:
    """Edges are no longer than the finger is wide, 4 mm."""
    narrow = designs()["block"](half_length_mm=12.0, height_mm=12.0, width_mm=4.0)
    model = replace(swept_fig9(2.5), design=narrow, mesh=MeshOptions(2.5, 5.0, "swept"), legs=(Leg(1.0, steps=2),))
    ratios = [ratio for ratio, _ in coarse_companions(build(model))]
    assert ratios[:1] == [pytest.approx(1.6)]
    assert len(ratios) < 3


@pytest.mark.usefixtures("made")
def test_a_finer_companion_at_large_deformation_is_not_so_fine() -> None:
    model = unstructured()
    for large, size in ((model, 0.2), (LargeDeformation().apply(model), 0.28)):
        assert next(finer_companions(build(large)))[1].model.mesh.size_mm == pytest.approx(size)


def test_a_body_meshed_finer_than_asked_for_is_judged_by_one_still_finer(made: list[str], monkeypatch: Any) -> None:
    asked: list[float] = []

    def no_coarser_than(model: Model, *more: Any, **options: Any) -> Problem:
        asked.append(model.mesh.size_mm)
        mesh = replace(model.mesh, size_mm=min(model.mesh.size_mm, 0.4), base_size_mm=min(model.mesh.base_size_mm, 1.0))
        return build(replace(model, mesh=mesh), *more, **options)

    model = replace(unstructured(), mesh=MeshOptions(0.8, 2.0, "ftetwild"))
    monkeypatch.setattr(companions, "build", no_coarser_than)
    problem = replace(no_coarser_than(model), model=model)
    assert next(finer_companions(problem))[1].mesh.points.size > 1.5 * problem.mesh.points.size
    assert asked == [0.8, 0.4, 0.2]


def test_an_elastic_ball_is_meshed_anew_for_the_companion_and_kept(made: list[str]) -> None:
    soft = replace(unstructured(object_compliance=ElasticObject(1.0, 0.45)), mesh=MeshOptions(0.4, 1.0, "swept"))
    problem, frames = run(replace(soft, design=soft.design.block))
    assert made == ["hemisphere"]
    found = estimate(problem, frames)
    assert "bodies" in found.method
    meshed = len(made)
    assert meshed > 1
    assert 0.0 < found.discretisation["normal_force_N"] < 0.1 * main_numbers(problem, frames[-1])["normal_force_N"]
    assert estimate(problem, frames).discretisation == found.discretisation
    assert len(made) == meshed


def test_a_companion_that_would_have_too_many_unknowns_swept_is_unstructured() -> None:
    # below a ball pytetwild is fine where it touches, sweeping all along x and z of it
    block = designs()["block"](half_length_mm=6.0, height_mm=6.0, width_mm=12.0)
    problem = build(replace(unstructured(), design=block, mesh=MeshOptions(0.6, 4.5, "swept")))
    found = {}
    for size in (0.2, 0.5):  # as if this mesh were one by pytetwild
        wild = replace(problem, model=replace(problem.model, mesh=MeshOptions(size, 4.5, "ftetwild")))
        found[size] = companions._coarser_options(wild, 2.0).mesher
    assert found == {0.2: "ftetwild", 0.5: "swept"}


def rows_along_z(problem: Problem) -> int:
    return len(np.unique(np.abs(problem.points.points[:, 2]).round(9)))


@pytest.mark.parametrize("size", [8.0, 5.6, 4.0, 2.8])
def test_the_companion_of_a_swept_solid_is_coarser_along_the_width_too(size: float) -> None:
    problem = build(swept_fig9(size))
    assert rows_along_z(companion(problem)) < rows_along_z(problem)


def test_a_finer_companion_is_finer_along_the_width_too() -> None:
    block = designs()["block"](half_length_mm=4.0, height_mm=4.0, width_mm=8.0)
    problem = build(
        replace(swept_fig9(4.0), design=block, mesh=MeshOptions(4.0, 4.0, "swept"), legs=(Leg(0.3, steps=2),))
    )
    beside = companion(problem)
    assert beside.model.mesh.size_mm < 4.0
    assert rows_along_z(beside) > rows_along_z(problem)
