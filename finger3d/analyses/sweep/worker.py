"""Presses of the points of a sweep that share a body, in this process or in a worker."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from finger3d.analyses.pressed_body import SharedBody, VariantResult, body_key
from finger3d.analyses.sweep.labels import SAMPLE
from finger3d.analyses.sweep.points import BodySpec, Point
from finger3d.errors import FAILURES, Finger3dError
from finger3d.mechanics.readings import by_key
from finger3d.results.journal import Row
from finger3d.scene import parse

_body: dict[BodySpec, SharedBody] = {}
"""The body that this worker has condensed, for its next batch; one at a time."""


def rows(spec: BodySpec, points: Sequence[Point]) -> Iterator[Row]:
    """Condense a body and yield the row of each point as soon as it is pressed."""
    try:
        body = _build(spec)
    except FAILURES as error:
        yield from _failed(points, error)
        return
    yield from _pressed(body, points, None)


def batch(spec: BodySpec, points: Sequence[Point], size: int) -> list[Row]:
    """Press the first `size` points with one thread; called in a worker.

    The body is kept for the next batch. If it cannot be built, every point gets a row that says why.
    """
    with threadpool_limits(limits=1):
        if spec not in _body:
            _body.clear()
            if body_key(parse(spec.given)) != spec.key:
                raise Finger3dError(
                    "a file of a body, a package or the source of finger3d is not the one that the sweep was started "
                    "with; the same command tries it again"
                )
            try:
                _body[spec] = _build(spec)
            except FAILURES as error:
                return _failed(points, error)
        return list(_pressed(_body[spec], points[:size], 1))


def _build(spec: BodySpec) -> SharedBody:
    model = replace(parse(spec.given).model(), mesh=spec.mesh)
    return SharedBody(model, spec.variants, grid=spec.grid, labels=spec.labels)


def _pressed(body: SharedBody, points: Sequence[Point], threads: int | None) -> Iterator[Row]:
    results = body.presses([point.variant for point in points], threads)
    for point, result in zip(points, results, strict=True):
        yield {"point": point.number, "body": point.body, **_columns(body, result)}


def _columns(body: SharedBody, result: VariantResult | Exception) -> Row:
    if isinstance(result, Exception):
        return {"outcome": _reason(result)}
    return {
        **result.numbers,
        **by_key(dict(sorted(result.readings.items(), key=lambda item: item[0].kind == "gauge"))),
        "outcome": result.outcome,
        "residual": result.residual,
        "seconds": result.seconds,
        "build_seconds": body.seconds,
        **({SAMPLE: result.sample} if result.sample else {}),
    }


def _failed(points: Sequence[Point], error: Exception) -> list[Row]:
    return [{"point": point.number, "body": point.body, "outcome": _reason(error)} for point in points]


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split()) or "no further information"
    return text if isinstance(error, Finger3dError) else f"{type(error).__name__}: {text}"
