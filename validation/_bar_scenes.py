"""Scenes on which the error bars of the mesh are judged, each at several edge lengths."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from finger3d._types import Tree
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import Design, designs
from finger3d.mechanics.model import Domain, ElasticObject, Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings import Marker, Taxel
from finger3d.objects import Cylinder, Plane, Sphere

from ._drawn import FAR, NEAR, UNDER
from ._press import fig9_finger

SCENES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
OBJECTS = {"bar": Cylinder, "ball": Sphere}
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


def with_readings(model: Model) -> Model:
    """The model with two markers and two taxels beside its gauges."""
    high, wide = model.design.height_mm, model.design.width_mm
    markers = (Marker("m", 0.3 * high, 0.8 * high), Marker("n", 0.0, 0.5 * high))
    taxels = (Taxel("t", 0.0, 0.0, 0.2 * high, 0.5 * wide), Taxel("s", 0.4 * high, 0.0, 0.2 * high, 0.5 * wide))
    return replace(model, markers=markers, taxels=taxels)


def _fingers() -> dict[str, tuple[Design, tuple[Gauge, ...]]]:
    """Fingers by name, and their gauges."""
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    return {
        "half cylinder": (designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0), NEAR),
        "Fig. 9": (fig9_finger(), FAR),
        "block": (block, UNDER[:2]),
        "half-plane": (replace(block, half_length_mm=40.0, height_mm=40.0, width_mm=1.0), ()),
        "ball": (designs()["hemisphere"](radius_mm=8.0), ()),
    }


def cases(quick: bool) -> list[Case]:
    """Sections and solids; quick: one of each, coarse."""
    fingers = _fingers()
    return [
        _case(given, nu, domain, *fingers[given["finger"]])
        for group in SCENES["quick" if quick else "full"]
        for nu, domain, given in product(group["nu"], group["domain"], group["case"])
    ]


def _case(given: Tree, nu: float, domain: Domain, design: Design, gauges: tuple[Gauge, ...]) -> Case:
    mesh = MeshOptions(1.0, 1.0, given.get("mesher", "swept"))
    model = Model(
        design, Isotropic(1.0, nu), mesh, (Leg(given["depth_mm"], steps=10),), gauges=gauges, domain=domain,
        object=next((OBJECTS[shape](radius_mm=radius) for shape, radius in given.get("object", {}).items()), Plane()),
    )  # fmt: skip
    model = with_readings(model) if gauges else model
    model = LargeDeformation().apply(model) if given.get("large") else model
    if soft := given.get("soft"):
        model = replace(model, object_compliance=ElasticObject(*soft))
    name = given["name"].format(domain=domain, nu=nu)
    sizes, mus = tuple(given["sizes_mm"]), SWEPT_MUS if given.get("swept_mus") else MUS
    return Case(name, model, sizes, given["truth_mm"], given["grading"], mus)
