"""Files of MKL that PARDISO does without, and the size of an environment."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from finger3d import _slim
from finger3d.fem.pardiso import available


@pytest.mark.skipif(not (available() and sys.platform == "linux"), reason="reads /proc, and needs PARDISO")
def test_pardiso_solves_with_the_files_that_are_left(tmp_path: Path) -> None:
    """A folder with the libraries of this environment that are left, and a process that loads MKL from there."""
    library, unused = Path(sys.prefix, "lib"), {path.name for path in _slim.unused(Path(sys.prefix))}
    for path in (*library.glob("libmkl_*.so*"), *library.glob("libiomp5.so")):
        if path.name not in unused:
            try:
                os.link(path, tmp_path / path.name)
            except OSError:  # another file system
                shutil.copy(path, tmp_path)
    code = (
        "import numpy as np, scipy.sparse as sp\nfrom finger3d.fem.pardiso import PardisoFactor\n"
        "full = sp.diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(400, 400)).tocsr()\n"
        "factor = PardisoFactor(sp.csr_matrix(sp.triu(full)), 4)\nload = np.ones((396, 2))\n"
        "x = factor.substituted(factor.eliminated(load)[0], np.zeros((4, 2)))\n"
        "assert np.abs(full[:396, :396] @ x - load).max() < 1e-12\n"
        "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line}, sep='\\n')"
    )
    env = {**os.environ, "PYPARDISO_MKL_RT": str(next(tmp_path.glob("libmkl_rt.so*")))}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    mapped = [Path(path) for path in done.stdout.split()]
    assert {path.parent for path in mapped if path.name.startswith("libmkl_")} == {tmp_path}
    assert not unused & {path.name for path in mapped}


def test_a_file_with_two_names_counts_once(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"x" * 100_000)
    one = _slim.environment_bytes(tmp_path)
    assert 100_000 <= one < 200_000
    os.link(tmp_path / "a", tmp_path / "b")
    assert _slim.environment_bytes(tmp_path) == one


def test_only_files_of_the_environment_itself_are_named(tmp_path: Path) -> None:
    assert list(_slim.unused(tmp_path)) == []


@pytest.mark.parametrize("code", [0, 1])
def test_files_are_removed_only_if_the_program_succeeds_without_them(code: int, tmp_path: Path) -> None:
    aside, path = tmp_path / "aside", tmp_path / "libmkl_a.so"
    aside.mkdir()
    path.write_text("kept")
    program = f"import os, sys; sys.exit({code} + 2 * os.path.exists({str(path)!r}))"
    assert _slim.remove([path], aside, [sys.executable, "-c", program]) == (code == 0)
    assert path.exists() == (code == 1)
    assert list(aside.iterdir()) == []
