"""Fingers of several parts: equal parts are one body, rigid is the limit of stiff, and a layered half-space."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from finger3d._types import Float
from finger3d.accuracy.estimate import estimate, main_numbers
from finger3d.contact.friction import Coulomb
from finger3d.effects import effect_type
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import RIGID_RATIO, Isotropic, elasticity_of
from finger3d.fem.mesh import quadratic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.readings import Taxel
from tests.meshes import full, grid
from tests.models import last, marched
from validation._common import side_load

BODY = Isotropic(0.5, 0.45)
EFFECTS: dict[str, dict[str, Any]] = {
    "none": {},
    "elastic_object": {"E_MPa": 2.0, "nu": 0.4},
    "embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 2.0},
    "large_deformation": {},
    "viscosity": {"prony": ((0.3, 0.5),)},
    "viscosity of the shear modulus": {"prony": ((0.3, 0.5),), "bulk": False},
}


def tip(effect: str = "none", domain: str = "plane-strain", **changes: object) -> Model:
    """A fingertip with skin and core."""
    finger = designs()["fingertip"](
        radius_mm=5.0, half_length_mm=4.0, edge_height_mm=4.0, width_mm=8.0, skin_mm=0.5, core_half_length_mm=1.5,
        core_height_mm=3.0,
    )  # fmt: skip
    mesh = MeshOptions(0.8 if domain == "solid" else 0.3, 1.0, "swept")
    model = Model(
        finger, BODY, mesh, (Leg(0.5, steps=3, duration_s=1.0),), friction=Coulomb(0.3),
        gauges=(Gauge("g", 1.0, 4.0, angle=0.5, length_mm=0.5),), domain=domain,
    )  # fmt: skip
    model = replace(model, **changes)
    return model if effect == "none" else effect_type(effect.split(" ")[0])(**EFFECTS[effect]).apply(model)


def numbers(model: Model) -> Float:
    """Force, friction and gauge at the end of a press."""
    problem = build(model)
    step = marched(problem)[-1]
    return np.array([step.state.force[:, 0].sum(), *step.gauges.values(), step.dissipation_mJ])


@pytest.mark.parametrize("effect", EFFECTS)
def test_parts_of_equal_material_are_one_body(effect: str) -> None:
    # Below nu = 0.48 the unknowns are the same, and so is all but round-off.
    parts = (("skin", BODY), ("core", BODY))
    np.testing.assert_allclose(numbers(tip(effect, parts=parts)), numbers(tip(effect)), rtol=1e-8)


@pytest.mark.parametrize("effect", ["none", "viscosity of the shear modulus"])
def test_incompressible_parts_of_equal_material_differ_by_their_pressures_at_interfaces_only(effect: str) -> None:
    # The pressure may jump at interfaces, which adds unknowns: the difference is an error of discretisation.
    body = Isotropic(0.5, 0.499)
    one, two = (numbers(tip(effect, material=body, parts=parts)) for parts in ((), (("skin", body), ("core", body))))
    np.testing.assert_allclose(two, one, rtol=0.01)


@pytest.mark.parametrize("effect", ["none", "large_deformation"])
def test_a_rigid_part_is_the_limit_of_a_stiff_one(effect: str) -> None:
    # The core takes a share of the compliance proportional to 1 / E, so the difference falls in proportion.
    ratios = np.array([1e2, 1e3, RIGID_RATIO])
    forces = [numbers(tip(effect, parts=(("core", Isotropic(0.5 * ratio, 0.3)),)))[0] for ratio in ratios]
    off = 1.0 - np.array(forces[:2]) / forces[2]
    assert 0.0 < off[1] < off[0] < 0.1
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("domain", ["plane-strain", "plane-stress"])
@pytest.mark.parametrize("effect", ["large_deformation", "viscosity"])
def test_a_part_of_steel_in_silicone_settles_at_large_deformation(domain: str, effect: str) -> None:
    model = tip(effect, domain=domain, legs=(Leg(0.02, steps=3, duration_s=1.0),))
    model = model if effect == "large_deformation" else LargeDeformation().apply(model)
    rigid, steel = (
        numbers(replace(model, parts=(("core", Isotropic(0.5 * ratio, 0.3)),))) for ratio in (RIGID_RATIO, 1e7)
    )
    np.testing.assert_allclose(steel, rigid, rtol=5e-5)  # forces deviate by some 2e-5 at RIGID_RATIO


def test_a_solid_with_a_stiff_core_is_stiffer_and_settles_with_friction() -> None:
    stiff = last(tip(domain="solid", parts=(("core", Isotropic(50.0, 0.3)),)))
    assert stiff["normal_force_N"] > 1.05 * last(tip(domain="solid"))["normal_force_N"]


def test_error_bars_know_the_jump_of_strain_at_an_interface() -> None:
    parts = (("skin", Isotropic(5.0, 0.3)), ("core", Isotropic(50.0, 0.3)))
    coarse = build(tip(parts=parts, mesh=MeshOptions(0.4, 1.0, "swept")))
    steps = marched(coarse)
    exact = last(tip(parts=parts, mesh=MeshOptions(0.1, 0.25, "swept")))["normal_force_N"]
    bar = estimate(coarse, steps).discretisation["normal_force_N"]
    error = abs(main_numbers(coarse, steps[-1])["normal_force_N"] - exact)
    assert error < 2.0 * bar < 0.2 * exact


def test_foils_in_two_parts_are_refused_by_their_names() -> None:
    gauges = (Gauge("low", 0.0, 2.0, length_mm=0.5), Gauge("high", 0.0, 3.9, length_mm=0.5))
    with pytest.raises(Finger3dError, match=r"effects\.embedded_gauge.*low.*high"):
        build(tip("embedded_gauge", gauges=gauges, parts=(("core", Isotropic(5.0, 0.3)),)))


def layered_compliance(k: float, thickness: float, layer: Isotropic, below: Isotropic) -> float:
    """Surface displacement (mm) under the pressure cos(k x) of 1 MPa on a layer bonded to a half-space, plane strain.

    Airy's stress function f(y) cos(k x), with f = (A + B y) exp(-k y) + (C + D y) exp(k y) in the layer and
    (E + F y) exp(-k y) below it; the six constants follow from tractions at the surface and continuity at the interface
    (Johnson, Contact Mechanics, 1985, section 5.8, after Burmister 1945).
    """

    def derivatives(y: float, sign: float) -> Float:
        """f, f', f'', f''' (4, 2) of exp(s k y) and of y exp(s k y)."""
        s = sign * k
        power = np.arange(4)
        at = np.exp(s * y)
        return np.stack([s**power * at, (s**power * y + power * s ** np.maximum(power - 1, 0)) * at], axis=1)

    def displacements(f: Float, body: Isotropic) -> Float:
        shear = body.E_MPa / (2.0 * (1.0 + body.nu))
        along = (1.0 - body.nu) * f[2] / k + body.nu * k * f[0]
        across = (1.0 - body.nu) * f[3] / k**2 - (2.0 - body.nu) * f[1]
        return np.stack([along, across]) / (2.0 * shear)

    def both(y: float) -> Float:
        return np.hstack([derivatives(y, -1.0), derivatives(y, 1.0)])

    top, seam, deep = both(0.0), both(thickness), derivatives(thickness, -1.0)
    rows = np.zeros((6, 6))
    rows[:2, :4] = top[:2]
    rows[2:4, :4], rows[2:4, 4:] = seam[:2], -deep[:2]
    rows[4:, :4], rows[4:, 4:] = displacements(seam, layer), -displacements(deep, below)
    constants = np.linalg.solve(rows, [1.0 / k**2, 0.0, 0.0, 0.0, 0.0, 0.0])
    return float(displacements(top @ constants[:4], layer)[1])


def test_the_closed_form_of_equal_layers_is_that_of_a_half_space() -> None:
    # 2 (1 - nu^2) p / (E k), Johnson 1985, Eq. 13.6
    body = Isotropic(2.0, 0.3)
    assert layered_compliance(1.5, 0.7, body, body) == pytest.approx(2.0 * (1.0 - 0.09) / (2.0 * 1.5), rel=1e-12)


@pytest.mark.parametrize("materials", [(BODY, Isotropic(5.0, 0.3)), (Isotropic(5.0, 0.3), Isotropic(0.5, 0.499))])
def test_a_skin_on_a_half_space_gives_way_as_the_layered_closed_form_says(
    materials: tuple[Isotropic, Isotropic],
) -> None:
    # Half a wavelength of 2 mm between lines of symmetry, 3 wavelengths deep: exp(-k depth) is 1e-8.
    k, thickness, depth = np.pi, 0.25, 6.0
    below, layer = materials[::-1]
    errors = []
    for count in (4, 8):
        mesh = grid((count, 5 * count))
        y = mesh.points[:, 1] * 5.0  # four fifths of the rows lie below the layer, graded towards it
        below_layer = (depth - thickness) * (1.0 - np.clip(1.0 - y / 4.0, 0.0, 1.0) ** 2.5)
        height = np.where(y <= 4.0, below_layer, depth - thickness * (5.0 - y))
        points = np.stack([mesh.points[:, 0], height], axis=1)
        part = (y[mesh.cells].mean(axis=1) > 4.0).astype(np.int64)
        body = quadratic(replace(mesh, points=points, part=part, part_labels=("skin",)))
        matrix = full(stiffness(body, elasticity_of((below, layer), body, False)).upper)
        pressure = side_load(body, "y+", lambda at: np.stack([np.zeros(len(at)), -np.cos(k * at[:, 0])], axis=1))
        load = np.zeros(matrix.shape[0])
        load[: pressure.size] = pressure.ravel()
        sides = np.flatnonzero((body.points[:, 0] == 0.0) | (body.points[:, 0] == 1.0))
        fixed = np.union1d(2 * sides, np.flatnonzero(body.points[:, 1] == 0.0)[:, None] * 2 + np.arange(2))
        free = np.setdiff1d(np.arange(len(load)), fixed)
        u = np.zeros(len(load))
        u[free] = spsolve(sp.csc_matrix(matrix[free][:, free]), load[free])
        corner = int(np.argmin(np.abs(body.points - [0.0, depth]).sum(axis=1)))
        errors.append(abs(-u[2 * corner + 1] / layered_compliance(k, thickness, layer, below) - 1.0))
    assert errors[1] < 5e-3
    assert errors[0] / errors[1] > 2.0**2.5  # quadratic elements: order 3 to 4 in the mean


@pytest.mark.parametrize(("ratio", "beside"), [(RIGID_RATIO, 6.58e-3), (20.0, 1.31e-2)])
def test_taxels_beside_a_stiff_core_on_the_base(ratio: float, beside: float) -> None:
    """The traction jumps by a factor of 10 at the core's edge; the value is that of edges of 0.025 mm."""
    taxels = Taxel("beside", 2.0, 0.0, 1.0, 1.0), Taxel("away", 3.25, 0.0, 1.5, 1.0), Taxel("core", 0.75, 0.0, 1.5, 1.0)
    mesh, core = MeshOptions(0.2, 0.4, "swept"), (("core", Isotropic(0.5 * ratio, 0.3)),)
    problem = build(tip(mesh=mesh, taxels=taxels, legs=(Leg(0.5, steps=1),), parts=core))
    step = marched(problem)[-1]
    assert step.taxels["beside"] == pytest.approx(beside, rel=0.04)
    lengths = {"beside": 1.0, "away": 1.5, "core": 1.5}
    force = 2.0 * 8.0 * sum(lengths[name] * pressure for name, pressure in step.taxels.items())
    assert force == pytest.approx(float(step.state.force[:, 0].sum()), rel=1e-9)
