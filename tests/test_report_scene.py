"""The scene in a page."""

from __future__ import annotations

from pathlib import Path

from finger3d.report.build import Code, Table
from finger3d.report.scene import how_modelled
from tests.sensor_cases import scene


def test_every_table_of_the_scene_with_its_defaults(tmp_path: Path) -> None:
    data = scene(effects={"kinetic_friction": {"ratio": 0.7}}).as_dict()
    (table,) = how_modelled({"scene": data}, tmp_path)
    assert isinstance(table, Table)
    rows = dict(table.rows)
    assert rows["finger"].startswith("geometry = clipped_cylinder, radius_mm = 100")
    assert {"material", "press", "model", "mesh", "gauge g36", "gauge long"} <= set(rows)
    assert "x_mm = 36" in rows["gauge g36"]
    assert "ratio = 0.7" in rows["effect kinetic_friction"]
    assert "branch = keep" in rows["effect kinetic_friction"]


def test_a_scene_without_effects_says_so_and_its_file_is_quoted(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text('title = "mine"\n', encoding="utf-8")
    table, baseline, file = how_modelled({"scene": scene().as_dict()}, tmp_path)
    assert not [name for name, _ in table.rows if name.startswith("effect")]
    assert "elasticity" in baseline
    assert file == Code('title = "mine"\n', "scene.toml")


def test_where_a_modulus_comes_from(tmp_path: Path) -> None:
    data = scene(material={"silicone": "Dragon Skin 20"}).as_dict()
    rows = dict(how_modelled({"scene": data}, tmp_path)[0].rows)
    assert rows["Young's modulus"].startswith("0.423 MPa \u00b1 25 %: Dragon Skin 20, ")
    assert "E_spread" not in rows["material"]
    assert "Young's modulus" not in dict(how_modelled({"scene": scene().as_dict()}, tmp_path)[0].rows)


def test_where_the_modulus_of_a_part_comes_from(tmp_path: Path) -> None:
    data = scene().as_dict() | {"parts": {"skin": {"shore_A": 20.0, "E_MPa": 0.7, "E_spread": 0.6, "E_origin": "Gent"}}}
    rows = dict(how_modelled({"scene": data}, tmp_path)[0].rows)
    assert rows["part skin"] == "shore_A = 20, E_MPa = 0.7"
    assert rows["Young's modulus of skin"] == "0.7 MPa \u00b1 60 %: Gent"
