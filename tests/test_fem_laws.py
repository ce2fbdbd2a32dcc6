"""Laws of materials: linear elasticity, hyperelastic laws, relaxation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.base import least_stiffness, unstable_from
from finger3d.fem.laws.invariants import Derivatives, InvariantLaw
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.objects import Plane
from tests.energies import energy
from tests.models import marched
from tests.viscous_cases import RAMP_AND_HOLD, TWO, block, mean_relaxation, viscous


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_uniaxial_stress_follows_hookes_law(nu: float) -> None:
    strain = np.diag([1.0, -nu, -nu])[None] * 1e-3
    np.testing.assert_allclose(Isotropic(2.0, nu).elasticity().stress(strain)[0], np.diag([2e-3, 0.0, 0.0]), atol=1e-15)


@pytest.mark.parametrize("dim", [2, 3])
def test_element_matrices_are_the_contraction_with_the_stress(dim: int) -> None:
    law, rng = Isotropic(2.0, 0.3).elasticity(), np.random.default_rng(0)
    gradients = rng.normal(size=(4, dim))
    cell = law.contract(np.einsum("am,bn->ambn", gradients, gradients)[None])[0]
    u, v = rng.normal(size=(2, 4, dim))
    strains = [0.5 * ((w.T @ gradients) + (w.T @ gradients).T) for w in (u, v)]
    energy = np.einsum("ij,ij->", law.stress(strains[0][None])[0], strains[1])
    assert np.einsum("ai,aibj,bj->", v, cell, u) == pytest.approx(energy)


G = 0.7
LAWS: dict[str, IsochoricLaw] = {
    "neo-Hooke": NeoHooke(G),
    "Mooney-Rivlin": MooneyRivlin(G, 0.2),
    "Yeoh": Yeoh(G, -0.02, 2e-3),
    # shares mu alpha / 2 G of Ogden's fit to Treloar's data (Ogden 1972): mu = 6.3, 0.012, -0.1; alpha = 1.3, 5, -2
    "Ogden": Ogden(G, ((8.19 / 8.45, 1.3), (0.06 / 8.45, 5.0), (0.2 / 8.45, -2.0))),
}


@dataclass(frozen=True)
class Polynomial(InvariantLaw):
    """A law that depends on both invariants, and not linearly on the first, as none of the package does."""

    is_stable = True

    def of_invariants(self, x1: np.ndarray, x2: np.ndarray) -> np.ndarray:
        a, b = x1 - 3.0, x2 - 3.0
        return self.shear * (0.3 * a + 0.2 * b + 0.02 * a**2)

    def derivatives(self, x1: np.ndarray, x2: np.ndarray) -> Derivatives:
        one = np.full_like(x1, self.shear)
        return Derivatives(one * (0.3 + 0.04 * (x1 - 3.0)), 0.2 * one, 0.04 * one)


EACH = LAWS | {"polynomial": Polynomial(G)}


@pytest.fixture(params=EACH.values(), ids=EACH.keys())
def law(request: pytest.FixtureRequest) -> IsochoricLaw:
    return request.param


def gradients(count: int = 6) -> np.ndarray:
    """Deformation gradients with stretches from 0.6 to 1.6, and some with equal or nearly equal stretches."""
    rng = np.random.default_rng(0)
    left, right = (np.linalg.qr(rng.normal(size=(count, 3, 3)))[0] for _ in range(2))
    left, right = (q * np.linalg.det(q)[:, None, None] for q in (left, right))
    stretches = rng.uniform(0.6, 1.6, size=(count, 3))
    stretches[0], stretches[1], stretches[2] = (1.0, 1.0, 1.0), (1.3, 1.3, 0.7), (1.3, 1.3 * (1.0 + 1e-9), 0.7)
    return left @ (stretches[:, :, None] * right)


def incompressible(law: IsochoricLaw, stretches: tuple[float, float, float], free: int) -> float:
    """Nominal stress along the first axis of an incompressible body whose axis `free` bears no stress."""
    f = np.diag(stretches)
    stress = law.stress(f)
    return float(stress[0, 0] - stress[free, free] * f[free, free] / f[0, 0])


def test_stress_is_the_derivative_of_the_energy_and_tangent_that_of_the_stress(law: IsochoricLaw) -> None:
    f, step = gradients(), 1e-6
    stress, tangent = law.stress_and_tangent(f)
    assert np.abs(law.stress(f) - stress).max() < 1e-14
    for i in range(3):
        for j in range(3):
            change = np.zeros((3, 3))
            change[i, j] = step
            by_energy = (energy(law, f + change) - energy(law, f - change)) / (2.0 * step)
            by_stress = (law.stress(f + change) - law.stress(f - change)) / (2.0 * step)
            assert np.abs(by_energy - stress[:, i, j]).max() < 1e-8 * G  # round-off 1e-16 / 1e-6, and step^2
            assert np.abs(by_stress - tangent[:, :, :, i, j]).max() < 1e-7 * G


def test_tangent_at_rest_is_the_linear_deviator(law: IsochoricLaw) -> None:
    one = np.eye(3)
    linear = np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)
    linear -= 2.0 / 3.0 * np.einsum("ij,kl->ijkl", one, one)
    stress, tangent = law.stress_and_tangent(one)
    assert np.abs(tangent - G * linear).max() < 1e-14
    assert np.abs(stress).max() < 1e-15


def test_objectivity_isotropy_and_volume(law: IsochoricLaw) -> None:
    f = gradients()
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert np.abs(law.stress(turn @ f) - turn @ law.stress(f)).max() < 1e-14
    assert np.abs(law.stress(f @ turn) - law.stress(f) @ turn).max() < 1e-14
    assert np.abs(energy(law, 1.7 * f) - energy(law, f)).max() < 1e-14
    assert np.abs(np.einsum("nij,nij->n", law.stress(f), f)).max() < 1e-14  # no work on a change of volume


@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.5])
def test_closed_forms(stretch: float) -> None:
    c1, c2 = 0.5 * G * 0.8, 0.5 * G * 0.2
    constants = [(2.0 * share * G / a, a) for share, a in LAWS["Ogden"].terms]

    def yeoh(i1: float) -> float:
        return 0.5 * G * (1.0 - 0.04 * (i1 - 3.0) + 6e-3 * (i1 - 3.0) ** 2)

    i1 = {"uniaxial": stretch**2 + 2 / stretch, "equibiaxial": 2 * stretch**2 + stretch**-4}
    i1["pure shear"] = stretch**2 + 1.0 + stretch**-2
    modes = {
        "uniaxial": ((stretch, stretch**-0.5, stretch**-0.5), stretch - stretch**-2, 1.0 / stretch, -0.5),
        "equibiaxial": ((stretch, stretch, stretch**-2), stretch - stretch**-5, stretch**2, -2.0),
        "pure shear": ((stretch, 1.0, 1.0 / stretch), stretch - stretch**-3, 1.0, -1.0),
    }
    for mode, (stretches, shape, second, power) in modes.items():
        # Treloar 1975, ch. 4: P = 2 (W_1 + q W_2) (l - ...) with q = 1/l, l^2, 1; Ogden 1972: mu (l^(a-1) - l^(k a-1))
        want = {
            "neo-Hooke": G * shape,
            "Mooney-Rivlin": 2.0 * (c1 + second * c2) * shape,
            "Yeoh": 2.0 * yeoh(i1[mode]) * shape,
            "Ogden": sum(mu * (stretch ** (a - 1.0) - stretch ** (power * a - 1.0)) for mu, a in constants),
        }
        for name, law in LAWS.items():
            assert incompressible(law, stretches, free=2) == pytest.approx(want[name], rel=1e-12)


def test_special_cases_of_ogdens_law() -> None:
    f = gradients()
    pairs = [(NeoHooke(G), Ogden(G, ((1.0, 2.0),))), (MooneyRivlin(G, 0.3), Ogden(G, ((0.7, 2.0), (0.3, -2.0))))]
    for known, ogden in pairs:
        for a, b in zip(known.stress_and_tangent(f), ogden.stress_and_tangent(f), strict=True):
            assert np.abs(a - b).max() < 1e-13
    with pytest.raises(Finger3dError, match="terms: .* 0.9"):
        Ogden(G, ((0.9, 2.0),))


@pytest.mark.parametrize("alpha", [1e-3, 1e-9, -1e-9])
def test_ogdens_law_with_a_vanishing_exponent_is_that_of_hencky(alpha: float) -> None:
    """mu (l^alpha - 1) -> 2 G ln l, whatever mu = 2 G / alpha is; corrections are of the order of alpha."""
    stretches = np.array([1.5, 0.8, 1.0 / 1.2])
    left, _, right = np.linalg.svd(gradients()[3])
    f = left @ (stretches[:, None] * right)
    law, logs = Ogden(G, ((1.0, alpha),)), np.log(stretches)
    wanted = left @ ((2.0 * G * logs / stretches)[:, None] * right)
    assert np.abs(law.stress(f) - wanted).max() < max(abs(alpha), 1e-14)
    assert float(energy(law, f)) == pytest.approx(G * (logs**2).sum(), rel=max(abs(alpha), 1e-14))
    stress, tangent = law.stress_and_tangent(f)
    step = 1e-6 * np.random.default_rng(2).normal(size=(3, 3))
    slope = (law.stress(f + step) - law.stress(f - step)) / 2.0
    assert np.abs(np.einsum("ijkl,kl->ij", tangent, step) - slope).max() < 1e-14
    assert np.abs(stress - law.stress(f)).max() < 1e-15


def test_stability() -> None:
    rest = np.ones((1, 3))
    for law in LAWS.values():
        assert least_stiffness(law, rest)[0] == pytest.approx(1.0, abs=1e-14)
    for name in ("neo-Hooke", "Mooney-Rivlin", "Ogden"):
        assert LAWS[name].is_stable
        assert unstable_from(LAWS[name]) == {}
    falling = Yeoh(G, -0.05, 0.0)
    assert not falling.is_stable
    found = unstable_from(falling)
    # uniaxial tension, strains (e, -e/2, -e/2): W = c1 (x + c x^2) of x = exp(2 e) + 2 exp(-e) - 3, c = -0.05; its
    # second derivative along e vanishes first, since across it x is stationary and W' = 0 only later
    e = np.log1p(found["uniaxial tension"])
    x, slope = np.exp(2.0 * e) + 2.0 * np.exp(-e) - 3.0, 2.0 * (np.exp(2.0 * e) - np.exp(-e))
    bend = 4.0 * np.exp(2.0 * e) + 2.0 * np.exp(-e)
    assert (1.0 - 0.1 * x) * bend - 0.1 * slope**2 == pytest.approx(0.0, abs=1e-9)
    assert found["uniaxial tension"] > 0.0 > found["uniaxial compression"]


def test_uniform_compression_relaxes_as_the_series_says() -> None:
    # nu = 0 under a flat plate: a bar, stress = E int r(t - s) d'(s) ds / h
    problem = build(block(material=Isotropic(2.0, 0.0), object=Plane(), friction=Coulomb(0.0), legs=RAMP_AND_HOLD))
    held = viscous(problem)
    for frame in marched(held):
        t = frame.target.time_s
        mean = mean_relaxation(TWO, np.array(max(t - 1.0, 0.0)), np.array(t)) * min(t, 1.0)
        stress = 2.0 * 0.3 / 3.0 * float(mean)
        pressure = frame.state.force[:, 0] / problem.points.area
        assert pressure == pytest.approx(stress, rel=1e-9)
        _, strain, sigma = formulation_of(held.model).fields(held, frame.meshed_state)
        assert sigma[:, 1, 1] == pytest.approx(-stress, rel=1e-9)
        assert strain[:, 1, 1] == pytest.approx(-min(t, 1.0) * 0.1, rel=1e-9)
