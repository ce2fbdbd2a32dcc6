"""Derivatives of presses, and their comparison with central differences of presses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.sensitivity import Numbers, derivatives, tangents
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.mechanics.results.history import StepResult, table_row
from finger3d.mechanics.small_strain.variations import Variation, VariedBody

STEP, DIFFERENCE = 1e-6, 2e-6


def with_leg(model: Model, number: int, name: str) -> Callable[[float], Model]:
    def changed(h: float) -> Model:
        legs = list(model.legs)
        legs[number] = replace(legs[number], **{name: getattr(legs[number], name) + h})
        return replace(model, legs=tuple(legs))

    return changed


def with_dimension(model: Model, name: str) -> Callable[[float], Model]:
    def changed(h: float) -> Model:
        return replace(model, design=replace(model.design, **{name: getattr(model.design, name) + h}))

    return changed


def parameters(model: Model) -> dict[str, Callable[[float], Model]]:
    """The model with each of its parameters changed by h."""
    mu, nu, (gauge, other) = model.friction.mu, model.material.nu, model.gauges
    found = {
        "mu": lambda h: replace(model, friction=Coulomb(mu + h)),
        "E": lambda h: replace(model, material=Isotropic(1.0 + h, nu)),
        "nu": lambda h: replace(model, material=Isotropic(1.0, nu + h)),
        "x": lambda h: replace(model, gauges=(replace(gauge, x_mm=gauge.x_mm + h), other)),
        "angle": lambda h: replace(model, gauges=(replace(gauge, angle=gauge.angle + h), other)),
    }
    for name in ("radius_mm", "edge_height_mm", "width_mm"):
        if hasattr(model.design, name) and not isinstance(getattr(type(model.design), name, None), property):
            found[name] = with_dimension(model, name)
    if (slow := model.relaxation) is not None:
        for k, (g, tau) in enumerate(slow.prony):
            for name, one in (
                ("g", lambda h, g=g, tau=tau: (g + h, tau)),
                ("tau", lambda h, g=g, tau=tau: (g, tau + h)),
            ):
                found[f"{name} {k}"] = lambda h, k=k, one=one: replace(
                    model, relaxation=replace(slow, prony=(*slow.prony[:k], one(h), *slow.prony[k + 1 :]))
                )
    for number, leg in enumerate(model.legs):
        if slow is not None:
            found[f"duration {number}"] = with_leg(model, number, "duration_s")
        found[f"goal {number}"] = with_leg(model, number, "depth_mm" if leg.force_N is None else "force_N")
        for name in ("slide_x_mm", "force_x_N", "force_z_N", "turn_y", "turn_z"):
            if getattr(leg, name):
                found[f"{name.split('_mm')[0].removesuffix('_x')} {number}"] = with_leg(model, number, name)
    return found


def other_parameters(model: Model) -> dict[str, Callable[[float], Model]]:
    """The model with each dimension of its object, and each parameter of an elastic one and of foils, changed by h."""
    found = dict[str, Callable[[float], Model]]()
    for part, names in (
        ("object", ("radius_mm", "x_mm")),
        ("object_compliance", ("E_MPa", "nu", "height_mm")),
        ("inclusions", ("E_MPa", "thickness_mm", "width_mm")),
    ):
        thing = getattr(model, part)
        for name in names:
            if value := getattr(thing, name, None):
                changed = partial(replace, thing)
                found[f"{part} {name}"] = lambda h, part=part, name=name, value=value, changed=changed: replace(
                    model, **{part: changed(**{name: value + h})}
                )
    return found


def differentiated(problem: Problem, variations: Sequence[Variation]) -> tuple[list[StepResult], list[list[Numbers]]]:
    """All increments of a press, and the derivatives of their numbers by each parameter."""
    found = list[tuple[StepResult, list[Numbers]]]()
    for step, falling, growing in tangents(problem, variations):
        assert falling is growing  # no kink
        found.append((step, derivatives(step, variations, growing)))
    return [step for step, _ in found], [slopes for _, slopes in found]


def assert_equal_to_differences(
    problem: Problem, ways: Mapping[str, Callable[[float], Model]], tolerance: float = 1e-6, step: float | None = None
) -> None:
    """Compare all derivatives with central differences of presses, whose bodies are condensed again if they change."""
    h = step or (DIFFERENCE if problem.model.object.is_flat else 10.0 * DIFFERENCE)  # curved contact: solved to 1e-9
    body = VariedBody(problem)
    variations = [body.variation(way(-STEP), way(STEP), STEP) for way in ways.values()]
    steps, slopes = differentiated(problem, variations)
    values = [table_row(problem.points, step) for step in steps]
    for k, (name, way) in enumerate(ways.items()):
        ends = []
        near = body.variation(way(-h), way(h), h)
        for end, t in zip(near.ends, (-h, h), strict=True):
            other = build(way(t)) if near.body or near.thing else end
            ends.append((other, list(march(other))))
        for number, (low, high) in enumerate(zip(*(found for _, found in ends), strict=True)):
            assert (low.state.status == high.state.status).all()
            rows = [table_row(p.points, step) for (p, _), step in zip(ends, (low, high), strict=True)]
            for column, slope in slopes[number][k].items():
                size = 1e-3 if column.startswith("gauge") else 0.1  # of numbers that are zero
                largest = max(abs(slope), size, *(abs(row[column]) for row in values))
                difference = (rows[1][column] - rows[0][column]) / (2.0 * h)
                assert difference == pytest.approx(slope, abs=tolerance * largest), (name, number, column)
