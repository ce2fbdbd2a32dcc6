"""Commands and files: export, bodies that are refused, and what an interruption leaves."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d.__main__
import finger3d.analyses.press
from finger3d.cli import main
from finger3d.geometry.surface import Triangles
from finger3d.io import claimed
from finger3d.scene import load
from tests.bodies import ball, box, channel, write_stl
from tests.scenes import BLOCK, written

# --- command ``export``: files of the finger, and the mold with its table --------------------------------------------


STEPS = ("1_print", "2_prepare", "3_close", "4_pour", "5_open")


def test_the_command_writes_a_mold(scene, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    out = tmp_path / "Gießform, neu"
    assert main(["export", str(scene), "--out", str(out), "--mold", "--shrinkage=0.002"]) == 0
    printed, err = capsys.readouterr()
    assert err == ""
    names = {"finger.step", "finger.stl", "mold.3mf", "mold.step", "mold.png", "sheet.txt"}
    names |= {f"mold_{part}.stl" for part in ("half_a", "half_b", "lid")}
    names |= {"mold.html"} | {f"mold_step_{step}.png" for step in STEPS}
    assert {f.name for f in out.glob("[!.]*")} == names
    text = (out / "sheet.txt").read_text(encoding="utf-8")
    volume = load(scene).design.volume_mm3 / 0.998**3 / 1e3
    assert f"cavity              {volume:.2f} ml" in text
    assert "g36" in text
    assert "remark" not in printed
    assert max(len(line) for line in text.splitlines()) <= 120
    from matplotlib.image import imread

    assert imread(out / "mold.png")[..., :3].std() > 0.05


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--shrinkage", "0.01"], "--mold"),
        (["--mold", "--riser", "0.04"], "--riser is gone: .*--pour-mm"),
        (["--mold", "--carrier"], "--carrier is gone: .*rigid = true"),
        (["--mold", "--no-plugs"], "--no-plugs is gone: .*tape"),
        (["--mold", "--wall-mm", "4"], "--wall-mm is gone: .*8 mm"),
        (["--ascii"], "--ascii is gone"),
        (["--mold", "--set", "gauge=[]", "--split-mm", "11"], "split"),
    ],
)
def test_the_command_refuses_in_one_line(arguments, told, scene, tmp_path, capsys) -> None:
    assert main(["export", str(scene), "--out", str(tmp_path / "out"), *arguments]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert re.search(told, err)
    assert not list((tmp_path / "out").glob("*"))


def test_export_prints_json_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(written(tmp_path, BLOCK)), "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["results"] == str(tmp_path / "out")
    assert [Path(file).name for file in found["files"]] == ["finger.step", "finger.stl"]
    # a box: its triangles are the box
    assert found["volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0)
    assert found["stl_volume_mm3"] == pytest.approx(20.0 * 8.0 * 6.0, rel=1e-6)
    assert found["silicone_ml"] is None
    assert found["remarks"] == []


# --- bad bodies as a user meets them: the command ends with code 2 and one line, at once -----------------------------


SCENE = """[finger]
geometry = {finger}
[material]
E_MPa = 1.0
nu = 0.3
[press]
depth_mm = 0.5
[object]
{object}
[mesh]
size_mm = {size}
"""
PAD = '"block"\nhalf_length_mm = 5.0\nheight_mm = 5.0\nwidth_mm = 4.0'
CUBE = box(8.0, 6.0, 4.0)


def moved(change: Callable[[np.ndarray], Any], surface: Triangles = CUBE) -> Triangles:
    return Triangles(change(surface.points), surface.faces)


def joined(*surfaces: Triangles) -> Triangles:
    starts = np.cumsum([0, *(len(s.points) for s in surfaces)])
    return Triangles(
        np.vstack([s.points for s in surfaces]),
        np.vstack([s.faces + n for s, n in zip(surfaces, starts, strict=False)]),
    )


def inward(surface: Triangles) -> Triangles:
    return replace(surface, faces=surface.faces[:, ::-1])


SURFACES: dict[str, tuple[Triangles, str]] = {
    "a hole": (replace(CUBE, faces=CUBE.faces[1:]), "is not closed"),
    "inside out": (inward(CUBE), "inside out"),
    "nan": (moved(lambda p: np.where(np.arange(8)[:, None] == 3, np.nan, p)), "not a number"),
    "two pieces": (joined(CUBE, moved(lambda p: p + [20.0, 0.0, 0.0])), "in 2 pieces"),
    "metres": (moved(lambda p: 1e-3 * p), "unit"),
}  # fmt: skip


def refused(capsys: Any, folder: Path, finger: str, obj: str, size: float = 1.0, more: tuple[str, ...] = ()) -> str:
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(finger=finger, object=obj, size=size), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(folder / "out"), "--no-figures", *more]) == 2
    said = capsys.readouterr().err
    complaint = [line for line in said.splitlines() if line.startswith("finger3d: ")]
    assert len(complaint) == 1, said
    assert "Traceback" not in said
    assert not list((folder / "out").glob("summary.json"))
    return complaint[0]


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("role", ["finger", "object"])
def test_meshes_that_are_no_body(name: str, role: str, tmp_path: Path, capsys: Any) -> None:
    surface, text = SURFACES[name]
    write_stl(tmp_path / "body.stl", surface)
    where = ('"body.stl"', 'shape = "plane"') if role == "finger" else (PAD, 'shape = "mesh"\npath = "body.stl"')
    said = refused(capsys, tmp_path, *where)
    assert "body.stl" in said or "object.path" in said
    assert re.search(text, said), said


@pytest.mark.parametrize(
    ("surface", "table", "text"),
    [
        (CUBE, "x_mm = 60.0", "never"),
        (channel(12.0, 4.9), "", "base"),
        (channel(10.0, 3.0), "[effects.elastic_object]\nE_MPa = 1.0\nnu = 0.3\n", "wall"),
        (box(4.0, 5.0, 9.0), "x_mm = 7.0", "area"),
        (moved(lambda p: 300.0 * p), "", "unit"),
        (moved(lambda p: 0.003 * p), "", "1000 "),
    ],
    ids=["beside", "base", "wall", "rim", "large", "small"],
)
def test_objects_that_meet_something_else_first(
    surface: Triangles, table: str, text: str, tmp_path: Path, capsys: Any
) -> None:
    write_stl(tmp_path / "body.stl", surface)
    said = refused(capsys, tmp_path, PAD, f'shape = "mesh"\npath = "body.stl"\n{table}')
    assert text in said


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ('shape = "sphere"\nradius_mm = 3.0\nx_mm = 40.0', "never"),
    ],
)
def test_shapes_beside_the_finger(table: str, text: str, tmp_path: Path, capsys: Any) -> None:
    assert re.search(text, refused(capsys, tmp_path, PAD, table))


# what crashes or hangs pytetwild, as far as a scene can ask for it; the rest, as arrays, is in test_meshing_tetwild.py
@pytest.mark.parametrize(("size", "text"), [(100.0, "mesh.size_mm = 100.0"), (0.02, "tetrahedra")])
def test_sizes_that_hang_the_mesher(size: float, text: str, tmp_path: Path, capsys: Any) -> None:
    small_strain = ("--set", "effects.auto=false")
    assert text in refused(capsys, tmp_path, PAD, 'shape = "plane"', size, small_strain)


def test_a_finger_without_base_or_through_itself(tmp_path: Path, capsys: Any) -> None:
    write_stl(tmp_path / "ball.stl", ball(5.0, 8, 12))
    assert "base" in refused(capsys, tmp_path, '"ball.stl"', 'shape = "plane"')
    crossed = moved(lambda p: np.vstack([p[:6], [[-12.0, 8.0, 1.0]], p[7:]]))
    write_stl(tmp_path / "crossed.stl", crossed)
    assert "itself" in refused(capsys, tmp_path, '"crossed.stl"', 'shape = "plane"')
    write_stl(tmp_path / "leaf.stl", box(8.0, 1e-3, 4.0))  # its size can be asked for, its tetrahedra cannot
    thin = ("--set", "press.depth_mm=1e-4")
    assert "tetrahedra" in refused(capsys, tmp_path, '"leaf.stl"', 'shape = "plane"', 1e-3, thin)


def test_a_point_at_the_end_of_single_precision_is_told(tmp_path: Path, capsys: Any) -> None:
    # a triangle with three equal corners is left out of the surface, its corner is not
    body = moved(lambda p: p)
    far = Triangles(np.vstack([body.points, [[3e38] * 3]]), np.vstack([body.faces, [[8, 8, 8]]]))
    write_stl(tmp_path / "far.stl", far)
    for said in (refused(capsys, tmp_path, '"far.stl"', 'shape = "plane"'),
                 refused(capsys, tmp_path, PAD, 'shape = "mesh"\npath = "far.stl"')):  # fmt: skip
        assert "3e+38" in said


def test_too_many_triangles_are_told_before_they_are_checked(tmp_path: Path, capsys: Any) -> None:
    from finger3d.geometry.files import MOST_TRIANGLES

    body = moved(lambda p: p)
    many = Triangles(body.points, np.tile(body.faces, (MOST_TRIANGLES // len(body.faces) + 1, 1)))
    write_stl(tmp_path / "many.stl", many)
    assert str(MOST_TRIANGLES) in refused(capsys, tmp_path, '"many.stl"', 'shape = "plane"')


def test_a_finger_drawn_far_away_is_none_the_worse(tmp_path: Path, capsys: Any) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(finger='"far.stl"', object='shape = "plane"', size=1.0), encoding="utf-8")
    for away in (1e6, 1e9):  # as drawn, 1e9 hangs pytetwild: the body is moved onto its base first
        write_stl(tmp_path / "far.stl", moved(lambda p, by=away: p + [by, -by, 0.0]))
        assert main(["plan", str(scene)]) == 0, capsys.readouterr().err


# --- ctrl-C, a full disk and a second run: nothing half-written is taken for a result, and nothing ends in a traceback


SECTION = ["--set", "model.domain=plane-strain", "--set", "mesh.size_mm=2.0", "--set", "mesh.base_size_mm=8.0"]


def press(root: Path, out: Path, *options: str) -> list[str]:
    scene = root / "geometries" / "fig9.toml"
    return [sys.executable, "-m", "finger3d", "press", str(scene), "--out", str(out), *options]


def judge(done: subprocess.CompletedProcess, out: Path) -> None:
    """What must hold whenever the interruption came."""
    # Python ends by the signal itself if it came while exec() ran; a shell shows 130 for either.
    assert done.returncode in (0, 130, -signal.SIGINT), done.stderr
    assert "Traceback" not in done.stderr
    if "results " not in done.stdout:
        assert done.stderr.strip().splitlines()[-1].startswith("finger3d: interrupted")
    left = [p.name for p in out.iterdir()] if out.is_dir() else []
    assert not [name for name in left if name.startswith(".") and not name.endswith(".lock")]
    if "summary.json" in left:
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        # After the last file is written there is nothing left to interrupt but the closing table.
        whole = {"fields.vtu", "history.csv", "contact.csv", "scene.toml"} <= set(left)
        assert summary["outcome"].startswith("incomplete") or (summary["outcome"] == "converged" and whole)


def interrupted(command: list[str], seconds: float, cwd: Path) -> subprocess.CompletedProcess:
    running = subprocess.Popen(
        command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    time.sleep(seconds)
    os.killpg(running.pid, signal.SIGINT)
    stdout, stderr = running.communicate(timeout=60)
    return subprocess.CompletedProcess(command, running.returncode, stdout, stderr)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("domain", "shares"),
    [("plane-strain", (0.3, 0.5, 0.7, 0.9)), ("solid", (0.5, 0.8))],
)
def test_ctrl_c_at_any_moment(root: Path, tmp_path: Path, domain: str, shares: tuple[float, ...]) -> None:
    out = tmp_path / "ein Ordner mit Umläuten"
    start = time.perf_counter()
    subprocess.run(press(root, out, "--set", f"model.domain={domain}"), check=True, capture_output=True, cwd=root)
    whole = time.perf_counter() - start
    # Python itself, before a line of ours runs, answers with a traceback: hence not from the very start.
    for share in shares:
        shutil.rmtree(out)
        out.mkdir()
        done = interrupted(press(root, out, "--set", f"model.domain={domain}"), share * whole, root)
        judge(done, out)


def test_ctrl_c_while_the_steps_are_written(root: Path, tmp_path: Path) -> None:
    out = tmp_path / "ein Ordner mit Umläuten"
    running = subprocess.Popen(
        press(root, out, *SECTION, "--set", "press.steps=3000", "--no-figures"),
        cwd=root, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert running.stdout is not None
    while " of 3000: depth" not in (seen := running.stdout.readline()):
        assert seen
    running.send_signal(signal.SIGINT)
    printed, _ = running.communicate(timeout=60)
    judge(subprocess.CompletedProcess([], running.returncode, "", printed), out)
    assert "of 3000 increments" in printed
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"]


def with_environment(text: str) -> list[int]:
    """Running processes whose environment contains a text."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):  # of a process that has ended meanwhile
            if text.encode() in path.read_bytes():
                found.append(int(path.parent.name))
    return found


def until(true: Callable[[], bool], seconds: float) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, and relies on prctl")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_a_press_killed_while_it_meshes_leaves_no_child_and_no_folder(
    root: Path, tmp_path: Path, sent: signal.Signals, code: int
) -> None:
    temporary, cache = tmp_path / "tmp", tmp_path / "cache"
    temporary.mkdir()
    env = {**os.environ, "TMPDIR": str(temporary), "FINGER3D_CACHE": str(cache), "OMP_NUM_THREADS": "1"}
    command = press(root, tmp_path / "out", "--set", "mesh.size_mm=1.5")  # half a minute of meshing
    running = subprocess.Popen(command, cwd=root, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def meshing() -> bool:
        names = [Path(f"/proc/{pid}/cmdline") for pid in with_environment(str(cache))]
        return any(path.exists() and b"pytetwild" in path.read_bytes() for path in names)

    until(meshing, 60.0)
    time.sleep(1.0)  # it loads pytetwild
    running.send_signal(sent)
    _, printed = running.communicate(timeout=60)
    assert running.returncode == code
    assert "Traceback" not in printed
    until(lambda: not with_environment(str(cache)), 5.0)
    assert not list(temporary.iterdir())
    assert not list(cache.rglob("*.npz"))
    if sent == signal.SIGTERM:
        assert printed.splitlines()[-1].startswith("finger3d: interrupted")


def test_an_import_that_ctrl_c_broke_off_is_an_interruption(root: Path, tmp_path, monkeypatch, capsys) -> None:
    def broken(*args: object, **kwargs: object) -> None:  # as the loaders of OCP and VTK are
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise ImportError("initialization failed") from error

    monkeypatch.setattr(finger3d.analyses.press, "press", broken)
    monkeypatch.setattr(sys, "argv", press(root, tmp_path / "out")[2:])
    assert finger3d.__main__.main() == 130
    assert capsys.readouterr().err.startswith("finger3d: interrupted")


def test_two_runs_into_one_folder(root: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    with claimed(out):
        assert main(press(root, out, *SECTION)[3:]) == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith(f"finger3d: {out}: ")


def test_results_of_another_command_are_not_replaced(root: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "calibration.json").write_text("{}")
    assert main(press(root, tmp_path, *SECTION)[3:]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith(f"finger3d: --out {tmp_path}: ")
    assert "calibrate" in said
    assert [p.name for p in tmp_path.iterdir()] == ["calibration.json"]


def test_a_sweep_takes_no_other_results_folder(root: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "summary.json").write_text("{}")
    scene = root / "geometries" / "fig9.toml"
    assert main(["sweep", str(scene), "--out", str(tmp_path), "--vary", "friction.mu=0.1,0.2", *SECTION]) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith(f"finger3d: --out {tmp_path}: ")
    assert "press" in said


def test_a_disk_that_fills(root: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    done = []

    def full(source: str | Path, target: str | Path) -> None:
        if Path(target).name == "history.csv" and len(done) > 1:
            raise OSError(errno.ENOSPC, "No space left on device")
        done.append(target)
        replace(source, target)

    replace = os.replace
    monkeypatch.setattr(os, "replace", full)
    assert main(press(root, tmp_path, *SECTION, "--no-figures")[3:]) == 3
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert f"{tmp_path / 'history.csv'}: {os.strerror(errno.ENOSPC)}" in error
    assert not [p.name for p in tmp_path.iterdir() if p.name.startswith(".") and p.suffix != ".lock"]
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"].startswith("incomplete")
