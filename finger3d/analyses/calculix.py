"""Meshes and input decks of a scene for other programs: VTU, and CalculiX as its solver ccx reads it.

The contact is CalculiX's surface to surface penalty.  The object is made of elements behind its surface, all of whose
nodes are moved.  Sources: CalculiX CrunchiX user's manual 2.20, sec. 6.2 (elements), 6.7.8 (contact), 7 (cards).
Its hyperelastic energies are those of the isochoric invariants, with the volumetric part (J - 1)^2 / D1; hence
D1 = 2 / K.

A plane is one hexahedron (in a section, a quadrilateral).  The others are facets that follow the surface within a
sagitta: the pieces of a section swept along its axis, each with a hexahedron behind it, or triangles, each with a
tetrahedron.  Every element has inner nodes of its own, and hence a positive volume at any edge.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d._types import Float, Int
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.io import claimed, holds, write_text
from finger3d.mechanics.discretise.build import mesh_part
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import Leg, Model, ways
from finger3d.mechanics.path import AUTO_START
from finger3d.objects import (
    Cylinder,
    MeshObject,
    Move,
    ObjectPose,
    PlacedObject,
    Plane,
    RigidObject,
    Sphere,
    Wave,
    Wedge,
)
from finger3d.objects.rigid import Prism
from finger3d.progress import QUIET, Progress
from finger3d.scene import Source, scene_of

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
    multiple : forces on the whole finger over those on the part, for components along no mirrored axis
    notes : differences between the deck and the press, a line each
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
    multiple: float = 1.0
    notes: tuple[str, ...] = ()

    def text(self) -> str:
        """Return the input deck."""
        lines = [f"** {remark}" for remark in self.remarks]
        lines += [*self._nodes(), *self._elements(), *self._materials(), *self._surfaces(), "*BOUNDARY", *self._held()]
        for step in self.steps:
            lines += self._step(step)
        return "\n".join(lines) + "\n"

    def _nodes(self) -> list[str]:
        points = self.mesh.points
        at = points if self.mesh.dim == 3 else np.column_stack([points, np.zeros(len(points))])
        return ["*NODE, NSET=NALL", *_rows(at, 1), f"*NODE, NSET={OBJECT}", *_rows(self.object.nodes, len(points) + 1)]

    def _elements(self) -> list[str]:
        kind = "C3D10" if self.mesh.dim == 3 else "CPS6" if self.plane_stress else "CPE6"
        part = np.zeros(len(self.mesh.cells), dtype=np.int64) if self.mesh.part is None else self.mesh.part
        lines = []
        for k in range(len(self.laws)):
            own = np.flatnonzero(part == k)
            if len(own):
                lines += [f"*ELEMENT, TYPE={kind}, ELSET=BODY{k}", *_cells(self.mesh.cells[own] + 1, own + 1)]
        first, count = len(self.mesh.points) + 1, len(self.mesh.cells)
        numbers = count + 1 + np.arange(len(self.object.elements))
        lines += [f"*ELEMENT, TYPE={self.object.kind}, ELSET=OBJECT"]
        return lines + _cells(self.object.elements + first, numbers)

    def _materials(self) -> list[str]:
        section = [f"{self.thickness_mm:.12g}"] if self.mesh.dim == 2 else []
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

    def _step(self, step: DeckStep) -> list[str]:
        share = 1.0 / step.increments
        lines = [f"*STEP, INC={1000 + 10 * step.increments}" + ", NLGEOM" * self.finite]
        lines += ["*STATIC", f"{share:.12g}, 1., 1e-5, {share:.12g}", "*BOUNDARY", *self._moved(step.motion)]
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


MOST_FACETS = 20_000
"""Largest number of facets near the finger: CalculiX searches among them at every increment."""

_FINEST = 8  # halvings of the edges of an icosahedron: 1.3 million triangles
_STRAIGHT_REACH = 1.0  # of an element behind its facet, over the shortest edge


@dataclass(frozen=True)
class Facets:
    """Facets of a surface: points (n, 3), and the corners (m, 2 | 3 | 4) of segments, triangles or quadrilaterals."""

    points: Float
    faces: Int

    @property
    def middles(self) -> Float:
        """Middles (m, 3) of the facets."""
        return np.asarray(self.points[self.faces].mean(axis=1))


def object_elements(
    placed: Sequence[PlacedObject], low: Float, high: Float, sagitta_mm: float, dim: int
) -> tuple[ObjectElements, Float]:
    """Return the elements of an object at its first pose, and the displacements of their nodes at each pose.

    Parameters
    ----------
    placed : poses of the object, the first of them first touch
    low, high : (3,) corners of the box, mm, in which the finger stays; what never gets into it is left out
    sagitta_mm : largest distance of a facet from the surface
    dim : 2 for a section, 3

    Returns
    -------
    elements : of the object
    motion : (p, k, 3) mm, displacement of every node since the first pose

    Raises
    ------
    Finger3dError
        If more facets come near the finger than CalculiX can search.
    """
    obj = placed[0].object
    corners = np.array([*itertools.product(*zip(low, high, strict=True))])
    reach = max(float(np.abs(pose.to_own(corners)).max()) for pose in placed)
    facets = (_surface if dim == 3 else _section)(obj, reach, sagitta_mm)
    if not isinstance(obj, Plane):
        facets = _near(facets, placed, low, high)
    if not 0 < len(facets.faces) <= MOST_FACETS:
        raise Finger3dError(
            f"--solver calculix: {len(facets.faces)} facets of the object come near the finger; CalculiX takes 1 to "
            f"{MOST_FACETS}: press deeper, or simplify the object"
        )
    own, kind, elements = _backed(obj, facets)
    motion = np.array([pose.to_scene(own) for pose in placed])
    return ObjectElements(motion[0], kind, elements), motion - motion[0]


def _near(facets: Facets, placed: Sequence[PlacedObject], low: Float, high: Float) -> Facets:
    """Return the facets whose box meets that of the finger in any pose."""
    kept = np.zeros(len(facets.faces), dtype=bool)
    for pose in placed:
        corners = pose.to_scene(facets.points)[facets.faces]
        kept |= ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    used, faces = np.unique(facets.faces[kept], return_inverse=True)
    return Facets(facets.points[used], faces.reshape(-1, facets.faces.shape[1]))


# --- surfaces in the object's own coordinates ---------------------------------------------------------------------


def _surface(obj: RigidObject, reach: float, sagitta: float) -> Facets:
    """Return the facets of an object in space, as far as it reaches."""
    match obj:
        case Plane() | Prism():
            return _swept(_curve(obj, reach, sagitta), reach, obj.axis if isinstance(obj, Prism) else "z")
        case Sphere():
            return _sphere(obj.radius_mm, sagitta)
        case MeshObject():
            return Facets(obj.triangles.points, obj.triangles.faces)
    raise Finger3dError(f"--solver calculix: an object of the kind {type(obj).__name__} cannot be written")


def _section(obj: RigidObject, reach: float, sagitta: float) -> Facets:
    """Return the segments of an object in the plane z = 0."""
    if isinstance(obj, Sphere):
        obj = Cylinder(radius_mm=obj.radius_mm)
    if not isinstance(obj, Plane | Prism):
        raise Finger3dError("--solver calculix: a triangulated object needs model.domain = 'solid'")
    if isinstance(obj, Prism) and obj.axis == "x":
        obj = Plane()
    curve = _curve(obj, reach, sagitta)
    points = np.column_stack([curve, np.zeros(len(curve))])
    number = np.arange(len(points) - 1)
    return Facets(points, np.stack([number, number + 1], axis=1))


def _curve(obj: Plane | Prism, reach: float, sagitta: float) -> Float:
    """Return points (n, 2), distance from the lowest line and height in mm, along a section."""
    match obj:
        case Plane():
            r = np.array([-reach, reach])
            return np.column_stack([r, math.tan(obj.tilt) * r])
        case Cylinder():
            polar = _angles(math.pi, obj.radius_mm, sagitta)
            return obj.radius_mm * np.column_stack([np.sin(polar), 1.0 - np.cos(polar)])
        case Wedge():
            polar = _angles(obj.angle, obj.tip_radius_mm, sagitta)
            tip = obj.tip_radius_mm * np.column_stack([np.sin(polar), 1.0 - np.cos(polar)])
            beyond = reach * np.array([math.cos(obj.angle), math.sin(obj.angle)])
            return np.vstack([tip[0] + beyond * [-1.0, 1.0], tip, tip[-1] + beyond])
        case Wave():
            curvature = obj.amplitude_mm * (2.0 * math.pi / obj.wavelength_mm) ** 2
            step = min(math.sqrt(8.0 * sagitta / curvature) if curvature else reach, obj.wavelength_mm / 8.0)
            r = np.linspace(-reach, reach, 2 * math.ceil(reach / step) + 1)
            return np.column_stack([r, obj.section_profile(r)])
    raise Finger3dError(f"--solver calculix: an object of the kind {type(obj).__name__} cannot be written")


def _angles(most: float, radius: float, sagitta: float) -> Float:
    """Return angles from the lowest point of a circle, both ways, whose chords stay within a sagitta."""
    if radius == 0.0:
        return np.zeros(1)
    step = 2.0 * math.acos(max(1.0 - sagitta / radius, 0.9))
    return np.linspace(-most, most, 2 * math.ceil(most / step) + 1)


def _swept(curve: Float, reach: float, axis: str) -> Facets:
    """Return quadrilaterals from a curve (n, 2), swept along the axis over +-reach."""
    n = len(curve)
    ends = [np.column_stack([curve, np.full(n, end)]) for end in (-reach, reach)]
    points = np.vstack(ends)
    number = np.arange(n - 1)
    faces = np.stack([number, number + 1, number + 1 + n, number + n], axis=1)
    return Facets(points if axis == "z" else points[:, ::-1], faces)


def _sphere(radius: float, sagitta: float) -> Facets:
    """Return an icosahedron with its edges halved until the triangles stay within a sagitta of the sphere."""
    import trimesh

    for halvings in range(2, _FINEST + 1):
        ball = trimesh.creation.icosphere(subdivisions=halvings, radius=radius)
        if radius - np.linalg.norm(ball.triangles_center, axis=1).min() <= sagitta:
            break
    return Facets(np.asarray(ball.vertices) + [0.0, radius, 0.0], np.asarray(ball.faces, dtype=np.int64))


# --- elements -----------------------------------------------------------------------------------------------------


def _backed(obj: RigidObject, facets: Facets) -> tuple[Float, str, Int]:
    """Return nodes (k, 3), type and elements (m, n) behind the facets; the first face of each is its facet.

    Seen from its inner nodes, the corners of a facet run counterclockwise; a segment has them on its left.
    """
    corners = facets.points[facets.faces]
    count, sides = facets.faces.shape
    if sides == 2:
        along = corners[:, 1] - corners[:, 0]
        inward = np.column_stack([-along[:, 1], along[:, 0], np.zeros(count)])
    else:
        inward = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    outside = np.einsum("ij,ij->i", inward, obj.distance(facets.middles)[1]) > 0.0
    faces = facets.faces.copy()
    faces[outside] = faces[outside][:, ::-1]
    inward[outside] *= -1.0
    corners = facets.points[faces]
    shortest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1)
    behind = (_STRAIGHT_REACH * shortest)[:, None] * inward
    first = len(facets.points)
    if sides == 3:
        inner = corners.mean(axis=1) + behind
        return np.vstack([facets.points, inner]), "C3D4", np.column_stack([faces, first + np.arange(count)])
    inner = (corners + behind[:, None]).reshape(-1, 3)
    own = first + np.arange(count * sides).reshape(count, sides)
    if sides == 2:
        return np.vstack([facets.points, inner]), "CPE4", np.column_stack([faces, own[:, ::-1]])
    return np.vstack([facets.points, inner]), "C3D8", np.column_stack([faces, own])


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


def press_deck(model: Model, title: str = "", report: Progress = QUIET) -> Deck:
    """Mesh a model as a press does, and return it as a deck.

    Raises
    ------
    Finger3dError
        If CalculiX has no equal of an effect, a law, or a leg.
    """
    _check(model)
    contact, axes = model.first_contact, symmetry(model)
    mesh, _ = mesh_part(model, contact.contact_box, axes, report)
    laws = tuple(law_cards(material, model.hyperelastic_law) for material in model.materials(mesh.part_labels))
    touch = contact.first_contact_mm
    stretches = [stretch for leg, way in ways(model.legs) for stretch in _stretches(leg, way)]
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
    return Deck(
        mesh=mesh,
        laws=laws,
        object=elements,
        steps=steps,
        contact=Contact(penalty, STICK_SHARE * penalty, model.friction.mu, FREE_FACES),
        axes=axes,
        finite=model.finite_strain,
        plane_stress=model.domain == "plane-stress",
        thickness_mm=thickness,
        remarks=tuple(
            line.encode("ascii", errors="replace").decode()
            for line in (*_head(title, axes, multiple), *_remarks(model))
        ),
        fields=True,
        multiple=multiple,
        notes=_remarks(model),
    )


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
    if model.finite_strain and model.domain == "plane-stress":
        raise Finger3dError(
            "--solver calculix: CalculiX has no equal of [effects.large_deformation] in plane stress; take it out, or "
            "change model.domain"
        )


def _stretches(leg: Leg, way: Move) -> list[tuple[ObjectPose, int]]:
    """Return the ends and increments of the steps of a leg: one step, or one for each increment of a leg that turns.

    Within a step CalculiX moves every node of the object along a straight line.
    """
    count = leg.steps if isinstance(leg.steps, int) else AUTO_START
    if way.end.turns == way.start.turns:
        return [(way.end, count)]
    return [(way.at(k / count), 1) for k in range(1, count)] + [(way.end, 1)]


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


MESH_FILE = "finger.vtu"
DECK_FILE = "press.inp"


@dataclass(frozen=True)
class ModelFiles:
    """Files of a model.

    Attributes
    ----------
    files : paths of the files
    points, cells : of the mesh that was written
    multiple : forces on the whole finger over those that CalculiX prints; None without a deck
    remarks : remarks for the user, a line each
    """

    files: tuple[Path, ...]
    points: int
    cells: int
    multiple: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The mesh and the factor of the forces in words."""
        rows = [("mesh", f"{self.cells} cells, {self.points} points")]
        if self.multiple is not None:
            rows.append(("force", f"{self.multiple:.12g} times the total force that ccx prints"))
        return rows


def export_mesh(
    scene: Source, out: str | Path, report: Progress | None = None, overrides: Sequence[str] = ()
) -> ModelFiles:
    """Write the mesh of the whole finger, its facets and its parts by name, as finger.vtu.

    It may be the finger of another scene.  Where symmetry halves the press, the mesh is unfolded.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for the files
    report : told about stages
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        If the scene is a section, or the folder holds the finger's own file.
    """
    from finger3d.fem.mesh import axis_numbers, unfold
    from finger3d.mechanics.discretise.build import mesh_part
    from finger3d.mechanics.discretise.symmetry import symmetry
    from finger3d.meshing.mesh_files import write_mesh_vtu

    out, report, scene = Path(out), report or Progress(), scene_of(scene, overrides)
    model = scene.model()
    if model.domain != "solid":
        raise Finger3dError(f'--mesh: a section has no tetrahedra; set model.domain = "solid", not "{model.domain}"')
    own = Path(getattr(scene.design, "path", ""))
    if holds(out, (MESH_FILE,), own):
        raise Finger3dError(f"--out {out}: holds {own.name}, the finger's own file; name another folder")
    report.stage("meshing")
    axes = symmetry(model)
    part, _ = mesh_part(model, model.first_contact.contact_box, axes, report)
    whole, _, _ = unfold(part, axis_numbers(axes))
    with claimed(out):
        write_mesh_vtu(out / MESH_FILE, whole)
    return ModelFiles((out / MESH_FILE,), len(whole.points), len(whole.cells))


def export_deck(
    scene: Source, out: str | Path, report: Progress | None = None, overrides: Sequence[str] = ()
) -> ModelFiles:
    """Write press.inp, the same mesh, materials, object and path as an input deck of CalculiX.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    out : folder for the files
    report : told about stages
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Raises
    ------
    Finger3dError
        If CalculiX has no equal of what the scene asks for; the line names it.
    """
    from finger3d.analyses.free_keys import settled

    out, report = Path(out), report or Progress()
    scene, _ = settled(scene_of(scene, overrides), report)
    report.stage("meshing")
    deck = press_deck(scene.model(), scene.title, report)
    report.stage("writing the deck")
    with claimed(out):
        write_text(out / DECK_FILE, deck.text())
    return ModelFiles((out / DECK_FILE,), len(deck.mesh.points), len(deck.mesh.cells), deck.multiple, deck.notes)
