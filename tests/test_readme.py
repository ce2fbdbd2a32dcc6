"""README, docs/ and CONTRIBUTING: every command and every example is run, and the key table is that of the code."""

from __future__ import annotations

import csv
import math
import re
import runpy
import shlex
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from finger3d.cli import main

COARSE = {
    "press": "mesh.mesher=swept mesh.size_mm=4.0 mesh.base_size_mm=12.0",
    "gear": "mesh.mesher=swept mesh.size_mm=1.5 mesh.base_size_mm=5.0",
    "compare": "mesh.mesher=swept mesh.size_mm=8.0 mesh.base_size_mm=20.0 press.steps=5 effects.auto=false",
    "sensitivity": "mesh.size_mm=3.0 mesh.base_size_mm=10.0",
    "cost": "mesh.mesher=swept mesh.size_mm=4.0 mesh.base_size_mm=12.0",
    "calibrate": "mesh.size_mm=2.0 mesh.base_size_mm=8.0 press.steps=10",
    "sweep": "model.domain=plane-strain mesh.size_mm=3.0 mesh.base_size_mm=12.0 press.steps=5",
    "identify": "model.domain=plane-strain mesh.size_mm=4.0 mesh.base_size_mm=12.0 press.steps=5",
    "optimise": "model.domain=plane-strain mesh.size_mm=3.0 mesh.base_size_mm=12.0 press.steps=10",
}
"""What a test adds to a command, so that it takes seconds; the commands are the README's otherwise."""


def commands(root: Path) -> list[str]:
    """Every command that the README and the pages of docs/ show, once; those of docs/molds.md are tested apart."""
    first, apart = [root / "README.md", root / "docs" / "start.md"], root / "docs" / "molds.md"
    return commands_of([*first, *sorted(set(root.glob("docs/*.md")) - {*first, apart})])


def of_readme(root: Path) -> list[str]:
    """Every command that the README shows, once."""
    return commands_of([root / "README.md"])


def commands_of(pages: list[Path]) -> list[str]:
    """Every command that some pages show, once."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    blocks = re.findall(r"```sh\n(.*?)```", text.replace(" \\\n", ""), flags=re.DOTALL)
    lines = [line.split("  #")[0].strip() for block in blocks for line in block.splitlines()]
    return list(dict.fromkeys(line for line in lines if line.startswith("finger3d ")))


def scenes(page: Path) -> dict[str, str]:
    """The scenes that a page asks to be saved, by the names of their files."""
    return dict(re.findall(r"`(\w+\.toml)`:\n\n```toml\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL))


def python(root: Path, heading: str, page: str = "README.md") -> list[str]:
    text = (root / page).read_text(encoding="utf-8")
    part = text[text.index(f"\n## {heading}\n") :].split("\n## ", 2)[1]
    return re.findall(r"```python\n(.*?)```", part, flags=re.DOTALL)


def execute(example: str, names: dict) -> None:
    """Run an example as a file of its own would run: this file's `from __future__` is not its."""
    exec(compile(example, "README.md", "exec", dont_inherit=True), names)


@pytest.fixture
def folder(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with the scenes that the README names."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")  # PyVista draws better, and takes seconds for each picture
    shutil.copytree(root / "geometries", tmp_path / "geometries")
    return tmp_path


@pytest.mark.parametrize("shown", [of_readme, pytest.param(commands, marks=pytest.mark.slow)])
def test_every_command_is_run(
    shown: Callable[[Path], list[str]], root: Path, folder: Path, capsys: pytest.CaptureFixture
) -> None:
    assert {c.split()[1] for c in commands(root)} >= set(
        "new plan cost press compare calibrate estimate identify optimise sweep export show".split()
    )
    quick = {name: text for page in root.glob("docs/*.md") for name, text in scenes(page).items()}
    for name, text in quick.items():
        Path(name).write_text(text, encoding="utf-8")
    tests = [f"{1 + k / 10},{0.3 * (1 + k / 10 - (1 + k / 10) ** -2):.5f},tension" for k in range(1, 11)]  # neo-Hookean
    Path("tests.csv").write_text("\n".join(["stretch,stress_MPa,mode", *tests]) + "\n", encoding="utf-8")
    for command in shown(root):
        words = shlex.split(command.split(" > ")[0])[1:]  # what a shell redirects is printed
        if not quick.keys() & set(words):
            for key in COARSE.get("gear" if "gear" in command else words[0], "").split():
                words += ["--set", key]
        if words[0] == "identify":
            rows = list(csv.DictReader(Path("out/mine/history.csv").open()))
            lines = [f"{row['depth_mm']},{row['normal_force_N']}" for row in rows]
            Path("bench.csv").write_text("\n".join(["depth_mm,normal_force_N", *lines]) + "\n")
        assert main(words) == 0, f"{command}: {capsys.readouterr().err}"


@pytest.mark.slow
def test_every_mold_is_exported(root: Path, folder: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["new", "scene.toml"]) == 0
    for command in commands_of([root / "docs" / "molds.md"]):
        words = shlex.split(command)[1:]
        if words[0] == "export":
            assert main(words) == 0, f"{command}: {capsys.readouterr().err}"


def test_the_python_example_runs(root: Path, folder: Path) -> None:
    scene = Path("geometries/fig9.toml")
    coarse = 'mesher = "swept"\nsize_mm = 4.0\nbase_size_mm = 12.0'
    scene.write_text(scene.read_text(encoding="utf-8").replace("gauge_refinement = 2.0", coarse), encoding="utf-8")
    (example,) = python(root, "A press")
    names: dict = {}
    execute(example, names)
    assert len(names["frame"]) == names["result"].summary()["step_estimate"]["steps"]
    assert names["grid"].n_cells > 0
    assert Path("out/contact.png").is_file()


def test_the_scene_of_the_readme_is_that_of_its_command(root: Path) -> None:
    shown = re.search(r"```toml\n(.*?)```", (root / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    scene = tomllib.loads((root / "geometries" / "fig9.toml").read_text(encoding="utf-8"))
    assert shown
    assert {"title": scene["title"]} | tomllib.loads(shown[1]) == scene


def test_the_first_scene_gives_what_its_page_shows(root: Path, folder: Path, capsys: pytest.CaptureFixture) -> None:
    page = root / "docs" / "start.md"
    text = page.read_text(encoding="utf-8")
    for name, scene in scenes(page).items():
        Path(name).write_text(scene, encoding="utf-8")
    (command,) = (c for c in commands_of([page]) if "first.toml" in c)
    assert main([*shlex.split(command)[1:], "--no-figures"]) == 0
    found = {line.strip() for line in capsys.readouterr().out.splitlines()}
    (shown,) = re.findall(r"```text\n(.*?)```", text, flags=re.DOTALL)
    assert len(shown.splitlines()) > 5
    assert set(shown.splitlines()) <= found
    *_, last = csv.DictReader(Path("out/first/history.csv").open(encoding="utf-8"))
    forces = dict(re.findall(r"^\| `(\w+_force_x_N|force_x_N)` \| ([\d.]+) \|", text, flags=re.MULTILINE))
    assert forces == {key: f"{float(last[key]):.3f}" for key in ("tangential_force_x_N", "force_x_N")}


@pytest.mark.slow
def test_the_numbers_of_the_readme_come_back(root: Path, folder: Path, capsys: pytest.CaptureFixture) -> None:
    """Two meshes of fTetWild agree within two error bars of their difference."""
    assert main(["press", "geometries/fig9.toml", "--out", "out", "--no-figures"]) == 0
    line = r"^ *(normal force|stick area|strain of gauge g36) +([\d.]+) \+- ([\d.]+)"
    told, found = (
        {name: (float(value), float(bar)) for name, value, bar in re.findall(line, text, flags=re.MULTILINE)}
        for text in ((root / "README.md").read_text(encoding="utf-8"), capsys.readouterr().out)
    )
    assert len(told) == 3
    for name, (value, bar) in told.items():
        other, its = found[name]
        assert abs(value - other) <= 2.0 * math.hypot(bar, its), name


def test_the_numbers_beside_other_codes_are_those_of_the_studies(root: Path) -> None:
    text = (root / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| .*\[study\]\(validation/(\w+)\.py\)\) \| (.*) \| (.*) \|$", text, flags=re.MULTILINE)
    assert len(rows) == 3
    for study, *cells in rows:
        with (root / "validation" / "results" / f"{study}.csv").open(newline="", encoding="utf-8") as file:
            known = [float(row[key]) for row in csv.DictReader(file) for key in ("wanted", "got")]
        for number in re.findall(r"\b\d+(?:\.\d+)?", " ".join(cells).replace("CalculiX 2.20", "")):
            digits = len(number.partition(".")[2])
            assert any(round(value, digits) == float(number) for value in known), (study, number)


def test_the_examples_of_adding_work_and_are_short(root: Path, folder: Path) -> None:
    from finger3d.fem.laws.material import Isotropic
    from finger3d.mechanics.discretise.build import build
    from finger3d.mechanics.march.solve import march
    from finger3d.mechanics.model import Leg, MeshOptions, Model

    geometry, effect, study = python(root, "How to add", "CONTRIBUTING.md")
    assert all(len(example.splitlines()) < 20 for example in (geometry, effect, study))
    names: dict = {"__package__": "validation"}  # where the study lies
    for example in (geometry, effect, study):
        execute(example, names)
    pad = names["Pad"](10.0, 5.0)
    assert pad.solid().volume == pytest.approx(pad.volume_mm3, rel=1e-12)
    model = Model(pad, Isotropic(1.0, 0.3), MeshOptions(1.0, 3.0), (Leg(1.0, steps=1),), domain="plane-strain")
    forces = [
        next(iter(march(build(m)))).state.force[:, 0].sum() for m in (model, names["Effect"](kelvin=50.0).apply(model))
    ]
    assert forces[1] / forces[0] == pytest.approx(0.9, rel=1e-9)
    assert names["run"](True).passed


def test_the_examples_of_models_and_objects_in_python_run(root: Path, folder: Path) -> None:
    from dataclasses import replace

    import finger3d

    page = "docs/reference/python.md"
    (model,), (bar,) = (python(root, head, page) for head in ("Models without a scene", "An object of one's own"))
    names: dict = {}
    execute(model, names)
    execute(bar, names)
    for steps in (names["steps"], names["ridge"]):
        assert len(steps) == 20
        assert all(step.outcome.ok for step in steps)
    # the model is that of a scene, where angles are in degrees
    scene = {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
        "material": {"E_MPa": 1.0, "nu": 0.45},
        "mesh": {"size_mm": 0.25, "base_size_mm": 1.0},
        "object": {"shape": "cylinder", "radius_mm": 8.0},
        "friction": {"mu": 0.3},
        "press": {"leg": [{"depth_mm": 0.5, "steps": 10}, {"depth_mm": 0.5, "slide_x_mm": 0.3, "steps": 10}]},
        "gauge": [{"name": "g", "x_mm": 1.0, "y_mm": 4.0, "angle_deg": 30.0}],
        "model": {"domain": "plane-strain"},
        "effects": {"auto": False},
    }
    last = finger3d.press(scene, error=False).last
    assert names["numbers"]["normal_force_N"] == pytest.approx(last.normal_force_N, rel=1e-9)
    assert names["steps"][-1].gauges["g"] == pytest.approx(last.gauges["g"], rel=1e-9)
    # without its flat side the bar is a cylinder
    build, march = names["build"], names["march"]
    forces = [
        list(march(build(replace(names["model"], object=thing))))[-1].state.force[:, 0].sum()
        for thing in (names["RoundedBar"](half_width_mm=0.0, radius_mm=2.0), finger3d.Cylinder(radius_mm=2.0))
    ]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


def test_the_reference_is_the_codes_own(root: Path) -> None:
    quoted = runpy.run_path(str(root / "docs" / "_quoted.py"))
    assert quoted["parts"]("docs/scenes.md")[1] == quoted["keys"]()


@pytest.mark.slow
def test_the_table_of_costs_is_what_cost_prints(root: Path) -> None:
    quoted = runpy.run_path(str(root / "docs" / "_quoted.py"))
    told, now = (
        [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()]
        for text in (quoted["parts"]("docs/accuracy.md")[1], quoted["cost_table"]())
    )
    assert told[:2] == now[:2]
    both = [(before, after) for before in told[2:] for after in now[2:] if before[0] == after[0]]
    assert len(both) >= 2  # the smallest errors fit into memory or not
    # over seven meshes of fTetWild, error bars have a standard deviation of 30 %, so that two differ by less than a
    # factor of 4 (3.3 deviations); that of the gauge, by which edges are chosen, was 6.5 to 7.5 %, less than 2; edges
    # for an error differ by the power 1 / 1.2 of that, unknowns by the third power of these, on one edge by 0.8 to 1.2
    for before, after in both:
        edges, unknowns = (1.0, 1.3) if before[0] == "default" else (1.8, 6.0)
        for column, factor in {1: edges, 2: unknowns, 5: 4.0, 6: 2.0, 7: 4.0}.items():
            one, other = (re.findall(r"[\d.]+", row[column].replace(" ", "")) for row in (before, after))
            ratios = [float(a) / float(b) for a, b in zip(one, other, strict=True)]
            assert all(1.0 / factor <= ratio <= factor for ratio in ratios), (before, after)


@pytest.mark.slow
def test_the_readings_of_two_gauges_give_the_mu_it_states(
    root: Path, folder: Path, capsys: pytest.CaptureFixture
) -> None:
    assert main(["new", "scene.toml"]) == 0
    joint = [c for c in commands(root) if "--gauges 2" in c or "--gauge g1,g2" in c or "--strain g1" in c]
    assert len(joint) == 3
    for command in joint:
        assert main(shlex.split(command)[1:]) == 0
    found = re.search(r"mu = ([\d.]+) \+- ([\d.]+)", capsys.readouterr().out.splitlines()[-1])
    assert found
    # the page states two figures of the strains, and the standard deviation 0.013
    (quoted,) = re.findall(r"--strain g2=\S+ +# mu = ([\d.]+)", (root / "docs/sensor.md").read_text(encoding="utf-8"))
    assert float(found[1]) == pytest.approx(float(quoted), abs=0.005)
    assert float(found[2]) == pytest.approx(0.013, abs=0.002)


@pytest.mark.slow
def test_every_estimate_of_the_tutorial_on_friction_finds_the_mu_that_was_read(
    root: Path, folder: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    runpy.run_path(str(root / "docs" / "tutorials" / "friction.py"))
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("mu = ")]
    found = [[float(number) for number in re.findall(r"\d\.\d+", line)] for line in told]
    assert not any("coarser" in line for line in told)
    for (mu, std, low, high), true in zip(found, (0.2, 0.3, 0.4) * 2, strict=True):
        assert abs(mu - true) < std + 5e-4  # of three digits
        assert low <= true <= high
