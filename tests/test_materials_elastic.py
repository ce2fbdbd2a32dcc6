"""Elastic constants from the keys of a table."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.materials.elastic import NU, ElasticConstants, elastic_constants
from finger3d.materials.modulus import SPREAD_00, modulus_of_shore_00, youngs_modulus
from finger3d.materials.silicones import silicone_named


def test_a_modulus_that_is_given_is_exact() -> None:
    found = elastic_constants({"E_MPa": 2, "nu": 0.3, "shore_A": None})
    assert found == ElasticConstants(2.0, 0.3, None, "given")
    assert str(found) == "2 MPa, given"


def test_a_silicone_brings_modulus_spread_and_origin() -> None:
    found = elastic_constants({"silicone": "ecoflex 00-30"})
    wanted = youngs_modulus(silicone_named("Ecoflex 00-30"))
    assert (found.E_MPa, found.spread, found.origin, found.nu) == (wanted.E_MPa, wanted.spread, wanted.origin, NU)
    assert str(found).startswith(f"{wanted.E_MPa:.3g} MPa +- 28 %, Ecoflex 00-30, ")
    assert elastic_constants({"silicone": "ecoflex 00-30", "nu": 0.5}).nu == 0.5


def test_a_hardness_is_converted() -> None:
    found = elastic_constants({"shore_00": 30.0})
    assert (found.E_MPa, found.spread) == (modulus_of_shore_00(30.0), SPREAD_00)
    assert "1.7 times softer" in elastic_constants({"shore_A": 30}).origin


def test_no_number_and_no_silicone() -> None:
    with pytest.raises(TypeError):
        elastic_constants({"E_MPa": "1", "nu": 0.3})
    with pytest.raises(Finger3dError, match="Dragon Skin 10"):
        elastic_constants({"silicone": "dragn skin 10"})
