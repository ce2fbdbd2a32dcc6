"""A press as an input deck of CalculiX: the same mesh, materials, object and path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d.analyses.calculix.deck import OBJECT, Contact, Deck, DeckStep, law_cards
from finger3d.analyses.calculix.objects import object_elements
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.mesh.simplex import FREE_FACES, Mesh
from finger3d.mechanics.discretise.build import mesh_part
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.path import AUTO_START
from finger3d.meshing.report import MeshReport
from finger3d.objects import Move, ObjectPose, PlacedObject
from finger3d.progress import QUIET, Progress

PENALTY = 200.0
"""Pressure over overlap, times the depth over Young's modulus: the surfaces overlap by less than a percent of the
depth, which changes the force by less (validation/calculix_forces.py); CalculiX diverges far above."""

STICK_SHARE = 0.4
"""Stiffness of sticking friction over the penalty, as in validation/calculix_forces.py."""

_SAGITTA = 1e-3  # of the facets of the object, over the depth
_MARGIN = 2.0  # around the finger at rest, in depths of the press: facets of the object beyond it are left out

_SLICE = 1e-3
"""Thickness of a section in plane stress, over its height.  CalculiX makes a layer of solids of it, which bulges: the
error of the force was 6 % with a thickness equal to the height, and 0.06 % with this one."""

_EFFECTS = {
    "relaxation": "viscosity",
    "inclusions": "embedded_gauge",
    "object_compliance": "elastic_object",
}
"""Slots of a model that have no equivalent in a deck, and the effects that fill them."""


@dataclass(frozen=True)
class PressDeck:
    """An input deck, the report on its mesh, and remarks.

    Attributes
    ----------
    deck : of the meshed part
    report : size and quality of the mesh
    multiple : forces on the whole finger over those on the part, for components along no mirrored axis
    remarks : differences between the deck and the press, a line each
    """

    deck: Deck
    report: MeshReport
    multiple: float
    remarks: tuple[str, ...]


def press_deck(model: Model, title: str = "", report: Progress = QUIET) -> PressDeck:
    """Mesh a model as a press does, and return it as a deck.

    Raises
    ------
    Finger3dError
        If CalculiX has no equal of an effect, a law, or a leg.
    """
    _check(model)
    contact, axes = model.first_contact, symmetry(model)
    mesh, mesh_report = mesh_part(model, contact.contact_box, axes, report)
    finite = model.finite_strain
    law = _law(model)
    laws = tuple(law_cards(material, law) for material in model.materials(mesh.part_labels))
    touch = contact.first_contact_mm
    stretches = [stretch for leg, start in _legs(model) for stretch in _stretches(leg, start)]
    placed = [PlacedObject.of(model.object, touch, pose) for pose in (ObjectPose(0.0), *(end for end, _ in stretches))]
    depth = model.largest_depth_mm
    low, high = _box(mesh, axes, _MARGIN * depth)
    elements, motion = object_elements(placed, low, high, _SAGITTA * depth, mesh.dim)
    penalty = PENALTY * model.material.E_MPa / depth
    steps = tuple(
        DeckStep(_rigid(moved), increments) for moved, (_, increments) in zip(motion[1:], stretches, strict=True)
    )
    thickness = _SLICE * model.design.height_mm if model.domain == "plane-stress" else model.design.width_mm
    multiple = 2.0 ** len(axes) * (model.design.width_mm / thickness if mesh.dim == 2 else 1.0)
    deck = Deck(
        mesh=mesh,
        laws=laws,
        object=elements,
        steps=steps,
        contact=Contact(penalty, STICK_SHARE * penalty, model.friction.mu, FREE_FACES),
        axes=axes,
        finite=finite,
        plane_stress=model.domain == "plane-stress",
        thickness_mm=thickness,
        remarks=tuple(
            line.encode("ascii", errors="replace").decode()
            for line in (*_head(title, axes, multiple), *_remarks(model))
        ),
        fields=True,
    )
    return PressDeck(deck, mesh_report, multiple, _remarks(model))


def _check(model: Model) -> None:
    """Raise a Finger3dError that names an effect or a key without an equivalent in CalculiX."""
    for slot, effect in _EFFECTS.items():
        if getattr(model, slot) is not None:
            raise Finger3dError(f"--solver calculix: CalculiX has no equal of [effects.{effect}]; take it out")
    if type(model.friction) is not Coulomb:
        filled = dict(model.filled).get("friction", type(model.friction).__name__)
        raise Finger3dError(f"--solver calculix: CalculiX has no equal of [effects.{filled}]; take it out")
    if model.is_under_force:
        raise Finger3dError(
            "--solver calculix: force_N: a deck moves the object by depths and slides; give depth_mm, for instance "
            "what `finger3d press` finds, and slides in place of force_x_N and force_z_N"
        )
    if model.held_ends:
        raise Finger3dError("--solver calculix: ends that are held cannot be written")


def _law(model: Model) -> IsochoricLaw | None:
    if model.finite_strain and model.domain == "plane-stress":
        raise Finger3dError(
            "--solver calculix: CalculiX has no equal of [effects.large_deformation] in plane stress; take it out, or "
            "change model.domain"
        )
    return model.hyperelastic_law


def _legs(model: Model) -> list[tuple[Leg, ObjectPose]]:
    """Return the legs with the poses that they start from."""
    found, at = [], ObjectPose(0.0)
    for leg in model.legs:
        found.append((leg, at))
        at = leg.end(at)
    return found


def _stretches(leg: Leg, start: ObjectPose) -> list[tuple[ObjectPose, int]]:
    """Return the ends and increments of the steps of a leg: one step, or one for each increment of a leg that turns.

    Within a step CalculiX moves every node of the object along a straight line.
    """
    count, end = leg.steps if isinstance(leg.steps, int) else AUTO_START, leg.end(start)
    if end.turns == start.turns:
        return [(end, count)]
    return [(Move(start, end).at(k / count), 1) for k in range(1, count)] + [(end, 1)]


def _rigid(moved: np.ndarray) -> np.ndarray:
    """Return the displacement (3,) that all nodes (k, 3) share, or those of all nodes."""
    return moved[0] if np.ptp(moved, axis=0).max() <= 1e-12 * (1.0 + np.abs(moved).max()) else moved


def _box(mesh: Mesh, axes: tuple[str, ...], margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (3,) of the box around the whole finger, with a margin."""
    low, high = np.zeros(3), np.zeros(3)
    low[: mesh.dim], high[: mesh.dim] = mesh.points.min(axis=0), mesh.points.max(axis=0)
    for axis in axes:
        low["xyz".index(axis)] = -high["xyz".index(axis)]
    return low - margin, high + margin


def _head(title: str, axes: tuple[str, ...], multiple: float) -> list[str]:
    lines = [f"{title or 'a press'}, written by finger3d; mm, N, MPa; run: ccx press"]
    lines.append(f"press.dat: total force of the set {OBJECT} is that on the finger; pressing forces have fy < 0")
    if multiple != 1.0:
        lines.append(f"the force on the whole finger is {multiple:.12g} times that")
    if axes:
        lines.append(f"the mesh is the part on one side of the planes of symmetry normal to {' and '.join(axes)}")
    return [*lines, "a *STEP for each leg, or for each increment of a leg that turns the object"]


def _remarks(model: Model) -> tuple[str, ...]:
    lines = []
    if model.mixed:
        lines.append("nu is near 1/2: CalculiX has no pressure unknown in C3D10, and is somewhat stiffer")
    if any(leg.steps == "auto" for leg in model.legs):
        lines.append(
            f'steps = "auto": {AUTO_START} increments for each leg; CalculiX does not choose them by their error'
        )
    return tuple(lines)
