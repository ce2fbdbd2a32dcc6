"""Bodies and paths that differ by a tolerance."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.analyses.calibrate.variations import deeper, poisson_steps, tilted_mesh, with_modulus
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import MIXED_FROM, Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions
from tests.models import block

COARSE = block(mesh=MeshOptions(1.5, 1.5, "swept"), gauges=(Gauge("g", 1.0, 1.5, length_mm=1.0),))


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


def test_a_tilted_body_has_a_coarser_swept_mesh() -> None:
    fine = build(replace(COARSE, mesh=MeshOptions(0.01, 1.0, "swept"), domain="plane-strain"))
    options = tilted_mesh(fine)
    assert options == MeshOptions(0.02, 2.0, "swept")
    coarse = build(replace(COARSE, domain="plane-strain"))
    assert tilted_mesh(coarse) == MeshOptions(1.5, 1.5, "swept")
