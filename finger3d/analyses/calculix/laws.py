"""Cards of CalculiX for the elastic laws of this project.

Sources: CalculiX CrunchiX user's manual 2.20, keywords *ELASTIC and *HYPERELASTIC.  Its energies are those of the
isochoric invariants, with the volumetric part (J - 1)^2 / D1; hence D1 = 2 / K.
"""

from __future__ import annotations

from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.solids.material import Isotropic, Material

MOST_TERMS = 3
"""Largest number of terms of Ogden's law in CalculiX."""

_NO_TERM = 1e12
"""Compressibility D_k, over D_1, of a volumetric term (J - 1)^2k / D_k that is left out: CalculiX takes 0 for a value
that is not given, and puts in one of its own."""

_ONE_CARD = 8  # constants on a line of a deck


def law_cards(material: Material, law: IsochoricLaw | None) -> tuple[str, ...]:
    """Return the cards of a material: linear elasticity without a hyperelastic `law`.

    Raises
    ------
    Finger3dError
        If CalculiX has no such law.
    """
    own = material.isotropic("--solver calculix")
    if own.nu >= 0.5:
        raise Finger3dError(
            "--solver calculix: CalculiX has no elements for nu = 0.5; lower material.nu, for instance to 0.49"
        )
    if law is None:
        return ("*ELASTIC", f"{own.E_MPa:.12g}, {own.nu:.12g}")
    return _hyperelastic(law.with_shear(_shear(own)), 2.0 / _bulk(own))


def _shear(material: Isotropic) -> float:
    return material.E_MPa / (2.0 * (1.0 + material.nu))


def _bulk(material: Isotropic) -> float:
    return material.E_MPa / (3.0 * (1.0 - 2.0 * material.nu))


def _hyperelastic(law: IsochoricLaw, d1: float) -> tuple[str, ...]:
    match law:
        case NeoHooke():
            return _cards("NEO HOOKE", [0.5 * law.shear, d1])
        case MooneyRivlin():
            half = 0.5 * law.shear
            return _cards("MOONEY-RIVLIN", [half * (1.0 - law.c01_share), half * law.c01_share, d1])
        case Yeoh():
            c1 = 0.5 * law.shear
            return _cards("YEOH", [c1, c1 * law.c2_over_c1, c1 * law.c3_over_c1, d1, *2 * [_NO_TERM * d1]])
        case Ogden() if len(law.terms) <= MOST_TERMS:
            # CalculiX sums 2 mu / alpha^2 (l1^alpha + ...); this project mu / alpha (...) with mu = 2 share G / alpha
            terms = [number for share, alpha in law.terms for number in (share * law.shear, alpha)]
            return _cards(f"OGDEN, N={len(law.terms)}", [*terms, d1, *(len(law.terms) - 1) * [_NO_TERM * d1]])
        case Ogden():
            raise Finger3dError(
                f"--solver calculix: effects.large_deformation.terms: CalculiX has Ogden's law with up to {MOST_TERMS} "
                f"terms, and the scene {len(law.terms)}"
            )
    raise Finger3dError(f"--solver calculix: CalculiX has no equal of effects.large_deformation's {type(law).__name__}")


def _cards(name: str, constants: list[float]) -> tuple[str, ...]:
    text = [f"{c:.12g}" for c in constants]
    lines = [", ".join(text[i : i + _ONE_CARD]) for i in range(0, len(text), _ONE_CARD)]
    return (f"*HYPERELASTIC, {name}", *lines)
