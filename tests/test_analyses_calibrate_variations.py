"""Bodies and paths that differ by a tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.analyses.calibrate.variations import deeper, poisson_steps, tilted_mesh, with_modulus, with_plane
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import MIXED_FROM, Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings.reading import Taxel
from finger3d.objects import Plane
from tests.models import block

COARSE = block(mesh=MeshOptions(1.5, 1.5, "swept"), gauges=(Gauge("g", 1.0, 1.5, length_mm=1.0),))


@pytest.mark.parametrize(
    "model",
    [
        COARSE,
        replace(COARSE, taxels=(Taxel("t", 0.5, 0.0, 2.0, 1.0),)),
        ElasticObject(10.0, 0.3).apply(replace(COARSE, object=Plane())),
        Foil(3000.0, 0.02, 1.0).apply(COARSE),
    ],
    ids=["plain", "taxel", "elastic object", "foil"],
)
def test_a_body_of_another_modulus_is_the_body_built_with_it(model: Model) -> None:
    problem = with_modulus(build(model), 1.25)
    wanted = build(replace(model, material=replace(model.material, E_MPa=1.25)))
    assert problem.delassus == pytest.approx(wanted.delassus, rel=1e-7, abs=1e-9 * np.abs(wanted.delassus).max())
    rows = wanted.system.reading_rows
    assert problem.system.reading_rows == pytest.approx(rows, rel=1e-6, abs=1e-8 * np.abs(rows).max())
    if wanted.system.object_share is not None:
        assert problem.system.object_share == pytest.approx(wanted.system.object_share, rel=1e-6)


@pytest.mark.parametrize("large", [False, True], ids=["small strain", "finite strain"])
def test_the_moduli_of_all_parts_are_multiplied(large: bool) -> None:
    finger = designs()["block"](half_length_mm=3.0, height_mm=3.0, width_mm=2.0, skin_mm=1.0)
    model = replace(COARSE, design=finger, domain="plane-strain", gauges=(), parts=(("skin", Isotropic(3.0, 0.3)),))
    base = build(LargeDeformation().apply(model) if large else model)
    (*_, soft), (*_, stiff) = march(base), march(with_modulus(base, 1.25))
    assert stiff.state.force == pytest.approx(1.25 * soft.state.force, rel=1e-6, abs=1e-9)


def test_a_deeper_path_leaves_first_touch_where_it_is() -> None:
    legs = (Leg(0.3), Leg(0.3, 1.0), Leg(0.0))
    assert [leg.depth_mm for leg in deeper(legs, 0.1)] == pytest.approx([0.4, 0.4, 0.0])
    assert deeper(legs, 0.1)[1].slide_x_mm == 1.0


@pytest.mark.parametrize(
    ("nu", "steps"),
    [
        (0.45, (-0.008, 0.008)), (0.49, (-0.008, 0.008)), (0.005, (0.008, 0.016)), (0.5, (-0.008, -0.016)),
        (MIXED_FROM, (0.008, 0.016)), (MIXED_FROM - 0.001, (-0.008, -0.016)), (0.487, (0.0065, 0.013)),
    ],
)  # fmt: skip
def test_poissons_ratio_keeps_its_range_and_its_element(nu: float, steps: tuple[float, float]) -> None:
    assert poisson_steps(nu, 0.008) == pytest.approx(steps, rel=1e-6)


@pytest.mark.parametrize("soft", [False, True], ids=["rigid plane", "elastic plane"])
def test_a_body_under_a_plane_of_another_tilt_is_the_body_built_with_it(soft: bool) -> None:
    model = replace(COARSE, domain="plane-strain", object=Plane(tilt=0.02))
    model = ElasticObject(10.0, 0.3).apply(model) if soft else model
    *_, kept = march(with_plane(build(model, margin=np.inf), Plane(tilt=-0.02)))
    *_, wanted = march(build(replace(model, object=Plane(tilt=-0.02)), margin=np.inf))
    assert kept.named_readings == pytest.approx(wanted.named_readings, rel=1e-7)


def test_a_tilted_body_has_a_coarser_swept_mesh() -> None:
    fine = build(replace(COARSE, mesh=MeshOptions(0.01, 1.0, "swept"), domain="plane-strain"))
    options = tilted_mesh(fine)
    assert options == MeshOptions(0.02, 2.0, "swept")
    coarse = build(replace(COARSE, domain="plane-strain"))
    assert tilted_mesh(coarse) == MeshOptions(1.5, 1.5, "swept")
