"""Other platforms, as far as one can tell here: what POSIX has and Windows lacks is taken away, and finger3d works."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest

from finger3d import _machine

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
