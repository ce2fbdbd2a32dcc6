"""Files of MKL that PARDISO never loads, and the size of an environment."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from finger3d import _slim
from finger3d.fem.pardiso import available


@pytest.mark.skipif(not (available() and sys.platform == "linux"), reason="reads /proc, and needs PARDISO")
def test_a_solution_by_pardiso_maps_none_of_the_files() -> None:
    code = (
        "import numpy as np, scipy.sparse as sp\nfrom finger3d.fem.pardiso import SchurFactor\n"
        "upper = sp.csr_matrix(sp.triu(sp.diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(400, 400))))\n"
        "factor = SchurFactor(upper, 4)\nfactor.substituted(factor.eliminated(np.ones((396, 2)))[0], np.ones((4, 2)))\n"
        "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line}, sep='\\n')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    mapped = set(done.stdout.split())
    assert any("libmkl_core" in path for path in mapped)
    assert not mapped & {str(path) for path in _slim.unused(Path(sys.prefix))}


def test_a_file_with_two_names_counts_once(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 100_000)
    one = _slim.environment_bytes(tmp_path)
    assert 100_000 <= one < 200_000
    os.link(tmp_path / "a", tmp_path / "b")
    assert _slim.environment_bytes(tmp_path) == one


def test_only_files_of_the_environment_itself_are_named(tmp_path: Path) -> None:
    assert list(_slim.unused(tmp_path)) == []
