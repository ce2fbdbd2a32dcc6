"""Export of a model: the mesh comes back as a finger with the same forces; the deck is written whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import finger3d
from finger3d.analyses.export_model import export_deck, export_mesh
from finger3d.cli import main
from finger3d.scene import load
from tests.given_meshes import GMSH, refused
from tests.scenes import BLOCK, written


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, BLOCK)


def swept(path: Path, *keys: str):
    return load(
        path, ['model.domain="solid"', 'mesh.mesher="swept"', "mesh.size_mm=2.0", "mesh.base_size_mm=3.0", *keys]
    )


def test_a_mesh_that_was_written_is_the_same_finger(scene_file: Path, tmp_path: Path) -> None:
    scene = swept(scene_file)
    done = export_mesh(scene, tmp_path / "out")
    assert [file.name for file in done.files] == ["finger.vtu", "finger.msh"]
    forces = [finger3d.press(scene, error=False).last.normal_force_N]
    for file in done.files:
        back = scene_file.with_name("back.toml")
        table = BLOCK.split("[material]", 1)[1].split("[model]")[0].split("[mesh]")[0]
        back.write_text(f'effects.auto = false\n[finger]\ngeometry = "{file}"\n[material]{table}', encoding="utf-8")
        result = finger3d.press(load(back), error=False)
        forces.append(result.last.normal_force_N)
        assert result.summary()["scene"]["mesh"]["size_mm"] == pytest.approx(2.0, rel=0.3)
    # the same cells, whole here and halved by symmetry there: round-off
    assert forces[1:] == pytest.approx([forces[0]] * 2, rel=1e-6)


def test_a_section_and_the_fingers_own_folder_are_refused(scene_file: Path, tmp_path: Path) -> None:
    assert "model.domain" in refused(
        lambda: export_mesh(swept(scene_file, 'model.domain="plane-strain"'), tmp_path / "out")
    )
    own = tmp_path / "finger.msh"
    own.write_bytes((GMSH / "binary.msh").read_bytes())
    text = f'[finger]\ngeometry = "{own}"\n[material]\nE_MPa = 1.0\nnu = 0.4\n[press]\ndepth_mm = 1.0\n'
    given = written(tmp_path, text)
    before = own.read_bytes()
    line = refused(lambda: export_mesh(load(given), tmp_path))
    assert line.startswith(f"--out {tmp_path}: ")
    assert own.name in line
    assert own.read_bytes() == before


def test_the_command_writes_a_deck_or_a_mesh(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(scene_file), "--set", 'mesh.mesher="swept"', "--set", "mesh.size_mm=2.0"]
    command += ["--set", 'model.domain="solid"']
    command += ["--set", "mesh.base_size_mm=3.0", "--json", "--out", str(tmp_path / "out")]
    assert main([*command, "--solver", "calculix"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["multiple"] == 4.0
    assert (tmp_path / "out" / "press.inp").read_text(encoding="ascii").endswith("*END STEP\n")
    assert main([*command, "--mesh"]) == 0
    assert json.loads(capsys.readouterr().out)["cells"] == 4 * found["cells"]
    assert main([*command, "--mesh", "--solver", "calculix"]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert all(option in err for option in ("--mesh", "--solver"))
    assert main([*command, "--solver", "abaqus"]) == 2


def test_a_deck_of_a_given_mesh(tmp_path: Path) -> None:
    text = f'[finger]\ngeometry = "{GMSH / "text.msh"}"\n[material]\nE_MPa = 1.0\nnu = 0.4\n[press]\ndepth_mm = 1.0\n'
    done = export_deck(load(written(tmp_path, text)), tmp_path / "out")
    assert done.multiple == 1.0
    assert (tmp_path / "out" / "press.inp").stat().st_size > 1e4
