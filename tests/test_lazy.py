"""Modules that are loaded late, and the garbage collector while others are loaded."""

from __future__ import annotations

import gc
import subprocess
import sys

import pytest

from finger3d._lazy import loading


def test_a_postponed_module_is_loaded_when_something_of_it_is_used() -> None:
    code = (
        "import sys; from finger3d._lazy import postpone\n"
        "postpone('numpy.f2py', 'numpy.testing', 'numpy.no_such')\n"
        "import numpy, scipy.sparse\n"
        "parts = 'numpy.f2py.f2py2e', 'numpy.testing._private.utils'\n"
        "print(*(part in sys.modules for part in parts))\n"
        "numpy.testing.assert_allclose(1.0, 1.0)\n"
        "from numpy.f2py import get_include\n"
        "print(*(part in sys.modules for part in parts), get_include().endswith('src'))\n"
        "before = numpy.testing; postpone('numpy.testing'); print(numpy.testing is before)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["False False", "True True True", "True"]


@pytest.mark.parametrize("on", [True, False])
def test_while_loading_nothing_is_garbage(on: bool) -> None:
    was, frozen = gc.isenabled(), gc.get_freeze_count()
    (gc.enable if on else gc.disable)()
    try:
        with loading():
            assert not gc.isenabled()
        assert gc.isenabled() == on
        with pytest.raises(ImportError), loading():
            raise ImportError
        assert gc.isenabled() == on
    finally:
        (gc.enable if was else gc.disable)()
    # no module was loaded: what is garbage now can still be found
    assert gc.get_freeze_count() == frozen


def test_what_was_loaded_is_not_looked_through_again() -> None:
    code = (
        "import gc; from finger3d._lazy import loading\nwith loading(): import csv\nprint(gc.get_freeze_count() > 1000)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
