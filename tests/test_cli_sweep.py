"""Command ``sweep``: what is refused, and the points that are shown."""

from __future__ import annotations

import json

import pytest

from finger3d.cli import main
from tests.sweep_cases import COARSE, table


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu"], "KEY=VALUE"),
        (["friction.mu="], "friction.mu"),
        (["friction.mu=0.1,,2"], "friction.mu"),
        (["friction.mu=0.1,0.1"], '"0.1"'),
        (["friction.mu=0.1", "friction.mu=2"], "--vary friction.mu: "),
        (["gauge.g36.x_mm=1", "gauge.0.x_mm=2"], "gauge.0.x_mm"),
        (["material.n=0.1"], "--vary material.n: material.n = 0.1: "),
        (["finger.radus_mm=90"], '"radius_mm"'),
        (["frictoin.mu=0.1"], '"friction"'),
        (["friction.mu=0.1,-2"], "friction.mu = -2: "),
        (["material.nu=0.3,0.6"], "material.nu = 0.6: "),
        (["material.nu=0.3", "friction.mu=nan"], "friction.mu = nan: "),
        (["gauge.g37.x_mm=1"], '"g36"'),
        (["gauge.7.x_mm=1"], "--vary gauge.7.x_mm: "),
        (["mesh={tolerance=0.05}"], "mesh.size_mm"),
        (["gauge.g36.x_mm=1,70"], "x_mm = 70"),
        ([f"friction.mu={','.join(map(str, range(400)))}", f"material.nu={','.join(map(str, range(400)))}"], "160000"),
    ],
)
def test_bad_values_are_refused_before_the_first_run(vary, expected, paper_scene, tmp_path, capsys) -> None:
    options = [option for text in vary for option in ("--vary", text)]
    assert main(["sweep", str(paper_scene), *COARSE, *options, "--out", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "code", "expected"),
    [
        (["--workers", "0"], 2, "--workers 0"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], 2, "--scheduler"),
        (["--scheduler", "here"], 2, "HOST:PORT"),
        (["--scheduler", "tcp://127.0.0.1:1"], 3, "tcp://127.0.0.1:1"),
    ],
)
def test_a_cluster_that_cannot_be_used_is_told_in_one_line(
    options, code, expected, paper_scene, tmp_path, capsys, monkeypatch
) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.cluster.CONNECT_S", 1.0)
    arguments = [
        "sweep",
        str(paper_scene),
        *COARSE,
        "--vary",
        "friction.mu=0.1",
        "--out",
        str(tmp_path / "out"),
        *options,
    ]
    assert main(arguments) == code
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert expected in err


def test_one_body_is_swept_without_workers_and_its_points_are_shown(paper_scene, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.local.press", lambda *a: pytest.fail("workers were started"))
    vary = ["--vary", "friction.mu=0.1,0.2,0.3,0.4,0.5,0.6", "--vary", "gauge.g36.angle_deg=15,30"]
    assert main(["sweep", str(paper_scene), *COARSE, *vary, "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    found = table(tmp_path)
    assert len(found) == 12
    for row in found[:10]:
        names = ("friction.mu", "gauge.g36.angle_deg", "normal_force_N", "friction_sum_N")
        mine = [f"{float(row[name]):.5g}" for name in names]
        (line,) = (line.split() for line in told.splitlines() if line.split()[:4] == mine)
        assert line[-2:] == [f"{float(row['gauge_g36']):.5g}", "converged"]
    assert "10 of 12" in told
    assert str(tmp_path / "report.html") in told
    assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 0
    assert main(["show", str(tmp_path)]) == 2
    assert f"open {tmp_path / 'report.html'}" in capsys.readouterr().err
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert main(["sweep", str(paper_scene), *COARSE, *vary, "--out", str(tmp_path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert (data["points"], data["kept"], data["failed"], data["bodies"]) == (12, 12, 0, 1)
    assert [row["gauge_g36"] for row in data["rows"]] == [float(row["gauge_g36"]) for row in found]
