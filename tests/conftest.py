"""Shared by all tests: one thread for the numerics, a cache that is not the user's."""

from __future__ import annotations

import os
import signal
from pathlib import Path

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
