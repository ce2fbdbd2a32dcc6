"""The project: metadata, platforms, imports, citations, types, errors."""

from __future__ import annotations

import ast
import graphlib
import json
import math
import re
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d import _machine
from finger3d.contact.state import ContactState
from tests.meshes import grid

HEAVY = set(
    "build123d OCP pyvista vtk vtkmodules pytetwild matplotlib trimesh dask distributed pyarrow pandas plotly".split()
)


def sources(root: Path) -> list[Path]:
    """Python files of the package and the designs."""
    return [p for folder in ("finger3d", "geometries") for p in (root / folder).rglob("*.py")]


def project(root: Path) -> dict:
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]


def name_of(requirement: str) -> str:
    """Name of a requirement as PyPI compares names."""
    return re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", requirement)[0]).lower()


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=root, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def test_the_wheel_carries_the_designs_and_nothing_by_accident(root: Path, wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for source in sources(root):
        inside = source.relative_to(root).as_posix()
        assert (f"finger3d/{inside}" if inside.startswith("geometries/") else inside) in names
    for data in (
        "geometries/fig9.toml", "geometries/gear.stl", "py.typed", "new_scene.toml", "report/style.css",
        "mold/sheet_template.txt", "report/view3d.js", "report/plotly/plotly-gl3d.min.js", "report/plotly/LICENSE",
        "materials/silicones.toml",
    ):  # fmt: skip
        assert f"finger3d/{data}" in names
    assert {name.split("/")[0] for name in names} == {"finger3d", f"finger3d-{project(root)['version']}.dist-info"}
    assert not [name for name in names if "__pycache__" in name]


def test_every_dependency_is_pinned(root: Path) -> None:
    lines = [x for x in (root / "constraints.txt").read_text().splitlines() if x and not x.startswith("#")]
    assert all(re.fullmatch(r"[a-z0-9-]+==[\w.+]+", line) for line in lines)
    pinned = {line.split("==")[0] for line in lines}
    wanted = project(root)["dependencies"] + [r for rs in project(root)["optional-dependencies"].values() for r in rs]
    wanted = [requirement for requirement in wanted if not requirement.startswith("finger3d[")]
    assert {name_of(r) for r in wanted} <= pinned
    assert "cadquery" not in pinned  # its OCP wheel clashes with VTK


def test_versions_agree(root: Path) -> None:
    version = project(root)["version"]
    assert f"\nversion: {version}\n" in (root / "CITATION.cff").read_text()
    assert f"## {version}" in (root / "CHANGELOG.md").read_text()
    assert json.loads((root / "codemeta.json").read_text())["version"] == version


def test_every_reference_of_the_paper_is_cited_and_every_citation_has_one(root: Path) -> None:
    entries = re.findall(r"^@\w+\{(\w+),", (root / "docs" / "paper" / "paper.bib").read_text(), flags=re.MULTILINE)
    text = (root / "docs" / "paper" / "paper.md").read_text().split("---", 2)[2]
    assert len(entries) == len(set(entries)) > 10
    assert set(re.findall(r"@(\w+)", text)) == set(entries)


def test_what_the_paper_says_of_the_studies_is_true(root: Path) -> None:
    text = " ".join((root / "docs" / "paper" / "paper.md").read_text().split())
    told = re.search(r"(\d+) studies\b[^.]*?(\d+) comparisons\b.*?(\d+) statements\b", text)
    assert told is not None
    told_studies, told_rows, told_statements = map(int, told.groups())
    index = (root / "validation" / "README.md").read_text()
    found = re.search(
        r"^(\d+) of (\d+) rows pass, (\d+) of the paper's (\d+) statements hold, (\d+) of (\d+) other statements hold; "
        r"(\d+) studies",
        index,
        re.MULTILINE,
    )
    assert found is not None
    passing, rows, by_paper, in_paper, others, other, studies = map(int, found.groups())
    holding, statements = by_paper + others, in_paper + other
    assert told_rows < passing == rows
    assert told_studies < studies
    assert statements == pytest.approx(told_statements, abs=50)
    assert 0.5 < holding / statements < 0.6


def test_local_links_lead_somewhere(root: Path) -> None:
    for page in [root / "README.md", root / "CONTRIBUTING.md", *root.glob("docs/*.md")]:
        for target in re.findall(r"\]\((?!https?://)([^)#]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_demo_scene_is_the_papers_finger(root: Path) -> None:
    scene = tomllib.loads((root / "geometries" / "fig9.toml").read_text())
    finger = {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0}
    assert scene["finger"] == {"geometry": "clipped_cylinder", **finger}
    assert (scene["material"]["nu"], scene["friction"]["mu"]) == (0.49, 0.25)
    assert scene["press"] == {"depth_mm": 10.0}


def test_heavy_packages_are_imported_inside_functions(root: Path) -> None:
    found = []
    for path in sources(root):
        for node in ast.parse(path.read_text()).body:
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
            found += [f"{path.name}: {n}" for n in names if n.split(".")[0] in HEAVY]
    assert found == []


def imports(root: Path) -> dict[str, set[str]]:
    """Modules that each module of the package imports anywhere; of a package, those files that names are taken from."""
    files = {".".join(p.relative_to(root).with_suffix("").parts): p for p in (root / "finger3d").rglob("*.py")}
    modules = {name.removesuffix(".__init__"): path for name, path in files.items()}
    found: dict[str, set[str]] = {name: set() for name in modules}
    for name, path in modules.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found[name] |= {alias.name for alias in node.names} & set(modules)
            elif isinstance(node, ast.ImportFrom) and node.module in modules:
                inner = {f"{node.module}.{alias.name}" for alias in node.names} & set(modules)
                found[name] |= inner or {node.module}
        found[name].discard(name)
    return found


def test_neither_modules_nor_folders_import_each_other_in_a_circle(root: Path) -> None:
    arrows = imports(root)
    graphs = {"modules": arrows}
    for module, others in arrows.items():
        for other in others:
            one, two = module.split("."), other.split(".")
            level = next((k for k, (a, b) in enumerate(zip(one, two, strict=False)) if a != b), None)
            if level is not None:
                graph = graphs.setdefault(".".join(one[:level]), {})
                graph.setdefault(one[level], set()).add(two[level])
    assert len(graphs) > 10
    for folder, graph in graphs.items():
        assert list(graphlib.TopologicalSorter(graph).static_order()), folder  # a CycleError names the circle


def test_no_function_is_too_complex(root: Path) -> None:
    limit = ["--select", "C901", "--config", "lint.mccabe.max-complexity=15"]
    command = [sys.executable, "-m", "ruff", "check", *limit, "finger3d", "geometries"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


POORER = """
import os, signal, sys
for name in ("resource", "fcntl", "pwd", "grp", "termios"):
    sys.modules[name] = None
for name in ("killpg", "sysconf", "sched_getaffinity", "getuid", "geteuid", "fork", "setsid", "getpgid"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGKILL", "pthread_sigmask"):
    if hasattr(signal, name):
        delattr(signal, name)
"""


def test_every_module_is_imported_and_a_section_pressed_without_what_windows_lacks(paper_scene, tmp_path) -> None:
    code = POORER + (
        "import importlib, pkgutil, finger3d\n"
        "for module in pkgutil.walk_packages(finger3d.__path__, 'finger3d.'):\n"
        "    if not module.name.startswith(('finger3d.__main__', 'finger3d.app')):\n"
        "        importlib.import_module(module.name)\n"
        "from finger3d.cli import main\nsys.exit(main(sys.argv[1:]))"
    )
    words = ["press", str(paper_scene), "--out", "o", "--set", "model.domain=plane-strain", "--set", "press.steps=2"]
    words += ["--set", "mesh.size_mm=6", "--set", "mesh.base_size_mm=16"]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    summary = (tmp_path / "o" / "summary.json").read_text()
    assert '"peak_memory_MB": null' in summary
    assert "unknown" in (tmp_path / "o" / "report.html").read_text(encoding="utf-8")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no getrusage")
def test_peak_memory_is_in_bytes_on_macos_and_in_kib_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    import resource

    class Usage:
        ru_maxrss = 3 * 2**30

    monkeypatch.setattr(resource, "getrusage", lambda who: Usage)
    monkeypatch.setattr(sys, "platform", "darwin")
    assert _machine.peak_memory_MB() == 3072.0
    monkeypatch.setattr(sys, "platform", "linux")
    assert _machine.peak_memory_MB() == 3072.0 * 1024
    monkeypatch.setitem(sys.modules, "resource", None)
    assert math.isnan(_machine.peak_memory_MB())


ROOT = Path(__file__).resolve().parents[1]
REFERENCES = ROOT / "validation" / "REFERENCES.md"
# generated from the studies, whose sources are checked here
GENERATED = ("validation/figures/",)
PRIVATE = re.compile(r"\b(?:references|design|contract|geometry|house|models)\.md\b|\b[Ii]ssues? #?\d")
CITED = re.compile(r"REFERENCES\.md, (\d+(?:\.\d+)?(?:(?:, | and | to )\d+(?:\.\d+)?)*)")


def texts() -> dict[str, str]:
    """Text of every file of the project, by its path."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    found = {}
    for name in filter(None, listed):
        path = ROOT / name
        if path.is_file() and path != Path(__file__).resolve() and not name.startswith(GENERATED):
            try:
                found[name] = path.read_text(encoding="utf-8")
            except UnicodeDecodeError:  # a picture, an STL file
                continue
    return found


def test_no_file_cites_a_page_that_is_not_in_the_project() -> None:
    assert not {name: match[0] for name, text in texts().items() if (match := PRIVATE.search(text))}


def test_every_section_of_the_references_that_is_cited_exists() -> None:
    sections = set(re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", REFERENCES.read_text(encoding="utf-8"), flags=re.MULTILINE))
    cited = {
        (name, section)
        for name, text in texts().items()
        # a citation may be broken across the lines of a docstring or a comment
        for group in CITED.findall(re.sub(r"\s*\n[ #]*", " ", text))
        for section in re.findall(r"\d+(?:\.\d+)?", group)
    }
    assert len(cited) > 50
    assert not {(name, section) for name, section in cited if section not in sections}


def test_every_section_of_the_references_has_its_anchor_and_names_its_users() -> None:
    text = REFERENCES.read_text(encoding="utf-8")
    numbers = re.findall(r"^### (\d+\.\d+) ", text, flags=re.MULTILINE)
    assert len(numbers) == len(set(numbers))
    for section in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        number = section.split(" ")[0]
        assert f'<a id="s{number}"></a>' in section
        users = re.findall(r"Used\s+by:\s+([\w\s,./:*-]+?)\.(?:\s|$)", section)
        assert users, number
        for name in re.findall(r"[\w./]+", " ".join(users)):
            if name != "and":
                path = ROOT / name if name.startswith("tests/") else ROOT / "validation" / f"{name}.py"
                assert path.is_file(), f"{number}: {name}"


def test_arrays_and_arrays_in_mappings_are_read_only() -> None:
    mesh = grid((2, 2))
    state = ContactState.at_rest(np.ones(3), 2)
    for array in (mesh.points, mesh.facets["x-"], replace(mesh, points=mesh.points + 1.0).points, state.force):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
