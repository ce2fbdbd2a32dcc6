"""Is every press of a random scene what it says: converged with sound numbers, or ended with a cause?

Fingers, objects, materials, effects, paths and meshes are drawn at random, each scene from a seed and its number.
Every scene is pressed by the command, as a user does, in a process of its own.  A fault is a traceback or a process
that ends by itself; a press that converges with a residual above the limit, with forces that pull as the object goes
deeper, friction above its limit, a prescribed force that is missed, or no force at a positive depth; energy that
friction gives back; a place of the surface deep inside the object without a word; and a press that ends early without
a cause.

The seed is that of the day, so that the program is never fitted to it; the result has it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from finger3d._types import Tree
from finger3d.errors import Finger3dError
from finger3d.scene import parse

from ._effect_scenes import COIN, log_uniform, objects
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

SCENES, SCENES_QUICK = 60, 2
LIMIT_S = 240.0
"""Seconds of a press after which it is ended; on one of two threads."""

RESIDUAL, FORCE, DEEP = 1e-8, 1e-6, 0.02
"""Limits of the contract of a press: residual, relative error of a prescribed force; depth of a place of the surface
inside the object, over that of the press, above which it is told."""

_EXITS = {0: "converged", 2: "refused", 3: "ended"}
_MARKERS = {"converged": "o", "ended": "s", "refused": "^", "not ended": "x"}

_TRIES = 20
"""Draws of a scene until one is not refused."""


class Pressed(NamedTuple):
    """What a press came to.

    Attributes
    ----------
    number : of the scene
    kind : domain, finger, object and effects
    outcome : "converged", "ended" (exit 3), "refused" (exit 2) or "not ended" in time
    increments : converged
    seconds : of the process
    faults : empty if there is none
    says : outcome of the summary, or the line of a refusal
    """

    number: int
    kind: str
    outcome: str
    increments: int
    seconds: float
    faults: str
    says: str


def scenes(count: int, seed: int) -> Iterator[tuple[int, Tree]]:
    """Yield numbers and scenes, as tables, that are not refused when they are loaded."""
    for number in range(count):
        random = np.random.default_rng([seed, number])
        for _ in range(_TRIES):
            tables = _drawn(random)
            try:
                parse(tables)
            except Finger3dError:
                continue
            yield number, tables
            break


def _drawn(random: np.random.Generator) -> Tree:
    """Return the tables of one scene."""
    domain = str(random.choice(["plane-strain", "plane-stress", "solid"], p=[0.4, 0.25, 0.35]))
    solid, large = domain == "solid", bool(random.random() < 0.35)
    finger, high, half, wide = _finger(random, solid)
    depth = high * float(log_uniform(random, 0.01, 0.4 if large else 0.25))
    edge = high / (6.0 if solid else 12.0) * random.uniform(0.7, 1.5)
    stiff = log_uniform(random, 0.05, 5.0)
    has_parts = finger["geometry"] == "fingertip"
    tables: Tree = {
        "finger": finger,
        "material": {"E_MPa": stiff, "nu": float(random.choice([0.0, 0.3, 0.4, 0.45, 0.49, 0.5]))},
        "object": _object(random, high, depth, solid),
        "press": {"leg": _legs(random, solid, depth, stiff * wide * high)},
        "model": {"domain": domain},
        "mesh": {"size_mm": edge, "base_size_mm": edge * random.uniform(1.0, 4.0)},
        "gauge": [{
            "name": "g", "x_mm": random.uniform(-0.4, 0.4) * half, "y_mm": random.uniform(0.2, 0.6) * high,
            "angle_deg": random.uniform(0.0, 90.0), "length_mm": float(random.choice([0.0, 0.1])) * high,
        }],
        "marker": [{"name": "m", "x_mm": random.uniform(-0.4, 0.4) * half, "y_mm": 0.6 * high}],
        "effects": _effects(random, large, high),
    }  # fmt: skip
    if has_parts:
        tables["parts"] = {"skin": {"E_MPa": stiff * 3.0, "nu": 0.4}, "core": {"rigid": True}}
    elif random.random() < 0.7:
        tables["mesh"]["mesher"] = "swept"
    if random.random() < 0.9:
        mu = random.choice([log_uniform(random, 0.05, 1.2), 2.0, 10.0], p=[0.8, 0.1, 0.1])
        tables["friction"] = {"mu": float(mu)}
    if random.random() < 0.08:
        tables["contact"] = {"rule": "paper"}
    return tables


def _finger(random: np.random.Generator, solid: bool) -> tuple[Tree, float, float, float]:
    """Return the table of a finger, its height, half its length and its width, mm."""
    size, wide = log_uniform(random, 3.0, 15.0), log_uniform(random, 3.0, 15.0)
    kinds = ["block", "half_cylinder", "clipped_cylinder", "clipped_cylinder", "fingertip"]
    match random.choice([*kinds, "hemisphere"] if solid else kinds):
        case "block":
            half = size * random.uniform(0.5, 1.5)
            return {"geometry": "block", "half_length_mm": half, "height_mm": size, "width_mm": wide}, size, half, wide
        case "half_cylinder":
            return {"geometry": "half_cylinder", "radius_mm": size, "width_mm": wide}, size, size, wide
        case "hemisphere":
            return {"geometry": "hemisphere", "radius_mm": size}, size, size, size
        case str() as name:
            half, edge = size * random.uniform(0.8, 1.2), size * random.uniform(0.2, 0.8)
            rise = size - edge
            radius = (half**2 + rise**2) / (2.0 * rise)
            table: Tree = {
                "geometry": name, "radius_mm": radius, "half_length_mm": half, "edge_height_mm": edge, "width_mm": wide,
            }  # fmt: skip
            if name == "fingertip":
                table |= {"skin_mm": 0.15 * size, "core_half_length_mm": 0.3 * half, "core_height_mm": 0.4 * edge}
            return table, size, half, wide
    raise AssertionError


def _object(random: np.random.Generator, high: float, depth: float, solid: bool) -> Tree:
    """Return the table of an object about as large as the finger; half of them are beside its middle, or turned."""
    tables = objects(random, high, depth)
    table = tables[int(random.integers(len(tables)))]
    if solid and table["shape"] in ("cylinder", "wedge", "wave") and random.random() < 0.5:
        table = table | {"axis": "x"}
    if random.random() < 0.5:
        table = table | {"x_mm": random.uniform(-0.2, 0.2) * high}
        if solid:
            table |= {"z_mm": random.uniform(-0.2, 0.2) * high}
    if random.random() < 0.2:
        table = table | {"turn_z_deg": random.uniform(-8.0, 8.0)}
        if solid:
            table |= {"turn_x_deg": random.uniform(-8.0, 8.0), "turn_y_deg": random.uniform(-45.0, 45.0)}
    return table


def _legs(random: np.random.Generator, solid: bool, depth: float, stiffness: float) -> list[Tree]:
    """Press to a depth or a force; often slide, drag, turn, and release half or all of it."""
    force = stiffness * log_uniform(random, 0.005, 0.2)
    here: Tree = {"depth_mm": depth} if random.random() < 0.65 else {"force_N": force}
    steps = "auto" if random.random() < 0.15 else int(random.integers(1, 11))
    after: Tree = {"steps": int(random.integers(1, 7)), "duration_s": log_uniform(random, 0.01, 50.0)}
    legs, place = [{**here, "steps": steps, "duration_s": log_uniform(random, 0.01, 50.0)}], dict[str, Any]()
    if random.random() < 0.3:
        place = {"slide_x_mm": random.uniform(-0.5, 0.5) * depth}
        if solid:
            place["slide_z_mm"] = random.uniform(-0.3, 0.3) * depth
        legs.append({**here, **place, **after})
    elif random.random() < 0.12:
        legs.append({**here, **after, "force_x_N": 0.05 * force})
        return legs
    if random.random() < 0.2:
        place |= {"turn_z_deg": random.uniform(-6.0, 6.0)}
        if solid:
            place |= {"turn_y_deg": random.uniform(-15.0, 15.0)}
        legs.append({**here, **place, **after})
    if random.random() < 0.3:
        key, value = next(iter(here.items()))
        least = 0.0 if key == "depth_mm" else 0.3
        legs.append({key: value * float(random.choice([least, 0.5])), **place, **after})
    return legs


def _effects(random: np.random.Generator, large: bool, high: float) -> Tree:
    """Return the tables of the effects, each at random."""
    laws: tuple[Tree, ...] = (
        {},
        {"law": "neo-hookean"},
        {"law": "mooney-rivlin", "c01_share": random.uniform(0.1, 0.5)},
        {"law": "yeoh", "c2_over_c1": random.uniform(-0.05, 0.1), "c3_over_c1": random.uniform(0.0, 0.02)},
        {"law": "ogden", "terms": [[0.7, random.uniform(1.2, 4.0)], [0.3, random.uniform(-3.0, -1.0)]]},
    )
    tables: Tree = {"large_deformation": laws[int(random.integers(len(laws)))]} if large else {}
    if random.random() < 0.15:
        tables["kinetic_friction"] = {"ratio": random.uniform(0.4, 1.0)}
    if random.random() < 0.15:
        tables["viscosity"] = {
            "prony": [[random.uniform(0.05, 0.6), log_uniform(random, 0.05, 5.0)]], "bulk": bool(random.random() < 0.5),
        }  # fmt: skip
    if random.random() < 0.15:
        tables["elastic_object"] = {"E_MPa": log_uniform(random, 0.2, 100.0), "nu": random.uniform(0.2, 0.49)}
    if random.random() < 0.12:
        tables["embedded_gauge"] = {"E_MPa": 3000.0, "thickness_mm": 4e-4 * high, "width_mm": 0.06 * high}
    if random.random() < 0.06:
        tables["auto"] = True
    return tables


def pressed(number: int, tables: Tree, limit_s: float = LIMIT_S) -> Pressed:
    """Press a scene by the command, in a process with one thread, and judge what it wrote."""
    kind = ", ".join(
        [tables["model"]["domain"], tables["finger"]["geometry"], tables["object"]["shape"], *tables["effects"]]
    )
    with TemporaryDirectory() as folder:
        file, out = Path(folder, "scene.toml"), Path(folder, "out")
        file.write_text(tomli_w.dumps(tables), encoding="utf-8")
        begin = time.perf_counter()
        command = [sys.executable, "-m", "finger3d", "press", str(file), "--out", str(out)]
        threads = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        try:
            run = subprocess.run(
                command, capture_output=True, text=True, timeout=limit_s, env={**os.environ, **threads}, check=False
            )
        except subprocess.TimeoutExpired:
            return Pressed(number, kind, "not ended", 0, limit_s, "", f"not within {limit_s:g} s")
        seconds = time.perf_counter() - begin
        summary = out / "summary.json"
        found = json.loads(summary.read_text(encoding="utf-8")) if summary.exists() else None
    good = [step for step in found["steps"] if step["outcome"] == "converged"] if found else []
    last_line = run.stderr.strip().splitlines()[-1] if run.stderr.strip() else ""
    says = (found["outcome"] if found else last_line).replace(str(COIN), COIN.name)
    outcome = _EXITS.get(run.returncode, f"exit {run.returncode}")
    faults = list(_faults(tables, found, good, run.returncode, run.stderr))
    return Pressed(number, kind, outcome, len(good), seconds, "; ".join(faults), says)


def _faults(tables: Tree, found: Any, good: list[Any], code: int, told: str) -> Iterator[str]:
    """Yield what is wrong with a press."""
    if code not in (0, 2, 3) or "Traceback" in told:
        yield f"exit {code}"
    elif code == 2 and (len(told.strip().splitlines()) != 1 or found):
        yield "a refusal in more than a line, or with results"
    elif code == 3 and len(found["outcome"] if found else told.strip()) < 30:
        yield "ended without a cause"
    if found is None:
        return
    if code == 0 and found["outcome"] != "converged":
        yield f"exit 0, {found['outcome']}"
    yield from _unsound(tables, found, good, code == 0)


def _unsound(tables: Tree, found: Any, good: list[Any], whole: bool) -> Iterator[str]:
    """Yield what is wrong with the increments that converged."""
    legs, scene = tables["press"]["leg"], found["scene"]
    mu = scene["friction"]["mu"] if scene.get("friction") else 0.0
    scale = max((step["normal_force_N"] for step in good), default=0.0)
    deepest, lost = max((step["depth_mm"] for step in good), default=0.0), 0.0
    for number, (before, step) in enumerate(pairwise([{"depth_mm": 0.0}, *good]), 1):
        deeper = step["depth_mm"] > before["depth_mm"]
        normal, rubs = step["normal_force_N"], step["friction_sum_N"]
        if not all(np.isfinite(value) for value in step.values() if isinstance(value, float)):
            yield f"increment {number}: a number that is not finite"
        if step["residual"] is not None and step["residual"] > RESIDUAL and step["method"] != "paper":
            yield f"increment {number}: residual {step['residual']:.2g}"
        if normal < -1e-9 * scale and deeper:  # an object that is taken back may drag the finger with its flanks
            yield f"increment {number}: normal force {normal:.4g} N"
        if step["stick_area_mm2"] > step["contact_area_mm2"] * (1.0 + 1e-9):
            yield f"increment {number}: more stick than contact"
        if scene["object"]["shape"] == "plane" and not scene["effects"] and rubs > mu * normal * 1.3 + 1e-9 * scale:
            yield f"increment {number}: friction {rubs:.4g} N under {normal:.4g} N"
        if step["dissipation_mJ"] < lost - 1e-9 * max(abs(step["external_work_mJ"]), 1e-300):
            yield f"increment {number}: dissipation falls"
        lost = max(lost, step["dissipation_mJ"])
    deep = max((step["largest_penetration_mm"] for step in good), default=0.0)
    if deep > DEEP * max(deepest, 1e-300) and not any("inside" in text for text in found["warnings"] + found["advice"]):
        yield f"{deep:.3g} mm inside the object at a depth of {deepest:.3g}, untold"
    if not whole:
        return
    last = legs[-1]
    if "force_N" in last and abs(good[-1]["normal_force_N"] / last["force_N"] - 1.0) > FORCE:
        yield f"{good[-1]['normal_force_N']:.6g} N in place of {last['force_N']:.6g}"
    if last.get("depth_mm", 0.0) > 0.0 and len(legs) == 1 and scale <= 0.0:
        yield "no force at a positive depth"


def run(quick: bool) -> Result:
    """Press the scenes, two at a time."""
    count = SCENES_QUICK if quick else SCENES
    seed = 1 if quick else int(datetime.now(tz=UTC).strftime("%Y%m%d"))
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda scene: pressed(*scene), scenes(count, seed)))
    outcomes = Counter(one.outcome for one in found)
    here = f"{len(found)} random scenes, seed {seed}"
    rows = (
        judged("faults", sum(bool(one.faults) for one in found), here=here),
        judged("not-ended", outcomes["not ended"] / len(found), here=here, limit=LIMIT_S),
        judged("share-converged", outcomes["converged"] / len(found), here=here),
    )
    table = exact_columns(" ".join(Pressed._fields), found)
    return Result(rows, table, lambda figure: _draw(figure, table))


def _draw(figure: Any, table: Mapping[str, Sequence[Any]]) -> None:
    """Draw the seconds of every press, in their order, by outcome."""
    axes = figure.subplots()
    order = np.argsort(np.asarray(table["seconds"], dtype=float))
    seconds, outcome = (np.asarray(table[name])[order] for name in ("seconds", "outcome"))
    for name, marker in _MARKERS.items():
        at = np.flatnonzero(outcome == name)
        axes.plot(at + 1, seconds[at].astype(float), marker, ms=5, label=f"{name}: {len(at)}")
    axes.set(xlabel="scenes, the quickest first", ylabel="time of the command on one thread (s)", yscale="log")
