"""The isotropic material and its linear elastic law."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.laws.material import Isotropic


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_uniaxial_stress_follows_hookes_law(nu: float) -> None:
    strain = np.diag([1.0, -nu, -nu])[None] * 1e-3
    np.testing.assert_allclose(Isotropic(2.0, nu).elasticity().stress(strain)[0], np.diag([2e-3, 0.0, 0.0]), atol=1e-15)


def test_plane_stress_leaves_no_stress_across_the_section() -> None:
    material, strain = Isotropic(2.0, 0.3), np.array([[[1e-3, 2e-4], [2e-4, -5e-4]]])
    stress = material.elasticity(plane_stress=True).stress(strain)
    across, none = material.across(strain, stress, plane_strain=False)
    whole = np.zeros((1, 3, 3))
    whole[:, :2, :2], whole[:, 2, 2] = strain, across
    assert none[0] == 0.0
    full = material.elasticity().stress(whole)[0]
    np.testing.assert_allclose(full[:2, :2], stress[0], rtol=1e-12)
    assert abs(full[2, 2]) < 1e-15


def test_stress_across_plane_strain_is_that_of_the_solid() -> None:
    material, strain = Isotropic(2.0, 0.3), np.array([[[1e-3, 2e-4], [2e-4, -5e-4]]])
    whole = np.zeros((1, 3, 3))
    whole[:, :2, :2] = strain
    none, across = material.across(strain, material.elasticity().stress(strain), plane_strain=True)
    assert none[0] == 0.0
    assert across[0] == pytest.approx(material.elasticity().stress(whole)[0, 2, 2])


@pytest.mark.parametrize("dim", [2, 3])
def test_element_matrices_are_the_contraction_with_the_stress(dim: int) -> None:
    law, rng = Isotropic(2.0, 0.3).elasticity(), np.random.default_rng(0)
    gradients = rng.normal(size=(4, dim))
    cell = law.contract(np.einsum("am,bn->ambn", gradients, gradients)[None])[0]
    u, v = rng.normal(size=(2, 4, dim))
    strains = [0.5 * ((w.T @ gradients) + (w.T @ gradients).T) for w in (u, v)]
    energy = np.einsum("ij,ij->", law.stress(strains[0][None])[0], strains[1])
    assert np.einsum("ai,aibj,bj->", v, cell, u) == pytest.approx(energy)


def test_a_nearly_incompressible_body_is_mixed_but_in_plane_stress() -> None:
    material = Isotropic(1.0, 0.5)
    assert material.is_nearly_incompressible
    assert material.elasticity().mixed
    assert not material.elasticity(plane_stress=True).mixed
