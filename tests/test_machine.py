"""Versions, cores and memory."""

from __future__ import annotations

import os
import platform
from importlib import metadata

import pytest

from finger3d._machine import PACKAGES, cores, memory_bytes, versions


def test_versions_are_those_installed_and_absent_packages_are_left_out() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == metadata.version("numpy")
    assert set(found) <= {"python", *PACKAGES}


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
