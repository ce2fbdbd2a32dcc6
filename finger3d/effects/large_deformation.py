"""Finite strain with a hyperelastic law, and contact conditions on the deformed surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Ge, Le, MinLen

from finger3d._ranges import Share
from finger3d.effects import fill
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.base import unstable_from
from finger3d.mechanics.model import Model

_TABLE = "effects.large_deformation"

CONSTANTS = {
    "neo-hookean": (),
    "mooney-rivlin": ("c01_share",),
    "yeoh": ("c2_over_c1", "c3_over_c1"),
    "ogden": ("terms",),
}
"""Keys of every law."""

_LEAST_STABLE_STRAIN = 0.05
"""Constants are refused if they make a law unstable below this nominal strain in one of the usual tests."""

Ratio = Annotated[float, Ge(-100), Le(100)]
Exponent = Annotated[float, Ge(-50), Le(50)]


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.large_deformation].

    E_MPa and nu are those of small strain for every law; the volumetric part is K/2 (J - 1)^2, the invariants are those
    of J^(-1/3) F.

    Attributes
    ----------
    law : neo-Hookean, G/2 (I1 - 3); Mooney-Rivlin, c10 (I1 - 3) + c01 (I2 - 3); Yeoh, sum of c_i (I1 - 3)^i; Ogden, sum
        of mu / alpha (l1^alpha + l2^alpha + l3^alpha - 3)
    c01_share : mooney-rivlin: c01 over c10 + c01
    c2_over_c1, c3_over_c1 : yeoh
    terms : ogden: [share of the shear modulus, alpha], ...; the shares sum to 1
    """

    slot: ClassVar[str] = "hyperelastic_law"

    law: Literal["neo-hookean", "mooney-rivlin", "yeoh", "ogden"] = "neo-hookean"
    c01_share: Share | None = None
    c2_over_c1: Ratio | None = None
    c3_over_c1: Ratio | None = None
    terms: Annotated[tuple[tuple[Ratio, Exponent], ...], MinLen(1)] | None = None

    def apply(self, model: Model) -> Model:
        """Set the hyperelastic law of the model."""
        law = self.isochoric_law()
        for mode, strain in {} if law.is_stable else unstable_from(law).items():
            if abs(strain) < _LEAST_STABLE_STRAIN:
                keys = " and ".join(f"{_TABLE}.{key}" for key in CONSTANTS[self.law])
                raise Finger3dError(
                    f"{keys}: with these constants the stress falls from a nominal strain of {strain:.2g} in {mode}; "
                    "choose constants that are stable further"
                )
        return fill(model, "hyperelastic_law", law, "large_deformation")

    def isochoric_law(self) -> IsochoricLaw:
        """Return the law with a shear modulus of 1 MPa; a key that is missing, or of another law, is refused."""
        given = {key: getattr(self, key) for keys in CONSTANTS.values() for key in keys}
        for key, value in given.items():
            own = key in CONSTANTS[self.law]
            if own and value is None:
                raise Finger3dError(f'{_TABLE}.{key} is missing: law = "{self.law}" needs it')
            if not own and value is not None:
                law = next(name for name, keys in CONSTANTS.items() if key in keys)
                raise Finger3dError(f'{_TABLE}.{key}: only for law = "{law}"; take it out, or change the law')
        match self.law:
            case "mooney-rivlin":
                return MooneyRivlin(1.0, given["c01_share"])
            case "yeoh":
                return Yeoh(1.0, given["c2_over_c1"], given["c3_over_c1"])
            case "ogden":
                return Ogden(1.0, tuple(tuple(term) for term in given["terms"]))
        return NeoHooke(1.0)
