"""Companion meshes: coarser in every direction, or finer where none is coarser."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from finger3d.accuracy import companion_presses
from finger3d.accuracy.estimate import estimate, main_numbers
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise import companions
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarse_companions, coarser, companion, finer_companions
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.step_halving import last_step
from finger3d.mechanics.model import ElasticObject, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult
from finger3d.meshing.structured.swept import mesh_swept
from finger3d.meshing.unstructured import tetwild
from finger3d.objects import Sphere
from tests.models import large_fig9, run, swept_fig9


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
