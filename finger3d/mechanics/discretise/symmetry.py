"""Mirror symmetry of a press: which part of the finger is meshed, and how the whole finger follows from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, freeze_arrays
from finger3d.contact.state import ContactState
from finger3d.fem.laws.material import LinearElasticity, contact_compliance
from finger3d.fem.mesh import FREE_FACES, Mesh, axis_numbers, unfold
from finger3d.fem.surface import BoundarySurface
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.model import Model
from finger3d.objects import PlacedObject, vertical_frame

LOCAL_DIRECTIONS = (1, 0, 2)
"""World axis of the normal and of each tangent of a contact point under an upright object."""

_BAND = 0.75
"""Half width of the band of points that figures show as the middle line, in edge lengths."""


def symmetry(model: Model) -> tuple[str, ...]:
    """Return the planes, "x" and "z", about which body, object and path are mirror images."""
    if model.symmetry is not None:
        return model.symmetry
    free = [tuple(force is not None for force in leg.forces) for leg in model.legs]
    moves = {  # a turn about x is its own mirror image along x
        "x": [(leg.slide_x_mm, leg.turn_y, leg.turn_z, f[1], *f[4:6]) for leg, f in zip(model.legs, free, strict=True)],
        "z": [(leg.slide_z_mm, leg.turn_x, leg.turn_y, *f[2:5]) for leg, f in zip(model.legs, free, strict=True)],
    }
    thing = PlacedObject.of(model.object, 0.0).mirrors()
    axes = ("x", "z") if model.domain == "solid" else ("x",)
    body = model.design.mirrors()
    inner = frozenset(axes)
    if model.inclusions is not None:
        from finger3d.mechanics.discretise.foils import foil_mirrors

        inner = foil_mirrors(model)
    return tuple(a for a in axes if a in body and a in inner and a in thing and not np.any(moves[a]))


@dataclass(frozen=True, kw_only=True)
class Symmetry:
    """Mirror images of the meshed part that make up the whole finger.

    Attributes
    ----------
    axes : tuple of str
        Normals of the symmetry planes, "x" and "z".
    image_of : (m,) array
        Number of the part's contact point that each point of the whole finger is an image of.
    mirror_sign : (m, d) array
        Factor of each local component at the part's point, +1 or -1.
    multiplicity : (m,) array
        Factor of force and area of the part's point, doubled for each plane that the point lies on.
    """

    axes: tuple[str, ...]
    image_of: NDArray[np.int64]
    mirror_sign: Float
    multiplicity: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def unfold(self, state: ContactState) -> ContactState:
        """Return the contact state of the whole finger (m points) from that of the part."""
        p = self.image_of
        tangent = self.mirror_sign[:, 1:]
        return ContactState(
            status=state.status[p],
            force=state.force[p] * self.mirror_sign * self.multiplicity[:, None],
            gap=state.gap[p],
            tangential_displacement=state.tangential_displacement[p] * tangent,
            accumulated_slip=state.accumulated_slip[p] * tangent,
            bases=self._unfold_bases(state.bases),
        )

    def total(self, values: Float) -> float:
        """Return the sum over the whole finger of values (c,) at the part's points."""
        return float((values[self.image_of] * self.multiplicity).sum())

    def total_moment(self, moment: Float) -> Float:
        """Return the moment (3,) on the whole finger about a point of all symmetry planes from that on the part.

        Reflected in a plane, the components of a moment in the plane change sign.
        """
        whole = np.array(moment, dtype=float)
        for axis in axis_numbers(self.axes):
            whole *= np.where(np.arange(3) == axis, 2.0, 0.0)
        return whole

    def _unfold_bases(self, bases: Float | None) -> Float | None:
        if bases is None:
            return None
        world = self.mirror_sign[:, LOCAL_DIRECTIONS[: bases.shape[-1]]]
        return bases[self.image_of] * self.mirror_sign[:, :, None] * world[:, None, :]


def held_dofs(mesh: Mesh, axes: tuple[str, ...], held_ends: bool) -> NDArray[np.int64]:
    """Return the numbers of the unknowns that are zero: the base, across symmetry planes, and ends if they are held."""
    d = mesh.dim
    base = np.unique(mesh.facets["base"])
    held = [(base[:, None] * d + np.arange(d)).ravel()]
    held += [np.unique(mesh.facets["symmetry_" + a]) * d + i for a, i in zip(axes, axis_numbers(axes), strict=True)]
    if held_ends and d == 3:
        held.append(np.unique(mesh.facets["ends"]) * d + 2)
    return np.unique(np.concatenate(held))


def active_dofs(face: BoundarySurface, axes: tuple[str, ...]) -> NDArray[np.int64]:
    """Return the numbers point * d + direction of the contact rows that move.

    The tangent across a symmetry plane is left out for points on the plane.
    """
    keep = np.ones(face.points.shape, dtype=bool)
    for i in axis_numbers(axes):
        keep[:, LOCAL_DIRECTIONS.index(i)] &= face.points[:, i] != 0.0
    return np.flatnonzero(keep.ravel())


def unfold_points(
    model: Model, mesh: Mesh, face: BoundarySurface, axes: tuple[str, ...], elastic: LinearElasticity
) -> tuple[Symmetry, ContactPoints]:
    """Return the symmetry of a part's contact points, and the contact points of the whole finger."""
    d = mesh.dim
    numbers = axis_numbers(axes)
    labels = [FREE_FACES[k] for k in np.unique(face.face)]
    facets = {label: mesh.facets[label] for label in labels}
    shape, parent_all, sign_all = unfold(Mesh(mesh.points, mesh.cells[:0], facets), numbers)
    images = [_images(face, label, shape, parent_all, d) for label in labels]
    nodes, parent = (np.concatenate([image[k] for image in images]) for k in (0, 1))
    before = np.cumsum([0] + [len(image[0]) for image in images])
    world_sign = sign_all[nodes]
    planes = np.zeros(len(nodes))
    for i in numbers:
        planes += face.points[parent][:, i] == 0.0
    multiplicity = 2.0**planes
    coordinates = np.zeros((len(nodes), 3))
    coordinates[:, :d] = face.points[parent] * world_sign
    symmetric = Symmetry(
        axes=axes,
        image_of=parent,
        mirror_sign=world_sign[:, LOCAL_DIRECTIONS[:d]],
        multiplicity=multiplicity,
    )
    points = ContactPoints(
        nodes=nodes,
        face=face.face[parent],
        points=coordinates,
        area=face.area[parent] * multiplicity,
        basis=vertical_frame(d),
        half_width_mm=model.design.width_mm / 2.0,
        band_mm=_BAND * model.mesh.size_mm,
        facets=np.vstack([image[2] + first for image, first in zip(images, before, strict=False)]),
        compliance=contact_compliance(elastic, mesh)[face.nodes[parent]],
    )
    return symmetric, points


def _images(
    face: BoundarySurface, label: str, whole: Mesh, image_of: NDArray[np.int64], dim: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the points of a face and all their mirror images.

    Parameters
    ----------
    whole : facets of the whole finger
    image_of : number of the part's node that each node of `whole` is an image of

    Returns
    -------
    nodes : (k,) of the whole finger, ascending
    parent : (k,) number of the part's contact point
    facets : (f, d) positions in `nodes` of the vertices of facets
    """
    corners = whole.facets[label][:, :dim]
    number = np.full(image_of.max() + 1, -1)
    rows = np.flatnonzero(face.face == FREE_FACES.index(label))
    number[face.nodes[rows]] = rows
    on_face = np.unique(corners)
    nodes = on_face[number[image_of[on_face]] >= 0]
    position = np.minimum(np.searchsorted(nodes, corners), len(nodes) - 1)
    return nodes, number[image_of[nodes]], position[(nodes[position] == corners).all(axis=1)]
