"""Casting instructions of a silicone."""

from __future__ import annotations

import math
import re

import pytest

from finger3d.materials.silicones import Mix, Silicone, silicone_named, silicones
from finger3d.mold.casting import (
    PourHole,
    inhibition_lines,
    mixing_lines,
    silicone_lines,
    surface_lines,
)

HOLE = PourHole(6.0, 14.0, 4.0)


def sheet(name: str, volume_ml: float = 100.0, hole: PourHole | None = HOLE, shrinkage: float = 0.0) -> str:
    return "\n".join(silicone_lines(silicone_named(name), volume_ml, hole, shrinkage))


def made(**values) -> Silicone:
    return Silicone(name="mine", maker="me", scale="A", shore=20.0, sources=("me",), **values)


def test_a_cylinder_flows_as_poiseuille_says() -> None:
    """Q = pi rho g r^4 / (8 eta) for a cylinder that its own weight drains."""
    silicone = made(density_g_ml=1.1, viscosity_Pa_s=10.0)
    wanted = math.pi * 1100.0 * 9.81 * 0.003**4 / (8.0 * 10.0)  # m3/s
    assert PourHole(6.0, 6.0, 4.0).flow_ml_min(silicone) == pytest.approx(60e6 * wanted, rel=1e-12)
    assert HOLE.flow_ml_min(silicone) > PourHole(6.0, 6.0, 4.0).flow_ml_min(silicone)
    assert HOLE.flow_ml_min(made()) is None


def test_grams_of_each_component_for_the_volume() -> None:
    text = sheet("Dragon Skin 20")
    assert re.search(r" 108\.0 g .* 54\.0 g of A and 54\.0 g of B \(1 A : 1 B ", text)
    grams = [
        float(g)
        for g in re.search(r"weigh +([\d.]+) g .*: ([\d.]+) g of A and ([\d.]+) g", sheet("Smooth-Sil 950")).groups()
    ]
    assert grams[1] / grams[2] == pytest.approx(10.0, rel=0.01)
    # no density is known: the largest one of the table, so that there is enough
    assert grams[0] == pytest.approx(100.0 * max(s.density_g_ml or 0.0 for s in silicones().values()))
    assert grams[1] + grams[2] == pytest.approx(grams[0], abs=0.11)
    assert "50.0 ml of A and 50.0 ml of B (1 A : 1 B " in sheet("Mold Star 16")
    assert re.search(r"weigh .*mix ratio.*data sheet", sheet("Elastosil M4601"))
    text = "\n".join(silicone_lines(made(mix=Mix(2.0, 1.0, "volume")), 90.0, HOLE, 0.0))
    assert "60.0 ml of A and 30.0 ml of B" in text


def test_the_cup_holds_five_times_the_volume() -> None:
    assert " 500 ml" in sheet("Dragon Skin 20")
    assert " 500 ml" in "\n".join(silicone_lines(None, 100.0, HOLE, 0.0))


def test_pot_life_against_pouring() -> None:
    slow = sheet("Dragon Skin 20", 200.0)
    assert "25 min" in slow
    assert re.search(r"degas 5 min.* 17 min ", slow)
    assert "syringe" in slow
    assert "flow" not in sheet("Dragon Skin 20", 200.0, None)
    assert "syringe" not in sheet("Ecoflex 00-30", 50.0, PourHole(10.0, 20.0, 4.0))
    assert "degas 5 min" not in sheet("Mold Star 16")
    assert re.search(r"pot life .*data sheet", sheet("Smooth-Sil 960"))


def test_cure_shrinkage_and_notes() -> None:
    text = sheet("Dragon Skin 10")
    assert " 5 h at 23 degrees" in text
    assert "below 0.1 %" in text
    assert "MEDIUM" in text
    (more,) = set(sheet("Dragon Skin 10", shrinkage=0.005).splitlines()) - set(text.splitlines())
    assert re.search(r"shrinkage .* 0\.1 % .*mold", more)
    assert " 0.5 h (30 min)" in sheet("Mold Star 16")
    assert "60 min at 90 degrees" in sheet("Elastosil M4601")
    assert "data sheet" in sheet("Smooth-Sil 940")


@pytest.mark.parametrize("name", silicones())
def test_every_silicone_has_its_lines(name: str) -> None:
    lines = silicone_lines(silicone_named(name), 63.0, HOLE, 0.0)
    assert name in lines[0]
    assert re.search(r"E = [\d.]+ MPa \+- \d+ %", lines[0])
    assert all(len(line) < 200 for line in lines)
    assert "None" not in "\n".join(lines)


def test_the_order_of_mixing_and_what_stops_the_cure() -> None:
    mixing = "\n".join(mixing_lines())
    assert mixing.index("weigh") < mixing.index("Mix slowly") < mixing.index("Degas")
    inhibition = "\n".join(inhibition_lines())
    assert all(
        word in inhibition for word in ("Sulphur", "tin", "amines", "resin", "post-cure", "lacquer", "Test first")
    )


def test_ribs_run_across_the_axis_of_the_split() -> None:
    assert re.search(r"\bz up\b.* along x\b.* along z\b", "\n".join(surface_lines("z")))
    assert re.search(r"\bx up\b.* along z\b.* along x\b", "\n".join(surface_lines("x")))
