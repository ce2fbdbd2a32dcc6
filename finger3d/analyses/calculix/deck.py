"""Input deck of CalculiX: a meshed body pressed by a rigid object.

The contact is CalculiX's surface to surface penalty.  The object is made of elements behind its surface, all of whose
nodes are moved.  Sources: CalculiX CrunchiX user's manual 2.20, sec. 6.2 (elements), 6.7.8 (contact), 7 (cards).
Its hyperelastic energies are those of the isochoric invariants, with the volumetric part (J - 1)^2 / D1; hence
D1 = 2 / K.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import Mesh

MOST_TERMS = 3
"""Largest number of terms of Ogden's law in CalculiX."""

_NO_TERM = 1e12
"""Compressibility D_k, over D_1, of a volumetric term (J - 1)^2k / D_k that is left out: CalculiX takes 0 for a value
that is not given, and puts in one of its own."""

_ONE_CARD = 8  # constants on a line of a deck


def law_cards(own: Isotropic, law: IsochoricLaw | None) -> tuple[str, ...]:
    """Return the cards of a material: linear elasticity without a hyperelastic `law`.

    Raises
    ------
    Finger3dError
        If CalculiX has no such law.
    """
    if own.nu >= 0.5:
        raise Finger3dError(
            "--solver calculix: CalculiX has no elements for nu = 0.5; lower material.nu, for instance to 0.49"
        )
    if law is None:
        return ("*ELASTIC", f"{own.E_MPa:.12g}, {own.nu:.12g}")
    shear, bulk = own.E_MPa / (2.0 * (1.0 + own.nu)), own.E_MPa / (3.0 * (1.0 - 2.0 * own.nu))
    return _hyperelastic(law.with_shear(shear), 2.0 / bulk)


def _hyperelastic(law: IsochoricLaw, d1: float) -> tuple[str, ...]:
    match law:
        case NeoHooke():
            return _cards("NEO HOOKE", [0.5 * law.shear, d1])
        case MooneyRivlin():
            half = 0.5 * law.shear
            return _cards("MOONEY-RIVLIN", [half * (1.0 - law.c01_share), half * law.c01_share, d1])
        case Yeoh():
            c1 = 0.5 * law.shear
            return _cards("YEOH", [c1, c1 * law.c2_over_c1, c1 * law.c3_over_c1, d1, *2 * [_NO_TERM * d1]])
        case Ogden() if len(law.terms) <= MOST_TERMS:
            # CalculiX sums 2 mu / alpha^2 (l1^alpha + ...); this project mu / alpha (...) with mu = 2 share G / alpha
            terms = [number for share, alpha in law.terms for number in (share * law.shear, alpha)]
            return _cards(f"OGDEN, N={len(law.terms)}", [*terms, d1, *(len(law.terms) - 1) * [_NO_TERM * d1]])
        case Ogden():
            raise Finger3dError(
                f"--solver calculix: effects.large_deformation.terms: CalculiX has Ogden's law with up to {MOST_TERMS} "
                f"terms, and the scene {len(law.terms)}"
            )
    raise Finger3dError(f"--solver calculix: CalculiX has no equal of effects.large_deformation's {type(law).__name__}")


def _cards(name: str, constants: list[float]) -> tuple[str, ...]:
    text = [f"{c:.12g}" for c in constants]
    lines = [", ".join(text[i : i + _ONE_CARD]) for i in range(0, len(text), _ONE_CARD)]
    return (f"*HYPERELASTIC, {name}", *lines)


OBJECT = "NOBJECT"
"""Name of the object's node set; its total force, which ccx prints, is the contact force on the meshed part."""

_FACES = {2: ((0, 1), (1, 2), (2, 0)), 3: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))}  # S1, S2, ... of CPE6, C3D10


@dataclass(frozen=True)
class ObjectElements:
    """A rigid object as elements; the first face of each, S1, belongs to the surface.

    Attributes
    ----------
    nodes : (k, 3) mm, at first touch
    kind : type of the elements in CalculiX
    elements : (m, n) node numbers from 0
    """

    nodes: Float
    kind: str
    elements: Int

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class DeckStep:
    """A step of the path.

    Attributes
    ----------
    motion : (3,) or (k, 3) displacement of the object's nodes since first touch, at the end of the step, mm
    increments : at least so many
    """

    motion: Float
    increments: int

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class Contact:
    """Penalty contact.

    Attributes
    ----------
    penalty : pressure over overlap, MPa/mm
    stick : shear over displacement of sticking points, MPa/mm
    mu : friction coefficient; 0: no friction
    labels : faces of the finger that may touch
    """

    penalty: float
    stick: float
    mu: float
    labels: tuple[str, ...] = ("contact",)


@dataclass(frozen=True)
class Deck:
    """A press as CalculiX solves it.

    Attributes
    ----------
    mesh : quadratic, a part of the finger that `axes` mirror, in 2D or 3D
    laws : cards of the material of the main body, and of every part of the mesh
    object, steps, contact : see their classes
    axes : normals of the symmetry planes
    finite : finite strain
    plane_stress, thickness_mm : of a section
    remarks : comments at the head
    fields : whether displacements, strains, stresses and contact are written for a postprocessor
    """

    mesh: Mesh
    laws: tuple[tuple[str, ...], ...]
    object: ObjectElements
    steps: tuple[DeckStep, ...]
    contact: Contact
    axes: tuple[str, ...] = ()
    finite: bool = False
    plane_stress: bool = False
    thickness_mm: float = 1.0
    remarks: tuple[str, ...] = ()
    fields: bool = False

    def text(self) -> str:
        """Return the input deck."""
        lines = [f"** {remark}" for remark in self.remarks]
        lines += [*self._nodes(), *self._elements(), *self._materials(), *self._surfaces(), "*BOUNDARY", *self._held()]
        now = self._moved(np.zeros(3))
        for step in self.steps:
            now = self._moved(step.motion)
            lines += self._step(step, now)
        return "\n".join(lines) + "\n"

    @property
    def _dim(self) -> int:
        return self.mesh.dim

    def _nodes(self) -> list[str]:
        points = self.mesh.points
        at = points if self._dim == 3 else np.column_stack([points, np.zeros(len(points))])
        return ["*NODE, NSET=NALL", *_rows(at, 1), f"*NODE, NSET={OBJECT}", *_rows(self.object.nodes, len(points) + 1)]

    def _elements(self) -> list[str]:
        kind = "C3D10" if self._dim == 3 else "CPS6" if self.plane_stress else "CPE6"
        part = np.zeros(len(self.mesh.cells), dtype=np.int64) if self.mesh.part is None else self.mesh.part
        lines = []
        for k in range(len(self.laws)):
            own = np.flatnonzero(part == k)
            if len(own):
                lines += [f"*ELEMENT, TYPE={kind}, ELSET=BODY{k}", *_cells(self.mesh.cells[own] + 1, own + 1)]
        first, count = len(self.mesh.points) + 1, len(self.mesh.cells)
        numbers = count + 1 + np.arange(len(self.object.elements))
        return [
            *lines,
            f"*ELEMENT, TYPE={self.object.kind}, ELSET=OBJECT",
            *_cells(self.object.elements + first, numbers),
        ]

    def _materials(self) -> list[str]:
        section = [f"{self.thickness_mm:.12g}"] if self._dim == 2 else []
        part = {0} if self.mesh.part is None else set(np.unique(self.mesh.part).tolist())
        lines = []
        for k, cards in enumerate(self.laws):
            if k in part:
                lines += [f"*MATERIAL, NAME=MATERIAL{k}", *cards]
                lines += [f"*SOLID SECTION, ELSET=BODY{k}, MATERIAL=MATERIAL{k}", *section]
        # all nodes of the object are moved: its modulus has no meaning
        lines += ["*MATERIAL, NAME=RIGID", "*ELASTIC", "1000., 0."]
        return [*lines, "*SOLID SECTION, ELSET=OBJECT, MATERIAL=RIGID", *section]

    def _surfaces(self) -> list[str]:
        contact, first = self.contact, len(self.mesh.cells) + 1
        lines = ["*SURFACE, NAME=FINGER, TYPE=ELEMENT", *facet_lines(self.mesh, contact.labels)]
        lines += ["*SURFACE, NAME=UNDER, TYPE=ELEMENT"]
        lines += [f"{first + k}, S1" for k in range(len(self.object.elements))]
        lines += ["*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"]
        lines += [f"{contact.penalty:.6g}"]
        lines += ["*FRICTION", f"{contact.mu:.12g}, {contact.stick:.6g}"] if contact.mu else []
        return [*lines, "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "FINGER, UNDER"]

    def _held(self) -> list[str]:
        """Lines of the nodes of the base, and of those on symmetry planes that are not of the base."""
        facets = self.mesh.facets
        base = np.unique(facets["base"])
        lines = [f"{i + 1}, 1, 3" for i in base]
        for axis in self.axes:
            k = "xyz".index(axis) + 1
            lines += [f"{i + 1}, {k}, {k}" for i in np.setdiff1d(facets["symmetry_" + axis], base)]
        return lines

    def _moved(self, motion: Float) -> list[str]:
        """Return the boundary lines of the object's nodes."""
        if motion.ndim == 1:
            return [f"{OBJECT}, {k}, {k}, {value:.12g}" for k, value in enumerate(motion, start=1)]
        first = len(self.mesh.points) + 1
        return [
            f"{first + i}, {k}, {k}, {value:.12g}"
            for i, row in enumerate(motion.tolist())
            for k, value in enumerate(row, start=1)
        ]

    def _step(self, step: DeckStep, moved: list[str]) -> list[str]:
        share = 1.0 / step.increments
        lines = [f"*STEP, INC={1000 + 10 * step.increments}" + ", NLGEOM" * self.finite]
        lines += ["*STATIC", f"{share:.12g}, 1., 1e-5, {share:.12g}", "*BOUNDARY", *moved]
        lines += [f"*NODE PRINT, NSET={OBJECT}, FREQUENCY=1, TOTALS=ONLY", "RF"]
        if self.fields:
            lines += ["*NODE FILE", "U", "*EL FILE", "S, E", "*CONTACT FILE", "CDIS, CSTR"]
        return [*lines, "*END STEP"]


def facet_lines(mesh: Mesh, labels: Iterable[str]) -> list[str]:
    """Return lines `element, S<k>` of the facets with some labels."""
    d = mesh.dim
    key = {tuple(sorted(f[:d])) for label in labels if label in mesh.facets for f in mesh.facets[label].tolist()}
    found = []
    for k, corners in enumerate(_FACES[d], start=1):
        faces = np.sort(mesh.cells[:, list(corners)], axis=1)
        found += [f"{i}, S{k}" for i, f in enumerate(map(tuple, faces.tolist()), start=1) if f in key]
    return found


def _rows(points: Float, first: int) -> list[str]:
    return [f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(points.tolist(), start=first)]


def _cells(cells: Int, numbers: Int) -> list[str]:
    return [", ".join(map(str, (n, *c))) for n, c in zip(numbers.tolist(), cells.tolist(), strict=True)]
