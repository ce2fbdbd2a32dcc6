"""Shared by all tests: one thread for the numerics, a cache that is not the user's."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from finger3d.fem.mesh import Mesh
    from finger3d.geometry.design import Design
    from finger3d.mold.parts import Mold

# Before numpy or MKL is loaded: several test processes share few cores, and one thread is reproducible.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# A shell ignores Ctrl-C for what it starts in the background, and children inherit that: tests send it to theirs.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Machines here are shared: an example that takes long is no failure, and one that fails tells how to repeat it.
settings.register_profile("shared machine", settings(), deadline=None, print_blob=True)
settings.load_profile("shared machine")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the environments of wheels, which take minutes each: the last tests are short, and share the cores."""
    items.sort(key=lambda item: item.path.stem != "test_wheel")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Meshes made by tests live in a folder of their own, shared by one run."""
    if "FINGER3D_CACHE" not in os.environ:
        os.environ["FINGER3D_CACHE"] = str(tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="session")
def root() -> Path:
    """The top of the repository."""
    return Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def paper_scene(root: Path) -> Path:
    """The scene file of the Fig. 9 finger."""
    return root / "geometries" / "fig9.toml"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The example scene, as ``finger3d new`` writes it."""
    from tests.commands import run

    path = tmp_path / "scene.toml"
    assert run("new", path) == 0
    return path


@pytest.fixture
def fake_press(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A press that writes two steps of `STEP` and ends with `end`; the arguments of the call are kept."""
    import finger3d.analyses.press
    from finger3d.errors import Outcome
    from tests.commands import STEP

    calls = SimpleNamespace(end=Outcome.CONVERGED, scene=None, figures=None)

    def press(scene, out, report, figures=True, error=True, least_grip=False):
        calls.scene, calls.figures = scene, figures
        steps = [{**STEP, "depth_mm": 5.0}, STEP]
        if isinstance(calls.end, Outcome) and not calls.end.ok:
            steps[1] = {**STEP, "outcome": str(calls.end)}
        summary = {"outcome": str(calls.end), "steps": steps, "cost": {"seconds": {"total": 1.5}}}
        report.stage("meshing")
        report.say("mesh taken from the cache")
        out.mkdir(exist_ok=True)
        (out / "summary.json").write_text(json.dumps(summary))
        for i in range(2):
            report.step(i + 1, 2, f"remark {i}")
        if isinstance(calls.end, BaseException):
            raise calls.end
        return SimpleNamespace(summary=lambda: summary, outcome=calls.end, out=out)

    monkeypatch.setattr(finger3d.analyses.press, "press", press)
    return calls


@pytest.fixture(scope="session")
def section(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a press in 2D by the command line, with figures; not to be changed."""
    from tests.scenes import SECTION, pressed

    return pressed(tmp_path_factory.mktemp("section"), SECTION)


@pytest.fixture(scope="session")
def solid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the same press in 3D."""
    from tests.scenes import SOLID, pressed

    return pressed(tmp_path_factory.mktemp("solid"), SOLID)


@pytest.fixture(scope="session")
def real() -> tuple[Mesh, Any, list[str]]:
    """The quarter of the Fig. 9 finger by pytetwild, its report, and what was said."""
    from finger3d.meshing.generate import mesh_solid
    from tests.designs import FIG9, OPTIONS, ZONE
    from tests.logs import Log

    said = Log()
    mesh, report = mesh_solid(FIG9, OPTIONS, ZONE, ("x", "z"), said)
    return mesh, report, said.lines


@pytest.fixture(scope="session")
def paper_finger() -> Design:
    """The Fig. 9 finger."""
    from tests.designs import FIG9

    return FIG9


@pytest.fixture(scope="session")
def paper_mold(paper_finger: Design) -> Mold:
    """The mold of the Fig. 9 finger with slots for `GAUGES`, and all that a mold has by default."""
    from finger3d.mold.cover import foils
    from finger3d.mold.options import MoldOptions
    from finger3d.mold.parts import mold
    from tests.mold_cases import GAUGES

    options = MoldOptions(shrinkage=0.01)
    return mold(paper_finger.solid(), foils(GAUGES), options)


@pytest.fixture(scope="session")
def molds(paper_mold: Mold) -> Mapping[str, Mold]:
    """Molds that together have every feature, by a name that says which; each is made when it is asked for."""
    from tests.mold_cases import FEW, made

    class Molds(dict[str, "Mold"]):
        def __missing__(self, name: str) -> Mold:
            return self.setdefault(name, made(*FEW[name]))

    return Molds({"screws, gauges": paper_mold})


@pytest.fixture(scope="session")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files: one finger as STEP, in inches too, and STL, drawn away from the origin; other things."""
    from build123d import Axis, Box, Compound, Face, Pos, Sphere, Unit, export_stl, fillet

    from tests.bodies import step_of
    from tests.designs import SMALL

    folder = tmp_path_factory.mktemp("drawn")
    finger = Pos(12.0, -7.0, 33.0) * SMALL.solid()
    step_of(folder / "finger.step", finger)
    step_of(folder / "inches.step", finger, unit=Unit.IN)
    export_stl(finger, folder / "finger.stl", tolerance=1e-4, angular_tolerance=0.05)
    step_of(folder / "two.step", Compound([Box(5, 5, 5), Pos(10, 0, 0) * Box(5, 5, 5)]))
    step_of(folder / "face.step", Face.make_rect(5, 5))
    step_of(folder / "ball.step", Sphere(10.0))
    pad = Pos(0.0, 2.5, 0.0) * Box(12.0, 5.0, 8.0)
    step_of(folder / "rounded.step", fillet(pad.faces().sort_by(Axis.Y)[-1].edges(), 1.5))
    return folder


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are saved; solids are drawn by matplotlib."""
    from matplotlib.figure import Figure

    seen, save = [], Figure.savefig

    def kept(figure: Any, *arguments: Any, **options: Any) -> None:
        seen.append(figure)
        save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", kept)
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    return seen


@pytest.fixture
def fresh_renderer(monkeypatch: pytest.MonkeyPatch) -> None:
    """No renderer is forced, and no crash of another test is remembered."""
    from finger3d.plotting import renderer

    monkeypatch.delenv("FINGER3D_RENDERER", raising=False)
    monkeypatch.setattr(renderer, "FAILURES", [])
