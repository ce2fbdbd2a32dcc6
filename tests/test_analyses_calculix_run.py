"""The run of CalculiX and the forces that it prints; without CalculiX a program stands in for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from finger3d.analyses.calculix import run
from finger3d.errors import MissingError

PRINTED = """
 total force (fx,fy,fz) for set NOBJECT and time  0.5000000E+00

        1.000000E-01 -2.500000E+00  3.000000E-12

 total force (fx,fy,fz) for set NOBJECT and time  0.1000000E+01

       -1.250000E-01 -5.000000E+00  0.000000E+00
"""


def test_forces_are_read_with_their_times(tmp_path: Path) -> None:
    (tmp_path / "press.dat").write_text(PRINTED, encoding="ascii")
    times, forces = run.printed_forces(tmp_path / "press.dat")
    np.testing.assert_array_equal(times, [0.5, 1.0])
    np.testing.assert_allclose(forces, [[0.1, -2.5, 3e-12], [-0.125, -5.0, 0.0]])


def test_a_run_that_does_not_finish_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ccx = tmp_path / "ccx"
    ccx.write_text("#!/bin/sh\necho $1 diverges\n", encoding="ascii")
    ccx.chmod(0o755)
    monkeypatch.setattr(run.shutil, "which", lambda name: str(ccx))
    with pytest.raises(RuntimeError, match="ccx .* 0: press diverges"):
        run.solve(tmp_path / "press.inp", 10.0)
    ccx.write_text("#!/bin/sh\necho Job finished\n", encoding="ascii")
    run.solve(tmp_path / "press.inp", 10.0)
    monkeypatch.setattr(run.shutil, "which", lambda name: None)
    with pytest.raises(MissingError, match="apt install calculix-ccx"):
        run.solve(tmp_path / "press.inp", 10.0)
