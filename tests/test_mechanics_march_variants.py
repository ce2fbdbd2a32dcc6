"""Variants of a press: each equals a press of its model on its own, whatever differs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build, changed
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.variants import press_variants
from finger3d.mechanics.model import ElasticObject, Foils, Leg, MeshOptions, Model
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.results.history import StepResult
from finger3d.objects import Cylinder

CLIPPED = designs()["clipped_cylinder"](radius_mm=6.0, half_length_mm=4.0, edge_height_mm=2.0, width_mm=4.0)
PATH = (Leg(0.3, steps=2, duration_s=1.0), Leg(0.3, slide_x_mm=0.05, steps=2, duration_s=1.0))
SECTION = Model(
    CLIPPED, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2), PATH, object=Cylinder(radius_mm=5.0, axis="z"),
    friction=Coulomb(0.3), gauges=(Gauge("g", 0.7, 2.1, 0.0, 0.5, length_mm=1.0),), domain="plane-strain", symmetry=(),
)  # fmt: skip
SOLID = replace(SECTION, domain="solid", mesh=MeshOptions(1.2, 2.0, "swept"))
KINDS = {
    "section": SECTION,
    "solid": SOLID,
    "viscous": replace(SECTION, relaxation=Relaxation(((0.5, 1.0),), False)),
    "foils": replace(SECTION, inclusions=Foils(100.0, 0.05, 3.0)),
    "elastic object": replace(SECTION, object_compliance=ElasticObject(5.0, 0.3)),
    "force": replace(SECTION, legs=(Leg(0.3, steps=2, force_N=0.2),)),
    "large deformation": replace(SECTION, hyperelastic_law=NeoHooke(1.0)),
    "large deformation, elastic object": replace(
        SECTION, hyperelastic_law=NeoHooke(1.0), object_compliance=ElasticObject(5.0, 0.3)
    ),
    "large deformation, foils": replace(SECTION, hyperelastic_law=NeoHooke(1.0), inclusions=Foils(100.0, 0.05, 3.0)),
    "large deformation, solid": replace(SOLID, hyperelastic_law=NeoHooke(1.0)),
    "large deformation, force": replace(
        SECTION, hyperelastic_law=NeoHooke(1.0), legs=(Leg(0.3, steps=2, force_N=0.2),)
    ),
}


def read(problem: Problem, steps: Sequence[StepResult]) -> dict[str, float]:
    return press_numbers(problem, steps[-1])


def changes_of(model: Model) -> dict[str, Model]:
    """A model with one of its parts changed by 1 %."""
    design, leg = model.design, model.legs[-1]
    found = {
        "mu": replace(model, friction=Coulomb(0.303)),
        "E": replace(model, material=Isotropic(1.01, 0.3)),
        "nu": replace(model, material=Isotropic(1.0, 0.303)),
        "object": replace(model, object=Cylinder(radius_mm=5.05, axis="z")),
        "gauge": replace(model, gauges=(replace(model.gauges[0], x_mm=0.75),)),
        **{
            name: replace(model, design=replace(design, **{name: 1.01 * getattr(design, name)}))
            for name in ("radius_mm", "edge_height_mm", "width_mm")
        },
    }
    if leg.force_N is None:
        found["depth"] = replace(model, legs=tuple(replace(one, depth_mm=0.303) for one in model.legs))
    else:
        found["force"] = replace(model, legs=(replace(leg, force_N=0.202),))
    if model.object_compliance:
        found["object's E"] = replace(model, object_compliance=ElasticObject(5.05, 0.3))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_variant_is_a_press_of_its_own(kind: str) -> None:
    model = KINDS[kind]
    problem, models = build(model), changes_of(model)
    variants = press_variants(problem, list(models.values()), read)
    # presses are solved to round-off, at finite strain and to forces to a residual of 5e-9
    close = 1e-5 if model.finite_strain or model.is_under_force else 1e-8
    for name, variant in zip(models, variants, strict=True):
        assert not variant.failure, (name, variant.failure)
        changed(problem, models[name])  # the cells are shared
        if model.object_compliance and name == "object":
            continue  # its mesh is stretched, where one made anew would have other cells
        own = build(models[name])
        assert own.mesh.points.shape == problem.mesh.points.shape, name
        wanted = press_numbers(own, list(march(own))[-1])
        size = abs(wanted["normal_force_N"])
        assert variant.found == pytest.approx(wanted, rel=close, abs=close * size), name


def test_what_is_shared_follows_from_what_differs() -> None:
    problem = build(SECTION)
    models = changes_of(SECTION)
    shared = {name: changed(problem, model).condensed_body is problem.condensed_body for name, model in models.items()}
    assert {name for name, is_shared in shared.items() if is_shared} == {"mu", "object", "depth"}


def test_a_variant_that_needs_other_cells_is_meshed_anew() -> None:
    other = replace(SECTION, mesh=MeshOptions(1.0, 1.5))
    with pytest.raises(Finger3dError):
        changed(build(SECTION), other)
    (variant,) = press_variants(build(SECTION), [other], read)
    own = build(other)
    assert variant.found == pytest.approx(press_numbers(own, list(march(own))[-1]))


@pytest.mark.parametrize("kind", ["section", "large deformation"])
def test_a_variant_that_fails_leaves_the_others(kind: str) -> None:
    model = KINDS[kind]
    impossible = replace(model, legs=(*model.legs[:-1], replace(model.legs[-1], depth_mm=40.0)))
    bad, good = press_variants(build(model), [impossible, changes_of(model)["mu"]], read)
    assert bad.found is None
    assert bad.failure
    assert good.found
