"""What a worker does: build one body, press it as every point that shares it, tell each point as it is finished."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from finger3d.analyses.shared_body import TROUBLE, SharedBody, Variant, VariantResult
from finger3d.analyses.sweep import points
from finger3d.errors import Finger3dError

Task = tuple[str, points.BodySpec, Sequence[tuple[int, Variant]]]


def press_all(
    task: Task, tell: Callable[[dict[str, Any]], object], done: frozenset[int] = frozenset(), threads: int | None = 1
) -> None:
    """Press a body as all its points.

    Parameters
    ----------
    task : key of the body, how to build it, number and variant of every point
    tell : given the row of each point as it is finished
    done : numbers of the points that are finished already
    threads : for the numerics; one, as workers share the machine, and None for all that are there
    """
    from threadpoolctl import threadpool_limits

    key, how, members = task
    members = [(n, v) for n, v in members if n not in done]
    if not members:
        return
    with threadpool_limits(limits=threads):
        try:
            body = _built(how, [v for _, v in members])
        except TROUBLE as error:
            for number, _ in members:
                tell({"point": number, "body": key, "outcome": _reason(error)})
            return
        for (number, _), pressed in zip(members, body.presses([v for _, v in members], threads), strict=True):
            tell({"point": number, "body": key, **_row(body, pressed)})


def _built(how: points.BodySpec, variants: Sequence[Variant]) -> SharedBody:
    from finger3d.scene import parse

    return SharedBody(replace(parse(how.given).model(), mesh=how.mesh), variants)


def _row(body: SharedBody, pressed: VariantResult | Exception) -> dict[str, Any]:
    if isinstance(pressed, Exception):
        return {"outcome": _reason(pressed)}
    return {
        **pressed.numbers,
        **{f"gauge_{name}": strain for name, strain in pressed.gauges.items()},
        "outcome": pressed.outcome,
        "residual": pressed.residual,
        "seconds": pressed.seconds,
        "build_seconds": body.seconds,
    }


def _reason(error: BaseException) -> str:
    text = " ".join(str(error).split()) or "no further words"
    return text if isinstance(error, Finger3dError) else f"{type(error).__name__}: {text}"


def on_worker(task: Task, topic: str) -> None:
    """Run in a Dask worker: rows go to the scheduler as events, each as soon as it is there.

    Dask starts a body again if its worker died: the points that were told then are left out.
    """
    from distributed import get_client, get_worker

    worker = get_worker()
    told = frozenset(int(event["row"]["point"]) for _, event in get_client().get_events(topic))
    press_all(task, lambda row: worker.log_event(topic, {"row": row}), told)
