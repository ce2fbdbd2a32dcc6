"""Shared by all tests: one thread for the numerics, a cache that is not the user's."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import settings

# Before numpy or MKL is loaded: several test processes share few cores, and one thread is reproducible.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# A shell ignores Ctrl-C for what it starts in the background, and children inherit that: tests send it to theirs.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Machines here are shared: an example that takes long is no failure, and one that fails tells how to repeat it.
settings.register_profile("shared machine", settings(), deadline=None, print_blob=True)
settings.load_profile("shared machine")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Meshes made by tests live in a folder of their own, shared by one run."""
    if "FINGER3D_CACHE" not in os.environ:
        os.environ["FINGER3D_CACHE"] = str(tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="session")
def root() -> Path:
    """The top of the repository."""
    return Path(__file__).resolve().parent.parent


@pytest.fixture
def fake_press(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A press that writes two steps of `STEP` and ends with `end`; the arguments of the call are kept."""
    import finger3d.analyses.press
    from finger3d.errors import Outcome
    from tests.commands import STEP

    calls = SimpleNamespace(end=Outcome.CONVERGED, scene=None, figures=None)

    def press(scene, out, report, figures=True, error=True):
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
