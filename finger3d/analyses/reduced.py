"""Reduced model of a press: the compliance of the contact points, pressed without the mesh.

At small strain a press needs only the compliance of the contact points, the gauge rows, and the gap between object and
surface (`finger3d.fem.solvers.condense`).  Without the mesh there are no fields, and no candidate points can be added:
a path whose contact could reach beyond them is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from finger3d._machine import versions
from finger3d._types import TreeView
from finger3d.analyses.pressed_body import under
from finger3d.analyses.reduced_file import arrays_of, assembled, bare, read, write
from finger3d.errors import Finger3dError
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.geometry.design import DesignSummary
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem, rigid_gap
from finger3d.mechanics.history import History
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.path import targets
from finger3d.mechanics.postprocess.penetration import beyond_candidates

_PATH = ("depth_mm", "slide_x_mm", "slide_z_mm", "turn_x", "turn_y", "turn_z")

_GAP_LEFT = 0.5 * MARGIN
"""Least rigid gap of the points that are no candidates, over the press depth: half that of the farthest candidate."""


@dataclass(frozen=True, repr=False)
class ReducedModel:
    """A body condensed to its contact points and gauges.

    Attributes
    ----------
    problem : the problem that `finger3d.mechanics.march.solve.march` solves; its mesh and factor are empty
    others : the points of the free faces that are no candidates
    about : versions, mesh hash, number of unknowns and effects of the body
    """

    problem: Problem
    others: BoundarySurface
    about: TreeView

    def __repr__(self) -> str:
        """Return one line without the compliance."""
        where = f"{len(self.problem.points.nodes)} contact points"
        read = f", gauges {', '.join(self.gauges)}" if self.gauges else ""
        return f"<ReducedModel: {where}, {self.problem.model.domain}{read}>"

    @classmethod
    def of(cls, problem: Problem) -> ReducedModel:
        """Reduce a problem.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time, or if there are two fingers.
        """
        model = problem.model
        if not model.is_linear_elastic:
            slots = dict(model.filled)
            name = slots.get("hyperelastic_law") or slots.get("relaxation", "its formulation")
            raise Finger3dError(
                f"effects.{name}: a body with it has no reduced model, its compliance is not constant; "
                "condense the scene with effects.auto = false and without the effect, or press the scene itself"
            )
        if model.centre_of_mass_mm is not None:
            raise Finger3dError("[grip]: two fingers have no reduced model; press the scene itself")
        others = beyond_candidates(problem)
        about = {
            "versions": versions(),
            "mesh_hash": problem.body.report.hash,
            "dofs": int(problem.body.stiffness.upper.shape[0]),
            "effects": sorted({effect for _, effect in model.filled}),
        }
        size = DesignSummary(float(model.design.height_mm), float(model.design.width_mm))
        light = replace(model, design=size, inclusions=None, object_compliance=None, symmetry=problem.axes, parts=())
        return cls(
            assembled(light, arrays_of(problem), problem.system.first_contact_mm, problem.axes), bare(others), about
        )

    @property
    def gauges(self) -> tuple[str, ...]:
        """Names of the gauges."""
        return tuple(g.name for g in self.problem.model.gauges)

    @property
    def contact_points(self) -> int:
        """Contact points of the meshed part."""
        return len(self.problem.surface.nodes)

    def press(self, mu: float | None = None, legs: Sequence[Leg] | None = None) -> History:
        """Press once; an argument that is None is as in the scene.

        Parameters
        ----------
        mu : coefficient of friction, from 0 up
        legs : path of the object

        Returns
        -------
        History
            With ``outcome``, and gauge strains in ``steps[-1].gauges``.

        Raises
        ------
        Finger3dError
            If a number is out of range, contact could leave the candidate points, or the object passes between them.
        """
        model = self.problem.model
        law = model.friction if mu is None else model.friction.with_mu(mu)
        if legs is not None:
            self._check(tuple(legs))
        problem = under(self.problem, law, tuple(legs or ()))
        return History(problem.points, tuple(march(problem)))

    def _check(self, legs: tuple[Leg, ...]) -> None:
        """Raise Finger3dError if contact could leave the candidate points."""
        problem = self.problem
        for leg in legs:
            if not all(math.isfinite(getattr(leg, k)) for k in _PATH) or leg.depth_mm < 0.0:
                raise Finger3dError(
                    f"press: depth {leg.depth_mm} mm, slides {leg.slide_x_mm}, {leg.slide_z_mm} mm: must be finite "
                    "numbers, the depth from 0 up"
                )
            if problem.axes and any((leg.turn_x, leg.turn_y, leg.turn_z)):
                raise Finger3dError(
                    "press: the body was condensed as a mirror image and its object cannot turn; condense a scene with "
                    "this turn"
                )
            for axis in problem.axes:
                if getattr(leg, f"slide_{axis}_mm"):
                    raise Finger3dError(
                        f"press: the body was condensed as a mirror image about {axis} = 0 and cannot slide along "
                        f"{axis}; condense a scene with this slide"
                    )
        if problem.dim == 2 and any(leg.slide_z_mm for leg in legs):
            raise Finger3dError("press: a section cannot slide along z; condense a solid")
        if not len(self.others.nodes):
            return
        path = targets(legs)
        deepest = max(t.depth_mm for t in path)
        nearest = min(float(rigid_gap(problem.placed(t), self.others).min()) for t in path)
        if nearest < _GAP_LEFT * deepest:
            raise Finger3dError(
                f"press: at depth {deepest:g} mm contact may leave the {self.contact_points} points that were "
                "condensed; press less, or condense a scene that goes as far"
            )

    def save(self, path: str | Path) -> Path:
        """Write the model into one .npz file without pickles, whole or not at all; return its path."""
        return write(path, self.problem, self.others, self.about)

    @classmethod
    def load(cls, path: str | Path) -> ReducedModel:
        """Read what `save` wrote.

        Raises
        ------
        Finger3dError
            In one line, if the file is not there, of another kind or version, or damaged.
        """
        return cls(*read(path))
