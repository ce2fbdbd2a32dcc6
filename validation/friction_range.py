"""Over which range of mu do increments settle, here, by the paper's rule and in peers?

finger3d and the paper's rule: the increments of all histories of hard_cases.py, read from its committed table; those of
the paper's rule count up to its first cycle.  CalculiX 2.20: the deck that `finger3d export --solver calculix` writes
for the Fig. 9 section of hard_cases.py (4 mm, nu = 0.45, E = 1 MPa, plane strain), pressed 10 mm in ten increments,
which it may halve; what counts is the share of the press that is done when it ends.  Its penalty contact needs a stick
slope, the shear stress over the displacement of a point that sticks.  The deck's is 8 MPa/mm, with which the shear
stress of 0.11 MPa at mu = 1 moves a sticking point by 0.014 mm; it is raised a hundred times, to 800 MPa/mm, to come
nearer to points that do not move.  FElupe 11.3: the same mesh and path, with its rigid plane of penalties and its
cutbacks, which halve an increment up to ten times.  Its defaults take both penalties from the mean stiffness of the
nodes, with which the finger enters the plane by 1.8 % of the depth; the tangential one is raised a hundred times, too.
Where ccx or FElupe is not installed its committed results are judged.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.calculix import press_deck
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.model import Leg, Model

from . import _ccx, _felupe
from ._ccx import program, share_done
from ._felupe import felupe_press, is_felupe_installed
from ._hard_cases import DEPTH, MU, finger
from ._rows import Result, Row, at_most, columns, committed, committed_instead

STIFFER = 100.0
LIMIT_S = 900.0
COLUMNS = "mu increments settled paper_settled calculix_share calculix_stiff_share felupe_share felupe_stiff_share"


def press(mu: float) -> Model:
    """The press of the peers."""
    return replace(finger(2, 0.45, 4.0).model, friction=Coulomb(mu), legs=(Leg(DEPTH, steps=10),))


def run(quick: bool) -> Result:
    """Quick: the peers at one mu only, with their own stick slopes."""

    def calculix(mu: float, stiffer: float) -> float:
        return share_done(press(mu), LIMIT_S, stiffer)

    def felupe(mu: float, stiffer: float) -> float:
        model = press(mu)
        return felupe_press(model, press_deck(model).mesh, stiffer)[0]

    theirs = [
        _peer(quick, program() is not None, calculix, "calculix", "ccx", _ccx.INSTALL),
        _peer(quick, is_felupe_installed(), felupe, "felupe", "FElupe", _felupe.INSTALL),
    ]
    lines = [(*_counted(mu), *(x for shares in theirs for x in shares.get(mu, (np.nan, np.nan)))) for mu in MU]
    table = columns(COLUMNS, lines)
    return Result(tuple(_rows(table)), table, lambda figure: _draw(figure, table))


def _counted(mu: float) -> tuple[float, int, int, int]:
    chosen = [line for line in committed("hard_cases") if line["mu"] == mu]
    increments, settled, paper = (sum(x[k] for x in chosen) for k in ("increments", "settled", "paper_settled"))
    return mu, increments, settled, paper


def _peer(
    quick: bool, installed: bool, share: Callable[[float, float], float], name: str, program: str, install: str
) -> dict[float, tuple[float, float]]:
    """Shares of the press that a peer does, by mu, with its own stick slope and the stiffer one."""
    if installed and quick:
        return {0.25: (share(0.25, 1.0), np.nan)}
    if installed:
        return {mu: (share(mu, 1.0), share(mu, STIFFER)) for mu in MU}
    lines = committed_instead("friction_range", program, install)
    return {x["mu"]: (x[f"{name}_share"], x[f"{name}_stiff_share"]) for x in lines}


def _rows(table: dict[str, list[Any]]) -> list[Row]:
    total, settled, paper = (sum(table[k]) for k in ("increments", "settled", "paper_settled"))
    here = f"{total} increments at mu = 0 to 1e6"

    def least(peer: str, what: str, tried: Sequence[float]) -> Row:
        return at_most(f"least share of the press that {peer} does, {what}, {np.isfinite(tried).sum()} values of mu",
                       "finger3d: 1", 1.0, float(np.nanmin(tried)), kind="sensitivity")  # fmt: skip

    rows = [
        Row(f"increments that settle, finger3d, of {here}", "hard_cases", total, settled, 0.0, "all"),
        at_most(f"the same by the paper's rule, of {here}", "hard_cases, finger3d", settled, paper, kind="sensitivity"),
        least("CalculiX", "stick slope of its deck", table["calculix_share"]),
        least("FElupe", "its own stick slope", table["felupe_share"]),
    ]
    for peer in ("CalculiX", "FElupe"):
        tried = table[f"{peer.lower()}_stiff_share"]
        if np.isfinite(tried).any():
            rows.append(least(peer, "stick slope a hundred times that", tried))
    return rows


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    figure.set_size_inches(7.0, 4.5)
    axes = figure.subplots()
    names = [f"{mu:g}" for mu in table["mu"]]
    t: dict[str, Float] = {k: np.array(v, dtype=float) for k, v in table.items()}
    for share, style, size, label in (
        (t["settled"] / t["increments"], "o-", 9, "finger3d"),
        (t["calculix_share"], "v:", 4, "CalculiX, stick slope of its deck, 8 MPa/mm"),
        (t["calculix_stiff_share"], "^:", 6, "CalculiX, stick slope 800 MPa/mm"),
        (t["felupe_share"], "<:", 4, "FElupe, its own stick slope"),
        (t["felupe_stiff_share"], ">:", 6, "FElupe, a hundred times that"),
        (t["paper_settled"] / t["increments"], "s--", 6, "rule of the 2004 paper"),
    ):
        axes.plot(names, 100.0 * share, style, ms=size, label=label)
    axes.set(xlabel="friction coefficient mu", ylabel="solved (%)", ylim=(-5.0, 160.0), yticks=range(0, 101, 20))
    axes.set_title("increments that settle; peers: share of the press")
    total, settled, paper = (int(t[k].sum()) for k in ("increments", "settled", "paper_settled"))
    figure.supxlabel(
        f"finger3d settles {settled} of {total} increments, the paper's rule {paper} up to its first cycles", fontsize=9
    )
