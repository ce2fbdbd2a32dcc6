"""Commands that press a scene: press, plan, compare, cost, sensitivity, sweep, show and app."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import finger3d.analyses.compare as compare_module
from finger3d.analyses.compare import press_with_errors
from finger3d.analyses.cost import ERRORS
from finger3d.cli import main
from finger3d.errors import MissingError, Outcome
from finger3d.plotting.renderer import running_child
from finger3d.results.summary import Case
from tests.commands import refused, run
from tests.pictures import marked, orange, rgb
from tests.scenes import SECTION, SWEPT_FINGER, written
from tests.sensor_cases import scene as sensor_scene
from tests.sweep_cases import COARSE, table

# --- command ``press``: its table, its JSON, its exit codes. Presses are faked ---------------------------------------


def test_press_prints_the_closing_table(scene, tmp_path, fake_press, capsys) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--set", "friction.mu=0.5", "--set=press.steps=2") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert fake_press.figures is True
    assert fake_press.scene.model().friction.mu == 0.5
    assert fake_press.scene.legs[0].steps == 2
    for text in (
        "converged",
        "304.5 N",
        "72 mm",
        "17 mm",
        "3.0e-11",
        "-0.0123",
        "0.125 MPa",
        "summary.json",
        "Fig. 9 finger",
    ):
        assert text in out
    for text in ("meshing", "mesh taken from the cache", "2 of 2: remark 1"):
        assert text in out


def test_press_that_does_not_converge_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = Outcome.NO_CONVERGENCE
    assert run("press", scene, "--out", tmp_path / "out") == 3
    out, err = capsys.readouterr()
    assert "5 mm, increment 1 " in out  # the numbers of the one that converged
    assert len(err.splitlines()) == 1
    assert str(Outcome.NO_CONVERGENCE) in err
    assert "1 of 2 increments" in err


def test_press_that_misses_something_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = MissingError("no mesher; install pytetwild")
    assert run("press", scene, "--out", tmp_path / "out") == 3
    assert capsys.readouterr().err == "finger3d: no mesher; install pytetwild\n"


def test_an_interrupted_press_ends_with_130_and_says_what_is_kept(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = KeyboardInterrupt()
    assert run("press", scene, "--out", tmp_path / "out") == 130
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "2 of 2 increments" in err
    assert str(tmp_path / "out") in err


@pytest.mark.parametrize(
    ("out", "expected"),
    [
        ("scene.toml", "is a file"), ("scene.toml/deeper", "deeper"), (".", "scene.toml"),
        ("circle", "circle is a link that leads nowhere"), ("circle/deeper", "circle is a link that leads nowhere"),
    ],
)  # fmt: skip
def test_press_refuses_a_folder_it_cannot_use_before_any_work(
    out, expected, scene, tmp_path, fake_press, capsys
) -> None:
    before = scene.read_bytes()
    (tmp_path / "circle").symlink_to("circle")
    err = refused(capsys, "press", scene, "--out", tmp_path / out)
    assert "--out" in err
    assert expected in err
    assert fake_press.scene is None
    assert scene.read_bytes() == before


def test_press_as_json_prints_the_summary_alone(scene, tmp_path, fake_press, capsys) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "2 of 2: remark 1" in err


# --- command ``plan``: effects, size and cost, without a solution ----------------------------------------------------


def test_plan_tells_effects_and_forecast_and_solves_nothing(scene, fake_press, capsys) -> None:
    assert run("plan", scene, "--set", "title=planned [b]") == 0
    out, err = capsys.readouterr()
    assert err == ""
    for text in ("planned [b]", "dofs", "symmetry", "x and z", "memory MB", "no [effects.kinetic_friction]"):
        assert text in out
    assert fake_press.scene is None


# --- command ``compare``: the verdict and its JSON -------------------------------------------------------------------


@pytest.fixture
def swept_scene(tmp_path) -> Path:
    return written(tmp_path, SWEPT_FINGER)


def test_the_command_prints_the_verdict(swept_scene, tmp_path, capsys) -> None:
    assert main(["compare", str(swept_scene), "--out", str(tmp_path / "out"), "--widths", "50"]) == 0
    out = capsys.readouterr().out
    assert "6 of 6" in out
    assert all(line in out for line in json.loads((tmp_path / "out" / "compare.json").read_text())["verdict"])


@pytest.mark.parametrize("widths", ["5,abc", "inf"])
def test_widths_that_are_none_are_refused_in_one_line(swept_scene, tmp_path, capsys, widths) -> None:
    err = refused(capsys, "compare", swept_scene, "--out", tmp_path / "out", f"--widths={widths}")
    assert err.startswith("finger3d: --widths")


def test_a_case_that_fails_is_named_and_the_others_are_kept(swept_scene, tmp_path, monkeypatch, capsys) -> None:
    def failing(name, model):
        if name == "solid":
            return Case(name, model.design.width_mm, model.mesh.size_mm, "swept", Outcome.NO_CONVERGENCE)
        return press_with_errors(name, model)

    monkeypatch.setattr(compare_module, "press_with_errors", failing)
    assert main(["compare", str(swept_scene), "--out", str(tmp_path / "out"), "--widths", "50"]) == 3
    captured = capsys.readouterr()
    assert "2 of 6 cases" in captured.err
    assert "solid, 20 mm wide" in captured.out
    told = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert told["outcome"] == str(Outcome.NO_CONVERGENCE)
    assert sum(bool(c["numbers"]) for c in told["cases"]) == 4


def test_an_interrupted_comparison_keeps_its_cases(swept_scene, tmp_path, monkeypatch, capsys) -> None:
    def interrupted(name, model):
        if name == "solid":
            raise KeyboardInterrupt
        return press_with_errors(name, model)

    monkeypatch.setattr(compare_module, "press_with_errors", interrupted)
    assert main(["compare", str(swept_scene), "--out", str(tmp_path / "out")]) == 130
    assert "2 of 15 cases" in capsys.readouterr().err
    told = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert told["outcome"].startswith("incomplete")
    assert [c["model"] for c in told["cases"]] == ["plane strain", "plane stress"]


# --- command ``cost``: a table, JSON, a figure, and its mistakes -----------------------------------------------------


BASE = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 1.0, "base_size_mm": 4.0},
    "friction": {"mu": 0.4},
}


def test_the_command_prints_a_table_json_and_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, png = tmp_path / "scene.toml", tmp_path / "cost.png"
    path.write_text(sensor_scene(**BASE).to_toml())
    assert main(["cost", str(path), "--of", "gauge_g36,stick_area_mm2", "--png", str(png)]) == 0
    text = capsys.readouterr().out
    for words in ("this mesh", "0.3 %", "stick area mm2", "--set mesh.size_mm="):
        assert words in text
    assert png.stat().st_size > 10_000
    assert main(["cost", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["error"] for row in data["rows"]] == [None, *ERRORS]
    assert set(data["of"]) == {"normal_force_N", "friction_sum_N", "gauge_g36", "gauge_long"}
    assert main(["cost", str(path), "--png", "cost.jpg"]) == 2
    assert main(["cost", str(path), "--of", "gauge"]) == 2


# --- command ``sensitivity``: its files, and mistakes in one line ----------------------------------------------------


COARSE_SECTION = {
    "model": {"domain": "plane-strain"},
    "mesh": {"size_mm": 3.0, "base_size_mm": 10.0},
    "friction": {"mu": 0.4},
}


def test_the_command_writes_table_json_and_figure(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(sensor_scene(**COARSE_SECTION).to_toml(), encoding="utf-8")
    out = tmp_path / "out"
    options = ["--of", "gauge_g36,stick_area_mm2", "--tolerance", "gauge.g36.x_mm=0.5"]
    assert main(["sensitivity", str(file), *options, "--out", str(out)]) == 0
    assert "finger.radius_mm" in capsys.readouterr().out
    found = json.loads((out / "sensitivity.json").read_text())
    assert set(found["effects"]) == {"gauge_g36", "stick_area_mm2"}
    assert (found["changes"]["press.depth_mm"], found["changes"]["gauge.g36.x_mm"]) == (0.1, 0.5)
    effect = found["effects"]["gauge_g36"]["gauge.g36.x_mm"]
    assert effect["value"] == pytest.approx((effect["growing"] - effect["falling"]) / 1.0)
    assert set(effect) == {"value", "falling", "falling_error", "growing", "growing_error"}
    assert {p.name for p in out.iterdir()} >= {"sensitivity.csv", "sensitivity.png"}


@pytest.mark.parametrize(
    ("of", "key", "text"),
    [
        ("gauge_g3", "friction.mu=0.4", "must be one of normal_force_N, friction_sum_N"),
        ("gauge_g36", "friction.mu=-1", "friction.mu = -1"),
    ],
)
def test_bad_input_is_one_line(of: str, key: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(sensor_scene(**COARSE_SECTION).to_toml(), encoding="utf-8")
    assert text in refused(capsys, "sensitivity", file, "--of", of, "--set", key, "--out", tmp_path / "out")


# --- command ``sweep``: what is refused, and the points that are shown -----------------------------------------------


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu"], "KEY=VALUE"),
        (["friction.mu=0.1,,2"], "friction.mu"),
        (["friction.mu=0.1,0.1"], '"0.1"'),
        (["friction.mu=0.1", "friction.mu=2"], "--vary friction.mu: "),
        (["gauge.g36.x_mm=1", "gauge.0.x_mm=2"], "gauge.0.x_mm"),
        (["friction.mu=0.1,-2"], "friction.mu = -2: "),
        (["mesh={tolerance=0.05}"], "mesh.size_mm"),
        (["gauge.g36.x_mm=1,70"], "x_mm = 70"),
        ([f"friction.mu={','.join(map(str, range(400)))}", f"material.nu={','.join(map(str, range(400)))}"], "160000"),
    ],
)
def test_bad_values_are_refused_before_the_first_run(vary, expected, paper_scene, tmp_path, capsys) -> None:
    options = [option for text in vary for option in ("--vary", text)]
    assert run("sweep", paper_scene, *COARSE, *options, "--out", tmp_path / "out") == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "code", "expected"),
    [
        (["--workers", "0"], 2, "--workers 0"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], 2, "--scheduler"),
        (["--scheduler", "here"], 2, "HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1:1"], 3, "tcp://127.0.0.1:1"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_told_in_one_line(
    options, code, expected, paper_scene, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.cluster.CONNECT_S", 1.0)
    arguments = [
        "sweep",
        str(paper_scene),
        *COARSE,
        "--vary",
        "friction.mu=0.1",
        "--out",
        str(tmp_path / "out"),
        *options,
    ]
    assert main(arguments) == code
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err


def test_one_body_is_swept_without_workers_and_its_points_are_shown(paper_scene, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.local.press", lambda *a: pytest.fail("workers were started"))
    vary = ["--vary", "friction.mu=0.1,0.2,0.3,0.4,0.5,0.6", "--vary", "gauge.g36.angle_deg=15,30"]
    assert main(["sweep", str(paper_scene), *COARSE, *vary, "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    found = table(tmp_path)
    assert len(found) == 12
    for row in found[:10]:
        names = ("friction.mu", "gauge.g36.angle_deg", "normal_force_N", "friction_sum_N")
        mine = [f"{float(row[name]):.5g}" for name in names]
        (line,) = (line.split() for line in told.splitlines() if line.split()[:4] == mine)
        assert line[-2:] == [f"{float(row['gauge_g36']):.5g}", "converged"]
    assert "10 of 12" in told
    assert str(tmp_path / "report.html") in told
    assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 0
    monkeypatch.setattr("webbrowser.open", lambda url: None)
    assert main(["show", str(tmp_path)]) == 0
    assert f"open {tmp_path / 'report.html'}" in capsys.readouterr().out
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert main(["sweep", str(paper_scene), *COARSE, *vary, "--out", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["points"], data["kept"], data["failed"], data["bodies"]) == (12, 12, 0, 1)
    assert [row["gauge_g36"] for row in data["rows"]] == [float(row["gauge_g36"]) for row in found]


# --- command ``show``: the page and pictures -------------------------------------------------------------------------


def test_a_section_as_a_picture(section: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    png = tmp_path / "with space" / "a.png"
    assert main(["show", str(section), "--png", str(png)]) == 0
    assert capsys.readouterr().out == f"{png} written\n"
    assert orange(rgb(png)) > 5e-4  # two points at either edge slip, at 4e-4 each
    assert marked(rgb(png)) > 30


def test_a_solid_without_opengl(solid: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    assert main(["show", str(solid), "--png", str(tmp_path / "a.png"), "--step", "2"]) == 0
    image = rgb(tmp_path / "a.png")
    assert orange(image) > 1e-3
    assert marked(image) > 30
    # the left panel shows pressure, not status
    assert orange(image[:, ::-1]) < 0.5 * orange(image)
    assert main(["show", str(solid), "--png", str(tmp_path / "b.png")]) == 0
    assert np.abs(rgb(tmp_path / "b.png").mean() - image.mean()) > 0.01


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["nothing", "--png", "a.png"], 2, "nothing"),
        (["empty", "--png", "a.png"], 2, "empty"),
        (["cut", "--png", "a.png"], 3, "incomplete"),
        (["whole", "--step", "1"], 2, "--step"),
        (["whole", "--png", "a.jpg"], 2, ".png"),
        (["whole", "--gif", "a.gif"], 2, "--gif is gone"),
        (["whole", "--png", "a.png", "--step", "9"], 2, "increment 9 "),
        (["swept"], 2, "not finished"),
        (["swept", "--png", "a.png"], 2, "swept"),
        (["respelt", "--png", "a.png"], 2, "respelt"),
    ],
)
def test_nothing_to_show_is_one_line(
    arguments: list[str], code: int, said: str, section: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda url: pytest.fail(f"{url} was opened"))
    (tmp_path / "empty").mkdir()
    (tmp_path / "cut").mkdir()
    cut = {"outcome": "incomplete", "scene": {"finger": {"geometry": "block"}}, "warnings": [], "advice": []}
    (tmp_path / "cut" / "summary.json").write_text(json.dumps(cut))
    (tmp_path / "swept").mkdir()
    (tmp_path / "swept" / "sweep.json").write_text(json.dumps({"vary": {"friction.mu": ["0.1", "0.2"]}}))
    (tmp_path / "respelt").mkdir()
    (tmp_path / "respelt" / "sweep.json").write_text(json.dumps({"vary": {"friction.mu": ["0.1", "0.2"]}}))
    (tmp_path / "respelt" / "results.csv").write_text("point;outcome\n0;converged\n")
    (tmp_path / "whole").symlink_to(section)
    assert main(["show", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.glob("a.*"))


def test_the_page_of_a_press_is_opened_and_written_if_it_is_not_there(
    section: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, opened = tmp_path / "copied", []
    shutil.copytree(section, folder, ignore=shutil.ignore_patterns("report.html"))
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert main(["show", str(folder)]) == 0
    assert capsys.readouterr().out == f"open {folder / 'report.html'}\n"
    assert opened == [(folder / "report.html").as_uri()]
    assert "finger3d press" in (folder / "report.html").read_text(encoding="utf-8")


# --- command app: it serves the page of a scene until it is interrupted ----------------------------------------------


def test_the_page_is_served_and_ends_on_an_interruption(tmp_path: Path) -> None:
    scene = written(tmp_path, SECTION)
    command = [sys.executable, "-m", "finger3d", "app", str(scene), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        url = next(line.split()[-1] for line in running.stdout if "http" in line)
        with urllib.request.urlopen(url, timeout=30) as page:
            assert page.status == 200
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=30)
    assert running.returncode == 130
    assert said == "finger3d: interrupted; the page is closed\n"


def test_an_effect_that_takes_seconds_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path, SECTION)
    assert main(["app", str(scene), "--set", "effects.large_deformation={}", "--no-browser"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert "large_deformation" in said[-1]


@pytest.mark.slow
def test_the_window_off_screen_answers_its_controls(solid: Path, section: Path, tmp_path: Path) -> None:
    for folder in (solid, section):
        picture = tmp_path / f"{folder.parent.name}.png"
        with running_child(
            [sys.executable, "-P", "-m", "finger3d.plotting.window", str(folder), str(picture)]
        ) as ended:
            assert ended() is None
        assert rgb(picture).std() > 10.0
        assert marked(rgb(picture)) > 30


def test_without_a_display_the_page_opens(section: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert main(["show", str(section)]) == 0
    assert opened == [(section / "report.html").resolve().as_uri()]
