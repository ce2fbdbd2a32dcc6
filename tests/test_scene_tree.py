"""TOML files and overrides."""

from __future__ import annotations

import re
import tracemalloc
from collections.abc import Iterator

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Leg
from finger3d.scene import load, parse, scene_of, tree
from tests.scene_tables import SMALL
from tests.scenes import written


def test_overrides_are_applied_before_checking(tmp_path) -> None:
    # nu is missing in the file: only the override makes it a scene.
    path = written(tmp_path, parse(SMALL).to_toml(defaults=False).replace("nu = 0.49\n", ""))
    overrides = [
        "material.nu=0.3",
        "friction.mu=0.5",
        "model.domain=plane-strain",
        'title="as text = quoted"',
        "press.steps=auto",
        "finger.geometry = block",
        "finger={geometry='block', half_length_mm=10, height_mm=20, width_mm=5}",
    ]
    scene = load(path, overrides)
    assert scene.model().material.nu == 0.3
    assert scene.model().friction == Coulomb(0.5)
    assert scene.domain == "plane-strain"
    assert scene.title == "as text = quoted"
    assert scene.legs[0].steps == "auto"
    assert scene.design.name == "block"


def test_an_override_reaches_into_a_list(tmp_path) -> None:
    legs = {"leg": [{"depth_mm": 5.0}, {"depth_mm": 0.0}]}
    path = written(tmp_path, parse({**SMALL, "press": legs}).to_toml())
    assert load(path, ["press.leg.1.depth_mm=2.5"]).legs == (Leg(5.0, steps="auto"), Leg(2.5, steps="auto"))


READINGS = {
    "gauge": [{"name": "a", "x_mm": 1.0, "y_mm": 2.0}, {"name": "b.c", "x_mm": 2.0, "y_mm": 2.0}],
    "marker": [{"name": "m", "x_mm": 0.0, "y_mm": 1.0}],
    "taxel": [{"name": "t", "x_mm": 0.0, "z_mm": 0.0, "length_mm": 1.0, "width_mm": 1.0}],
}


def test_readings_are_overridden_by_name(tmp_path) -> None:
    path = written(tmp_path, parse({**SMALL, **READINGS}).to_toml())
    set_ = ["gauge.a.x_mm=3.0", "gauge.1.x_mm=4.0", "gauge.a.name=z", "gauge.z.y_mm=1.0", "marker.m.x_mm=0.5"]
    tables = load(path, [*set_, "taxel.t.width_mm=2.0"]).tables
    assert [(g.name, g.x_mm, g.y_mm) for g in tables.gauge] == [("z", 3.0, 1.0), ("b.c", 4.0, 2.0)]
    assert tables.marker[0].x_mm == 0.5
    assert tables.taxel[0].width_mm == 2.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gauge.q.x_mm=1", 'no gauge "q"; must be "a" or "b.c", or its number from 0'),
        ("gauge.a.x_mm=far", "with --set gauge.0.x_mm: gauge.0.x_mm"),
    ],
)
def test_an_override_of_no_reading_is_refused(tmp_path, text: str, said: str) -> None:
    path = written(tmp_path, parse({**SMALL, **READINGS}).to_toml())
    with pytest.raises(Finger3dError, match=re.escape(said)):
        load(path, [text])


@pytest.mark.parametrize(
    ("table", "given", "text", "left"),
    [
        ("mesh", {"tolerance": 0.1, "goal": "normal_force_N"}, "mesh.size_mm=2.0", {"size_mm"}),
        ("mesh", {"size_mm": 2.0, "base_size_mm": 4.0}, "mesh.tolerance=0.1", {"tolerance"}),
        ("mesh", {"size_mm": 2.0, "mesher": "swept"}, "mesh.base_size_mm=4.0", {"size_mm", "base_size_mm", "mesher"}),
        ("press", {"depth_mm": 1.0, "steps": 2}, "press.force_N=3.0", {"force_N", "steps"}),
        ("press", {"force_N": 1.0}, "press.depth_mm=3.0", {"depth_mm"}),
    ],
)
def test_a_key_that_is_set_takes_the_place_of_those_that_it_excludes(table, given, text, left) -> None:
    scene = scene_of({**SMALL, table: given}, [text])
    assert set(scene.given[table]) == left
    with pytest.raises(Finger3dError, match="beside|either"):
        scene_of({**SMALL, "mesh": {}}, ["mesh.size_mm=2.0", "mesh.tolerance=0.1"])


def test_true_and_false_switch_effects(tmp_path) -> None:
    path = written(
        tmp_path,
        parse({**SMALL, "effects": {"large_deformation": {"law": "mooney-rivlin", "c01_share": 0.2}}}).to_toml(),
    )
    law = load(path, ["effects.large_deformation=true"]).effects["large_deformation"].law
    assert law == "mooney-rivlin"
    assert not load(path, ["effects.large_deformation=false"]).effects
    off = ["effects.large_deformation=false", "effects.large_deformation=true"]
    assert load(path, off).effects["large_deformation"].law == "neo-hookean"
    on = ["effects.kinetic_friction=true", "effects.kinetic_friction.ratio=0.5"]
    assert load(path, on).effects["kinetic_friction"].ratio == 0.5


def test_the_file_is_not_changed_by_an_override(tmp_path) -> None:
    path = written(tmp_path, parse(SMALL).to_toml())
    before = path.read_bytes()
    load(path, ["friction.mu=0.5"])
    assert path.read_bytes() == before


def test_byte_order_mark_and_windows_lines_are_taken(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + parse(SMALL).to_toml().replace("\n", "\r\n").encode())
    assert load(path) == parse(SMALL)


@pytest.fixture
def memory() -> Iterator[None]:
    """No more than 20 MB, about 30 times what these scenes need, may be taken."""
    tracemalloc.start()
    yield
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


LONG = ".".join("a" * 20_000)


@pytest.mark.usefixtures("memory")
@pytest.mark.parametrize(
    "text",
    [f"{LONG}=1", f"friction.mu=1\n{LONG}=1", f"friction={{{LONG}=1}}", f"press.leg.{'9' * 20_000}=1", "." * 40_000,
     f"friction={'{a=' * 60}1{'}' * 60}"],
    ids=["key", "second line", "value", "number", "dots", "tables"],
)  # fmt: skip
def test_a_key_of_many_parts_is_refused_in_little_memory(text: str) -> None:
    with pytest.raises(Finger3dError) as told:
        parse(tree.override({**SMALL, "press": {"leg": [{"depth_mm": 0.1}]}}, [text]))
    assert "\n" not in str(told.value)


@pytest.mark.usefixtures("memory")
@pytest.mark.parametrize("line", [f"{LONG} = 1", f"[{LONG}]", f"friction = {{{LONG} = 1}}"])
def test_a_file_with_a_key_of_many_parts_is_refused_in_little_memory(line: str, tmp_path) -> None:
    with pytest.raises(Finger3dError, match="a key is too long"):
        load(written(tmp_path, f"{line}\n"))
