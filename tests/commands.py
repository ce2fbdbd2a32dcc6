"""Commands of the command line, run in this process, and programs run in a process of their own."""

from __future__ import annotations

import subprocess
import sys

from finger3d.cli import main

STEP = {
    "depth_mm": 10.0,
    "normal_force_N": 304.5,
    "friction_sum_N": 72.0,
    "contact_half_length_mm": 36.0,
    "stick_half_length_mm": 8.5,
    "contact_area_mm2": 1460.0,
    "stick_area_mm2": 130.0,
    "stick_ratio_area": 0.089,
    "stick_ratio_force": 0.2,
    "slip_margin": 1.0,
    "tangential_force_x_N": 0.0,
    "tangential_force_z_N": 0.0,
    "slide_x_mm": 0.0,
    "slide_z_mm": 0.0,
    "turn_x_deg": 0.0,
    "turn_y_deg": 0.0,
    "turn_z_deg": 0.0,
    "residual": 3e-11,
    "gauges": {"g36": -0.0123},
    "markers": {"m1": [0.5, -2.0, 0.0]},
    "taxels": {"t1": 0.125},
    "outcome": "converged",
}


def run(*arguments: object) -> int:
    """Exit code of one command."""
    return main([str(a) for a in arguments])


def loaded(program: str, *modules: str) -> set[str]:
    """Which of some modules a program has loaded when it ends, in a process of its own."""
    program += f"\nimport sys; print(); print(*({set(modules)!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    return set(done.stdout.splitlines()[-1].split())


def refused(capsys, *arguments: str) -> str:
    """Run the command line; it must end with 2 and one line."""
    code = main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    assert code == 2
    assert out == ""
    assert err.endswith("\n")
    assert len(err.splitlines()) == 1, err
    assert "Traceback" not in err
    assert err.rstrip("\n").isprintable()
    assert "pydantic" not in err.lower()
    return err
