"""Scenes on which the error bars of the mesh are judged, each at several edge lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import Design
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import Domain, ElasticObject, Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.objects import Cylinder, Plane, Sphere

from ._press import fig9_finger

MUS = (0.125, 0.5)
SWEPT_MUS = (0.1, 0.125, 0.25, 0.5, 1.0)
"""Of swept solids: where stick ends along the width, and with it the error of friction, depends on it."""


@dataclass(frozen=True)
class Case:
    """A scene at some edge lengths (mm), and at the finest, which is its truth."""

    name: str
    model: Model
    sizes: tuple[float, ...]
    truth: float
    grading: float
    mus: tuple[float, ...] = MUS

    @property
    def meshes(self) -> str:
        """The kind of mesh, for each of which the share is judged."""
        domain, mesher = self.model.domain, self.model.mesh.mesher
        large = ", large deformation" if self.model.finite_strain else ""
        if domain != "solid":
            return f"section in {domain.replace('-', ' ')}{large}"
        return ("solid swept" if mesher == "swept" else "solid pytetwild") + large

    def at(self, size: float) -> Model:
        """The model at an edge length."""
        options = replace(self.model.mesh, size_mm=size, base_size_mm=self.grading * size)
        # the truth is structured where it can be, so that it is the same on every run
        structured = size == self.truth and self.model.design.section() is not None
        return replace(self.model, mesh=replace(options, mesher="swept") if structured else options)


def _model(
    design: Design, nu: float, domain: Domain, depth: float, gauges: tuple[Gauge, ...], rigid: Any = None,
    mesher: Any = "swept",
) -> Model:  # fmt: skip
    model = Model(
        design, Isotropic(1.0, nu), MeshOptions(1.0, 1.0, mesher), (Leg(depth, steps=10),),
        object=rigid or Plane(), gauges=gauges, domain=domain,
    )  # fmt: skip
    return with_readings(model) if gauges else model


def with_readings(model: Model) -> Model:
    """The model with two markers and two taxels beside its gauges."""
    high, wide = model.design.height_mm, model.design.width_mm
    markers = (Marker("m", 0.3 * high, 0.8 * high), Marker("n", 0.0, 0.5 * high))
    taxels = (Taxel("t", 0.0, 0.0, 0.2 * high, 0.5 * wide), Taxel("s", 0.4 * high, 0.0, 0.2 * high, 0.5 * wide))
    return replace(model, markers=markers, taxels=taxels)


def cases(quick: bool) -> list[Case]:
    """Sections and solids; quick: one of each, coarse."""
    near = (Gauge("a", 1.5, 4.0, angle=0.5), Gauge("b", 3.0, 3.0, angle=0.7), Gauge("c", 0.0, 3.5))
    far = (Gauge("a", 36.0, 40.0, angle=0.5), Gauge("b", 20.0, 44.0, angle=0.2), Gauge("c", 5.0, 40.0))
    half = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    fig9 = fig9_finger()
    if quick:
        return [
            Case("half cylinder", _model(half, 0.4, "plane-strain", 1.0, near), (0.4, 0.2), 0.1, 5.0),
            _coarsest(half, "plane-strain", near, large=True),
            Case("Fig. 9 solid", _model(fig9, 0.4, "solid", 10.0, far), (5.0,), 3.4, 4.0),
        ]
    out = []
    planes: tuple[Domain, ...] = ("plane-stress", "plane-strain")
    for nu in (0.3, 0.4, 0.49):
        for plane in planes:
            model = _model(half, nu, plane, 1.0, near)
            out.append(
                Case(f"half cylinder, {plane}, nu = {nu:g}", model, (0.56, 0.4, 0.28, 0.2, 0.14, 0.1), 0.025, 5.0)
            )
            model = _model(fig9, nu, plane, 10.0, far)
            out.append(Case(f"Fig. 9, {plane}, nu = {nu:g}", model, (5.6, 4.0, 2.8, 2.0, 1.4, 1.0), 0.3, 4.0))
    model = _model(half, 0.45, "plane-strain", 1.0, near)
    out.append(Case("half cylinder, plane-strain, nu = 0.45", model, (0.4, 0.2, 0.1), 0.025, 5.0))
    for nu in (0.3, 0.4, 0.49):
        model = _model(fig9, nu, "solid", 10.0, far)
        out.append(Case(f"Fig. 9, solid swept, nu = {nu:g}", model, (4.0, 2.8, 2.0), 1.0, 4.0, SWEPT_MUS))
    for nu in (0.4, 0.49):
        model = _model(fig9, nu, "solid", 10.0, far)
        wild = replace(model, mesh=replace(model.mesh, mesher="ftetwild"))
        out.append(Case(f"Fig. 9, solid pytetwild, nu = {nu:g}", wild, (4.0, 2.8), 1.1, 4.0))
    for nu in (0.4, 0.49):
        for plane in planes:
            model = LargeDeformation().apply(_model(half, nu, plane, 1.0, near))
            name = f"half cylinder, {plane}, large deformation, nu = {nu:g}"
            out.append(Case(name, model, (0.56, 0.4, 0.28, 0.2), 0.07, 5.0))
            model = LargeDeformation().apply(_model(fig9, nu, plane, 10.0, far))
            out.append(Case(f"Fig. 9, {plane}, large deformation, nu = {nu:g}", model, (5.6, 4.0, 2.8, 2.0), 0.7, 4.0))
    model = LargeDeformation().apply(_model(fig9, 0.4, "solid", 10.0, far))
    out.append(Case("Fig. 9, solid swept, large deformation, nu = 0.4", model, (4.0, 2.8), 1.7, 4.0))
    under = (Gauge("a", 0.5, 7.5, angle=0.5), Gauge("b", 0.0, 7.0))
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    model = _model(block, 0.4, "solid", 0.5, under, Sphere(radius_mm=10.0))
    wild = replace(model, mesh=replace(model.mesh, mesher="ftetwild"))
    out += [_coarsest(half, plane, near, large) for plane in planes for large in (False, True)]
    return [
        *out, Case("sphere on a block", model, (1.0, 0.7, 0.5), 0.3, 4.0), _line(block),
        *_round_objects(half, fig9, near, far),
        Case("sphere on a block, solid pytetwild", wild, (0.7, 0.5), 0.3, 10.0), _soft(),
    ]  # fmt: skip


def _coarsest(half: Any, plane: Domain, near: tuple[Gauge, ...], large: bool) -> Case:
    """Edges at the base as long as the finger is high: no mesh is coarser."""
    model, name = _model(half, 0.4, plane, 1.0, near), f"half cylinder, {plane}"
    if large:
        model, name = LargeDeformation().apply(model), f"{name}, large deformation"
    return Case(f"{name}, coarsest", model, (3.0, 2.5), 0.1, 5.0 / 3.0)


def _soft() -> Case:
    """Two soft balls, that of the finger held on its cut; the coarser mesh is too small for a coarser companion."""
    ball = designs()["hemisphere"](radius_mm=8.0)
    model = _model(ball, 0.45, "solid", 1.0, (), Sphere(radius_mm=10.0), "ftetwild")
    model = replace(model, object_compliance=ElasticObject(1.0, 0.45))
    return Case("two soft balls, solid pytetwild", model, (0.7, 0.5), 0.25, 8.0)


def _line(block: Any) -> Case:
    """A cylinder on a half-plane, as Hertz has it: far smaller a contact than the block."""
    wide = replace(block, half_length_mm=40.0, height_mm=40.0, width_mm=1.0)
    model = _model(wide, 0.4, "plane-strain", 0.2, (), Cylinder(radius_mm=10.0, axis="z"))
    return Case("Hertz, a line", model, (0.2, 0.14, 0.1, 0.07), 0.02, 100.0)


def _round_objects(half: Any, fig9: Any, near: tuple[Gauge, ...], far: tuple[Gauge, ...]) -> list[Case]:
    """Fingers on round bars and on a ball."""
    bar, small, large = (Cylinder(radius_mm=radius, axis="z") for radius in (40.0, 3.0, 8.0))
    return [
        Case("Fig. 9 on a bar", _model(fig9, 0.49, "plane-strain", 8.0, far, bar), (2.8, 2.0, 1.4, 1.0), 0.3, 4.0),
        Case(
            "half cylinder on a bar", _model(half, 0.4, "plane-strain", 0.8, near, small), (0.4, 0.28, 0.2), 0.025, 5.0
        ),
        Case(
            "half cylinder, wide bar", _model(half, 0.3, "plane-stress", 0.8, near, large), (0.4, 0.28, 0.2), 0.025, 5.0
        ),
        Case("Fig. 9 on a ball", _model(fig9, 0.4, "solid", 6.0, far, Sphere(radius_mm=40.0)), (2.8, 2.0), 1.1, 4.0),
    ]
