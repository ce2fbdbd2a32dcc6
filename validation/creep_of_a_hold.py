"""How far does an object of 45 g creep in a minute between two pads that press it with 12 N, at mu = 1; how much grip
does it take?

Each pad carries half of the weight, 0.22 N, under a limit of 12 N.  finger3d: two pads, cubes of 20 mm, E = 1 MPa and
nu = 0.45, fixed behind, close on a free box of 40 x 40 x 120 mm with 12 N; its weight grows, and then it is held in 60
increments.  Without viscosity nothing depends on time.  The creep is the largest change in the hold of the object's
pose, or of the gap, slip or displacement of a contact point.

The least grip is the smallest force that holds: m g / (2 mu) by Coulomb's law.  In finger3d it is found by bisection to
1 %.  In MuJoCo every force lets the object creep; it counts as held at forces at which it falls by less than 10 mm in
the first second, of the 4.9 m of a free fall.

MuJoCo, with default settings unless the table says otherwise (Newton's solver, Euler, a time step of 2 ms, solref
0.02 1, solimp 0.9 0.95 0.001 0.5 2), but with the elliptic cone, which is Coulomb's: a free box of 40 x 40 x 120 mm and
45 g, gravity 9.81 m/s2 along -z, between two cubes of 20 mm and 1 kg on slide joints along x, each pushed by a motor
with 12 N; sliding friction 1, condim 3; each pad touches in 4 points from the start.  The creep is the fall of the
object from t = 1 s, when all is settled, to 61 s.  These choices favour MuJoCo: light pads, and ellipsoids, which touch
in one point each, creep more; both are in the table, with a longer box that they do not leave, as are other time steps
and ratios of the impedance of friction to that of normal forces (impratio).

That creep is no error of MuJoCo: friction is a soft constraint there.  Its documentation (Computation, Solver
parameters) gives the velocity at which a contact that carries the friction f creeps, v = R f / b, with
R = (1 - d) A / (d impratio), A the sum of the inverse masses of both bodies, b = 2 / (0.95 * 0.02 s), and d the
impedance, 0.95 where the overlap is above 1 mm.  It does not depend on the time step.  The post-solver that
noslip_iterations turns on is meant to remove the creep.  Both pads and objects of MuJoCo are rigid bodies with soft
contacts, those of finger3d an elastic body on a rigid plane.  Where MuJoCo is not installed the committed results are
judged.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from finger3d.analyses.press import least_grip
from finger3d.mechanics.discretise.build import build
from finger3d.objects import TIME
from finger3d.progress import QUIET
from finger3d.scene import scene_of

from ._press import block_tables, changed, converged
from ._rows import Result, Row, columns, committed_instead, given, listed
from .held_weights import largest_change

judged = listed(__file__)
MUJOCO = given(__file__)["mujoco"]

MASS, NORMAL, MU, G, HOLD_S = 0.045, 12.0, 1.0, 9.81, 60.0
LEAST_GRIP = 0.5 * MASS * G / MU
FALLS = 10.0
"""Fall (mm) in a second from which an object is not held."""

COLUMNS = (
    "program pads pad_kg time_step_ms impratio noslip_iterations contacts creep_mm_per_min formula_mm_per_min "
    "least_grip_N"
)


@dataclass(frozen=True)
class Grip:
    """A model of MuJoCo: pads and their mass (kg), half the object's length (m), and settings of the solver."""

    pads: str = "box"
    pad_kg: float = 1.0
    step_s: float = 0.002
    impratio: float = 1.0
    noslip: int = 0
    half_length_m: float = 0.06

    def xml(self) -> str:
        """The model as MuJoCo reads it."""
        return MUJOCO["model"].format(mu=MU, mass=MASS, **asdict(self))

    def formula(self) -> float:
        """Creep by the documentation, mm a minute, with the load equal on all contacts, each above 1 mm deep."""
        contacts = 8 if self.pads == "box" else 2
        inverse = 1.0 / MASS + 1.0 / self.pad_kg
        return 60e3 * (1.0 - 0.95) / 0.95 * inverse / self.impratio * MASS * G / contacts / (2.0 / (0.95 * 0.02))


GRIPS = tuple(Grip(**grip) for grip in MUJOCO["grips"])


def mujoco_fall(grip: Grip, force: float, begin: float, seconds: float) -> tuple[float, int]:
    """Fall (mm) of the object in a time (s) from its begin (s) under a force (N), and contacts at its end."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(grip.xml())
    data = mujoco.MjData(model)
    data.ctrl[:] = force
    per_second = round(1.0 / grip.step_s)
    mujoco.mj_step(model, data, round(begin * per_second))
    start = float(data.qpos[2])
    mujoco.mj_step(model, data, round(seconds * per_second))
    return 1e3 * (start - float(data.qpos[2])), int(data.ncon)


def mujoco_least_grip(grip: Grip) -> float:
    """Smallest force (N), to 1 %, at which the object falls by less than `FALLS` in its first second."""
    low, high = 0.01 * NORMAL, NORMAL
    while high > 1.01 * low:
        force = float(np.sqrt(low * high))
        low, high = (low, force) if mujoco_fall(grip, force, 0.0, 1.0)[0] < FALLS else (force, high)
    return high


def finger3d_hold(size: float, increments: int) -> tuple[float, float]:
    """Largest change in the hold, mm, and the least grip, N."""
    tables = block_tables(
        (10.0, 20.0, 20.0), 1.0, 0.45, (size, 2.0 * size), object={"shape": "box", "size_mm": (40.0, 40.0, 120.0)},
        friction={"mu": MU}, grip={"force_N": NORMAL, "mass_g": 1e3 * MASS * G / 9.80665, "steps": 2},
        effects={"auto": False},
    )  # fmt: skip
    problem = build(scene_of(tables).model())
    close, weigh = problem.model.legs
    hold = replace(weigh, steps=increments, duration_s=HOLD_S)
    steps = converged(changed(problem, legs=(close, weigh, hold)))
    poses = np.array([np.delete(step.pose.coordinates, TIME) for step in steps[3:] if step.pose])
    moved = float(np.abs(poses - poses[0]).max())
    return max(moved, largest_change(problem, steps[3:])), least_grip(problem, NORMAL, QUIET)


def run(quick: bool) -> Result:
    """Quick: a coarse pad, and 2 s of two of MuJoCo's models."""
    ours, least = finger3d_hold(5.0 if quick else 2.5, 6 if quick else 60)
    if importlib.util.find_spec("mujoco") is None:
        kept = committed_instead("creep_of_a_hold", "MuJoCo", "pip install mujoco, or the extra dev")
        theirs = [tuple(line.values()) for line in kept if line["program"] == "MuJoCo"]
    else:
        theirs = [_line(grip, 2.0 if quick else HOLD_S) for grip in GRIPS[: 2 if quick else None]]
    lines = [("finger3d", "block, E = 1 MPa", 0.0, 0.0, 0.0, 0.0, 0.0, ours, 0.0, least), *theirs]
    table = columns(COLUMNS, lines)
    return Result(tuple(_rows(ours, least, theirs)), table, lambda figure: _draw(figure, table))


def _line(grip: Grip, seconds: float) -> tuple[Any, ...]:
    fall, contacts = mujoco_fall(grip, NORMAL, 1.0, seconds)
    formula = np.nan if grip.noslip else grip.formula()
    shown = 1e3 * grip.step_s, grip.impratio, float(grip.noslip), float(contacts)
    return "MuJoCo", grip.pads, grip.pad_kg, *shown, fall * 60.0 / seconds, formula, mujoco_least_grip(grip)


def _rows(ours: float, least: float, theirs: list[tuple[Any, ...]]) -> Iterator[Row]:
    t = [dict(zip(COLUMNS.split(), line, strict=True)) for line in theirs]
    default, noslip = t[0], t[1]
    soft = [line for line in t if not line["noslip_iterations"]]
    ratios = [line["creep_mm_per_min"] / line["formula_mm_per_min"] for line in soft]
    here = "MuJoCo, default settings"
    yield judged("creep-in-a-minute-finger3d-mm", ours)
    yield judged("least-grip-finger3d-n", least, LEAST_GRIP)
    yield judged("least-grip", default["least_grip_N"], LEAST_GRIP, here=here)
    yield judged("creep-in-a-minute-mm", default["creep_mm_per_min"], here=here)
    left = abs(noslip["creep_mm_per_min"])
    yield judged("creep-in-a-minute-mujoco-noslip", left, default["creep_mm_per_min"], here=here)
    yield judged("creep-of-mujoco-over-v-r", max(ratios, key=lambda ratio: abs(ratio - 1.0)), count=len(soft))
    steps = [line["creep_mm_per_min"] for line in soft if line["time_step_ms"] != default["time_step_ms"]]
    if steps:
        away = max(abs(creep / default["creep_mm_per_min"] - 1.0) for creep in steps)
        yield judged("change-of-that-creep", away)


def _label(line: tuple[Any, ...]) -> str:
    program, *settings = line[:6]
    if program == "finger3d":
        return "finger3d"
    usual = ("box", 1.0, 2.0, 1.0, 0.0)
    texts = ("{} pads", "pads of {:g} kg", "step {:g} ms", "impratio {:g}", "noslip {:g}")
    changed = [text.format(now) for text, now, then in zip(texts, settings, usual, strict=True) if now != then]
    return ", ".join(["MuJoCo", *(changed or ["default"])])


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    """Creep of every model on a logarithmic axis."""
    axes = figure.subplots()
    for line in list(zip(*table.values(), strict=True))[::-1]:
        label, value = _label(line), abs(dict(zip(table, line, strict=True))["creep_mm_per_min"])
        colour = "C0" if label == "finger3d" else "C1"
        text = "none" if value == 0.0 else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"
        axes.plot(max(value, 1e-4), label, "o" if value else "", color=colour)
        axes.annotate(text, (max(value, 1e-4), label), (6, 0), textcoords="offset points", va="center", fontsize=8)
    axes.set(xscale="log", xlim=(1e-4, 1e4), xlabel="creep in a minute (mm): 45 g held with 12 N, mu = 1")
