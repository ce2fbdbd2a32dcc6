"""What is loaded late: names of a package, modules of others; and how to load much at once."""

from __future__ import annotations

import gc
import importlib
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import LazyLoader, find_spec, module_from_spec
from typing import Any


def from_home(package: str, home: Mapping[str, str]) -> Callable[[str], Any]:
    """A ``__getattr__`` for a package, that finds each name in the module that is its home within it."""

    def load(name: str) -> Any:
        if name in home:
            return getattr(importlib.import_module(f"{package}.{home[name]}"), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return load


def postpone(*names: str) -> None:
    """Let modules of a package be loaded when something of them is first used, not when they are imported."""
    for name in names:
        package, _, own = name.rpartition(".")
        holder = importlib.import_module(package)
        spec = None if name in sys.modules else find_spec(name)
        if spec is None or spec.loader is None:
            continue
        spec.loader = LazyLoader(spec.loader)
        module = sys.modules[name] = module_from_spec(spec)
        spec.loader.exec_module(module)
        setattr(holder, own, module)


@contextmanager
def loading() -> Iterator[None]:
    """While modules are imported nothing of them is garbage: it is not looked for, there and among them later."""
    was_on, before = gc.isenabled(), len(sys.modules)
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > before:  # else there is nothing to keep, but perhaps garbage of others
            gc.freeze()
        if was_on:
            gc.enable()
