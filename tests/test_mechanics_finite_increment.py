"""One increment at finite strain: convergence, and states that are refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.errors import Outcome
from finger3d.fem.material import Isotropic
from finger3d.fem.quality import curved_jacobians
from finger3d.fem.recover import displacement
from finger3d.geometry.registry import designs
from finger3d.mechanics.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.solve import march
from tests.models import large_fig9


@pytest.mark.parametrize("nu", [0.45, 0.5])
def test_newton_with_a_new_tangent_in_every_iteration_converges_quadratically(
    nu: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    from finger3d.mechanics import finite_increment

    errors: list[float] = []
    residual = finite_increment.FiniteIncrement.residual
    monkeypatch.setattr(finite_increment, "_SLOW", 0.0)
    monkeypatch.setattr(
        finite_increment.FiniteIncrement, "residual", lambda *a: errors.append(residual(*a)) or errors[-1]
    )
    problem = build(large_fig9(nu, legs=(Leg(10.0, steps=5),)))
    workspace = formulation_of(problem.model).workspace()
    frames = list(march(problem, workspace=workspace))
    assert all(f.outcome.ok for f in frames)
    assert workspace.factorizations <= 5 * len(frames)
    # once all sets are found an error is followed by its square, times a constant of the mesh, down to round-off
    pairs = [(a, b) for a, b in zip(errors[:-1], errors[1:], strict=True) if 1e-6 < a < 1e-3 and b < a]
    assert pairs
    assert all(b < max(1e3 * a**2, 1e-12) for a, b in pairs)


def test_a_state_with_a_cell_folded_at_a_sharp_corner_is_refused_by_its_place() -> None:
    """The strain at the bonded corner of the base grows without limit as the free surface folds over it."""
    design = designs()["half_cylinder"](radius_mm=10.0, width_mm=10.0)
    mesh, leg = MeshOptions(0.65, 1.3, "swept"), Leg(4.2, steps=6)
    model = Model(design, Isotropic(1.0, 0.49), mesh, (leg,), friction=Coulomb(2.0), domain="plane-strain")
    model = Effect().apply(model)
    problem = build(model)
    frames = list(march(problem))
    assert frames[-1].outcome is Outcome.INVERTED
    x, y = (float(part.split(" = ")[1]) for part in frames[-1].detail.removesuffix(" mm").split(" at ")[1].split(", "))
    assert abs(x) > 9.0
    assert y < 1.0
    for frame in frames[:-1]:
        assert frame.outcome.ok
        u = displacement(problem.mesh, next(formulation_of(model).unknowns(problem, [frame.meshed_state])))
        assert curved_jacobians(replace(problem.mesh, points=problem.mesh.points + u)).min() > 0.0
