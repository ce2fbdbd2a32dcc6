"""Errors and outcomes: exit codes, and how a lack of memory is recognised."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d import cli
from finger3d.errors import OUT_OF_MEMORY, out_of_memory
from tests.scenes import HALF_CYLINDER


@pytest.mark.parametrize(
    ("error", "memory"),
    [
        (MemoryError("Unable to allocate 6 GiB"), True), (OSError(12, "Cannot allocate memory"), True),
        (RuntimeError("can't start new thread"), True), (ImportError("x.so: failed to map segment"), True),
        (OSError(2, "No such file"), False), (RuntimeError("other"), False),
        (ValueError("cannot allocate memory"), False),
    ],
)  # fmt: skip
def test_what_says_that_memory_ran_out(error: BaseException, memory: bool, monkeypatch, capsys) -> None:
    assert out_of_memory(error) is memory

    def fails(*args: object, **kwargs: object) -> int:
        raise error

    monkeypatch.setattr(cli, "app", fails)
    if memory:
        assert cli.main(["info"]) == 3
        assert capsys.readouterr().err == f"finger3d: {OUT_OF_MEMORY}\n"
    else:
        with pytest.raises(type(error)):
            cli.main(["info"])


@pytest.mark.parametrize(
    "command",
    [
        "press --no-figures --out OUT", "sensitivity --of gauge_g --out OUT", "cost", "sweep --workers 1 --out OUT "
        "--vary friction.mu=0.1,0.2", "identify --measured CSV --free material.E_MPa=0.1:1 --out OUT",
        "optimise --budget 1 --free gauge.g.x_mm=1:2 --out OUT", "optimise --gauges 1 --out OUT",
        "calibrate --gauge g --out OUT",
    ],
)  # fmt: skip
def test_an_increment_that_does_not_converge_is_exit_code_3(command: str, tmp_path: Path, capsys) -> None:
    """No force of 1000 N is reached in a finger 5 mm high and 2 mm wide with E = 1 MPa."""
    scene, csv = tmp_path / "scene.toml", tmp_path / "bench.csv"
    scene.write_text(HALF_CYLINDER.replace("depth_mm = 0.5", "force_N = 1e3"))
    csv.write_text("step,gauge_g\n1,0.01\n2,0.02\n4,0.05\n")
    name, *options = command.replace("OUT", str(tmp_path / "out")).replace("CSV", str(csv)).split()
    assert cli.main([name, str(scene), *options]) == 3
    assert "the prescribed force is not reached" in capsys.readouterr().err
