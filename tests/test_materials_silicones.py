"""The table of silicones."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.materials.silicones import Mix, silicone_named, silicones, sources


def test_the_silicones_that_people_cast_fingers_of_are_there() -> None:
    assert len(silicones()) >= 12
    assert {
        "Ecoflex 00-10", "Ecoflex 00-30", "Ecoflex 00-50", "Dragon Skin 10", "Dragon Skin 20", "Dragon Skin 30",
        "Mold Star 15", "Mold Star 16", "Mold Star 30", "Smooth-Sil 935", "Smooth-Sil 936", "Smooth-Sil 940",
        "Smooth-Sil 950", "Smooth-Sil 960", "Elastosil M4601", "Sylgard 184",
    } <= set(silicones())  # fmt: skip


def test_every_number_is_possible_and_every_silicone_has_its_sources() -> None:
    used = set()
    for one in silicones().values():
        assert one.scale in ("A", "00")
        assert 5.0 <= one.shore <= 90.0
        assert one.density_g_ml is None or 0.95 < one.density_g_ml < 1.35
        assert one.viscosity_Pa_s is None or 1.0 <= one.viscosity_Pa_s <= 100.0
        assert one.shrinkage is None or 0.0 < one.shrinkage <= 0.01
        assert one.pot_life_min is None or one.cure_h is None or one.pot_life_min < 60.0 * one.cure_h
        assert one.sources
        assert set(one.sources) <= set(sources())
        used |= set(one.sources)
    assert used == set(sources())


def test_a_family_is_stiffer_where_it_is_harder() -> None:
    rows = {name: one.modulus_100_psi for name, one in silicones().items() if one.modulus_100_psi}
    for family in ("Ecoflex", "Dragon Skin"):
        moduli = [value for name, value in rows.items() if name.startswith(family)]
        assert len(moduli) == 4
        assert moduli == sorted(moduli)


@pytest.mark.parametrize(
    "name",
    ["Dragon Skin 20", "dragon skin 20", "DragonSkin20", "dragon-skin 20", " Dragon  Skin 20A", "DRAGON SKIN 20 fast"],
)
def test_case_spaces_and_speed_do_not_matter(name: str) -> None:
    assert silicone_named(name).name == "Dragon Skin 20"


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(Finger3dError, match='"Ecoflex 00-30"'):
        silicone_named("Eco-flx 0030")
    with pytest.raises(Finger3dError, match="Ecoflex 00-10, .* Sylgard 184; .*shore_A"):
        silicone_named("butter")


def test_the_proportion_of_the_components() -> None:
    mix = silicone_named("Smooth-Sil 950").mix
    assert mix == Mix(100.0, 10.0, "weight")
    assert mix.share_a == pytest.approx(10.0 / 11.0)
    assert str(mix) == "100 A : 10 B by weight"


def test_psi_are_converted() -> None:
    assert silicone_named("Dragon Skin 30").modulus_100_MPa == pytest.approx(0.593, abs=5e-4)
    assert silicone_named("Sylgard 184").modulus_100_MPa is None
