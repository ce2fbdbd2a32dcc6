"""Versions, cores and memory; child processes: what they import, and that they end with their parent."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

import pytest

import finger3d
from finger3d import _machine
from finger3d._machine import (
    PACKAGES,
    child_environment,
    cores,
    environment_bytes,
    made_with,
    memory_bytes,
    source_hash,
    versions,
)


def test_versions_are_those_installed_and_absent_packages_are_left_out() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == metadata.version("numpy")
    assert set(found) <= {"python", *PACKAGES}


def test_the_source_of_designs_effects_and_tables_shapes_numbers(tmp_path: Path, monkeypatch) -> None:
    package = tmp_path / "finger3d"
    files = [package / "effects" / "own.py", package / "silicones.toml", tmp_path / "geometries" / "own.py"]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("1")
    monkeypatch.setattr(_machine, "__file__", str(package / "_machine.py"))
    source_hash.cache_clear()
    found = {made_with()["the source of finger3d and its designs"]}
    for file in files:
        file.write_text("2")
        source_hash.cache_clear()
        found.add(source_hash())
    source_hash.cache_clear()
    assert len(found) == 4
    assert "matplotlib" not in made_with()


def test_a_file_with_two_names_counts_once(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 100_000)
    one = environment_bytes(tmp_path)
    assert 100_000 <= one < 200_000
    os.link(tmp_path / "a", tmp_path / "b")
    assert environment_bytes(tmp_path) == one


def test_changing_the_answer_changes_no_later_one() -> None:
    versions()["numpy"] = "0"
    assert versions()["numpy"] != "0"


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no processor affinity")
def test_only_cores_that_may_be_used_count() -> None:
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)


def test_available_memory_is_part_of_all() -> None:
    found = memory_bytes()
    assert found is None or 0 < found[1] <= found[0]


def test_a_child_imports_the_same_package(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-c", "import finger3d; print(finger3d.__file__)"]
    done = subprocess.run(command, env=child_environment(), cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()) == Path(finger3d.__file__)


def test_an_existing_path_is_kept_behind_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    assert child_environment()["PYTHONPATH"].endswith(":/elsewhere")


@pytest.mark.skipif(sys.platform != "linux", reason="only the Linux kernel ends a child with its parent")
def test_a_child_ends_with_a_parent_that_is_killed() -> None:
    child = "import os, time; from finger3d._machine import end_with; end_with(os.getppid()); print(1); time.sleep(60)"
    parent = (
        "import subprocess, sys; child = subprocess.Popen([sys.executable, '-c', sys.argv[1]], stdout=subprocess.PIPE);"
        "child.stdout.readline(); print(child.pid, flush=True); child.wait()"
    )
    with subprocess.Popen([sys.executable, "-c", parent, child], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        process.kill()
    deadline = time.monotonic() + 20.0
    while _runs(pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_an_address_space_without_room_for_the_libraries_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    for limit, enough in ((None, True), (10**8, False), (10**10, True)):
        monkeypatch.setattr(_machine, "address_limit", lambda limit=limit: limit)
        assert _machine.enough_address_space() == enough
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "200")  # each takes a stack and buffers
    assert not _machine.enough_address_space()


def test_buffers_that_do_not_fit_are_an_error_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_machine, "address_limit", lambda: 10**9)
    _machine.reserve_for_linear_algebra()
    monkeypatch.setattr(_machine, "_BUFFERS_BYTES", 2**62)
    with pytest.raises(MemoryError):
        _machine.reserve_for_linear_algebra()
    monkeypatch.setattr(_machine, "address_limit", lambda: None)
    _machine.reserve_for_linear_algebra()
