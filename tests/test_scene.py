"""Scenes that load: defaults, overrides, the model they give, and the way back to TOML."""

from __future__ import annotations

from finger3d.scene import load, parse
from tests.commands import loaded
from tests.scene_tables import SMALL
from tests.scenes import written


def test_loading_a_scene_needs_no_cad_and_no_drawing(tmp_path) -> None:
    path = written(tmp_path, parse(SMALL).to_toml())
    heavy = ("OCP", "build123d", "vtk", "vtkmodules", "pyvista", "pytetwild", "matplotlib")
    assert not loaded(f"import finger3d; finger3d.load({str(path)!r}).model()", *heavy)


def test_the_title_of_a_file_with_escapes_in_its_name_is_printable(tmp_path, capsys) -> None:
    from finger3d.cli import main

    path = tmp_path / "a\x1b[31mred\nline.toml"
    path.write_text(parse(SMALL).to_toml().replace('title = "Fig. 9"\n', ""), encoding="utf-8")
    assert load(path).title.isprintable()
    assert main(["plan", str(path), "--set", "mesh.mesher=swept"]) == 0
    assert main(["plan", str(path), "--set", "friction.mu=-1"]) == 2
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err
    assert len(err.splitlines()) == 1
