"""Command ``plan``: effects, size and cost, without a solution."""

from __future__ import annotations

from tests.commands import run


def test_plan_tells_effects_and_forecast_and_solves_nothing(scene, fake_press, capsys) -> None:
    assert run("plan", scene, "--set", "title=planned [b]") == 0
    out, err = capsys.readouterr()
    assert err == ""
    for text in ("planned [b]", "dofs", "symmetry", "x and z", "memory MB", "no [effects.kinetic_friction]"):
        assert text in out
    assert fake_press.scene is None


def test_plan_says_where_the_modulus_comes_from(scene, capsys) -> None:
    assert run("plan", scene, "--set", "material.silicone=dragon skin 20") == 0
    out = capsys.readouterr().out
    assert "0.423 MPa +- 25 %, Dragon Skin 20, 100 %" in out
    assert run("plan", scene) == 0
    assert "1 MPa, given" in capsys.readouterr().out
