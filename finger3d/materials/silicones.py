"""Table of silicones that are sold by Shore hardness, read from silicones.toml.

A property that no source gives is None; the data sheet of the product may state it.
"""

from __future__ import annotations

import difflib
import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

from finger3d.errors import Finger3dError

PSI_MPA = 6.894757e-3
"""MPa in a pound-force per square inch."""

Scale = Literal["A", "00"]


@dataclass(frozen=True)
class Mix:
    """Proportion of the two components: parts A to parts B, and what is measured, such as "weight"."""

    a: float
    b: float
    by: str

    @property
    def share_a(self) -> float:
        """Share of component A."""
        return self.a / (self.a + self.b)

    def __str__(self) -> str:
        return f"{self.a:g} A : {self.b:g} B by {self.by}"


@dataclass(frozen=True, kw_only=True)
class Silicone:
    """Silicone as the manufacturer and laboratories describe it.

    Attributes
    ----------
    name, maker : as on the data sheet
    scale, shore : Shore hardness
    modulus_100_psi : engineering stress at 100 % strain, of the manufacturer
    tangent_tension_MPa : slope of a measured tensile curve between strains 0.068 and 0.205, strain by the crosshead
    stress_100_tension_MPa : engineering stress of the same curve at 100 % strain
    modulus_compression_MPa : Young's modulus of a compression test
    modulus_fit_MPa : Young's modulus of a published hyperelastic law
    modulus_range_MPa : lowest and highest Young's modulus by cure temperature
    density_g_ml, viscosity_Pa_s : of the mixture
    mix : proportion of the components
    pot_life_min, cure_h : at 23 degrees; the cure time is that until it is taken out of the mold
    post_cure : what the source did to finish the cure, if anything
    shrinkage : upper bound of the relative shrinkage of lengths
    note : what else a caster should know
    sources : keys of `sources`
    """

    name: str
    maker: str
    scale: Scale
    shore: float
    sources: tuple[str, ...]
    modulus_100_psi: float | None = None
    tangent_tension_MPa: float | None = None
    stress_100_tension_MPa: float | None = None
    modulus_compression_MPa: float | None = None
    modulus_fit_MPa: float | None = None
    modulus_range_MPa: tuple[float, float] | None = None
    density_g_ml: float | None = None
    viscosity_Pa_s: float | None = None
    mix: Mix | None = None
    pot_life_min: float | None = None
    cure_h: float | None = None
    post_cure: str = ""
    shrinkage: float | None = None
    note: str = ""

    @property
    def modulus_100_MPa(self) -> float | None:
        """Engineering stress at 100 % strain, of the manufacturer."""
        return None if self.modulus_100_psi is None else PSI_MPA * self.modulus_100_psi


@functools.cache
def _content() -> Mapping[str, object]:
    return tomllib.loads((files("finger3d.materials") / "silicones.toml").read_text(encoding="utf-8"))


@functools.cache
def sources() -> Mapping[str, str]:
    """Return the text of every source by its key."""
    texts: Mapping[str, str] = _content()["sources"]  # type: ignore[assignment]
    return texts


@functools.cache
def silicones() -> Mapping[str, Silicone]:
    """Return every silicone by its name, in the order of the table."""
    from pydantic import TypeAdapter

    rows = TypeAdapter(list[Silicone]).validate_python(_content()["silicone"])
    return {one.name: one for one in rows}


def silicone_named(name: str) -> Silicone:
    """Return the silicone of a name; case, spaces, hyphens and a speed such as "MEDIUM" do not matter.

    Raises
    ------
    Finger3dError
        For an unknown name, with the nearest one.

    Examples
    --------
    >>> silicone_named("dragonskin 20").name
    'Dragon Skin 20'
    """
    names = {_plain(one): one for one in silicones()}
    wanted = _plain(name)
    for speed in ("", *_SPEEDS):
        if wanted.endswith(speed) and (match := names.get(wanted.removesuffix(speed))):
            return silicones()[match]
    near = difflib.get_close_matches(wanted, names, n=1, cutoff=0.5)
    hint = f'did you mean "{names[near[0]]}"? ' if near else ""
    raise Finger3dError(f"{hint}must be one of {', '.join(silicones())}; or give shore_A, shore_00 or E_MPa instead")


_SPEEDS = ("slow", "medium", "fast", "veryfast", "a")
"""Suffixes of names that state the speed of the cure, or the scale of the hardness."""


def _plain(name: str) -> str:
    return "".join(c for c in name.casefold() if c.isalnum())
