"""The press of a finger on a plane in FElupe: node-to-plane penalty contact with friction, increments cut back.

FElupe is no dependency of the project: where it is not installed, studies judge the committed results.
"""

from __future__ import annotations

import numpy as np

from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.mechanics.model import Model

INSTALL = "pip install felupe"


def is_felupe_installed() -> bool:
    """Whether FElupe is there, with friction on its rigid plane."""
    try:
        import felupe
    except ImportError:
        return False
    return hasattr(felupe, "ContactRigidPlane") and hasattr(felupe, "CutbackPlugin")


def felupe_press(model: Model, mesh: Mesh, stiffer: float = 1.0) -> tuple[float, float]:
    """Press of a section in plane strain by FElupe: the share that it has done when it ends, and the normal force (N).

    Parameters
    ----------
    mesh : of the half section
    stiffer : factor of the tangential penalty of its defaults
    """
    import felupe as fem

    (leg,), linear = model.legs, model.material
    edges = {tuple(sorted(edge)): 3 + k for k, edge in enumerate(mesh.element.edges)}
    order = [0, 1, 2, edges[0, 1], edges[1, 2], edges[0, 2]]
    plane = [0.0, float(mesh.points[:, 1].max())]
    theirs = fem.Mesh(mesh.points, mesh.cells[:, order], "triangle6")
    theirs.add_points(plane)
    displacement = fem.FieldPlaneStrain(fem.RegionQuadraticTriangle(theirs), dim=2)
    field = fem.FieldContainer([displacement])
    solid = fem.SolidBody(fem.LinearElastic(E=linear.E_MPa, nu=linear.nu), field)
    contact = fem.ContactRigidPlane(
        field, _nodes(mesh, *FREE_FACES), -1, [0.0, -1.0], friction=model.friction.mu, items=[solid],
        multiplier_tangential=0.1 * stiffer,
    )  # fmt: skip

    def held(nodes: np.ndarray | list[int], skip: tuple[bool, bool]) -> fem.Boundary:
        return fem.Boundary(displacement, mask=np.isin(np.arange(theirs.npoints), nodes), skip=skip)

    last = [theirs.npoints - 1]
    boundaries = {
        "base": held(_nodes(mesh, "base"), (False, False)),
        "symmetry": held(_nodes(mesh, "symmetry_x"), (False, True)),
        "plane": held(last, (False, True)),
        "press": held(last, (True, False)),
    }
    path = fem.math.linsteps([0.0, -leg.depth_mm], num=leg.steps)
    step = fem.Step([solid, contact], boundaries=boundaries, ramp={boundaries["press"]: path})
    cutback = fem.CutbackPlugin()
    try:
        fem.Job([step], plugins=[cutback]).evaluate(verbose=0)
    except fem.NewtonConvergenceError:
        pass  # it gave up, which is what is measured
    done = [parts[-1] if parts else 0.0 for parts in cutback.load_factors[1:]]  # the first is the finger at rest
    reaction = fem.tools.force(field, solid.assemble.vector(), boundaries["base"])[1]
    return float(sum(done)) / leg.steps, 2.0 * model.design.width_mm * abs(float(reaction))


def _nodes(mesh: Mesh, *faces: str) -> np.ndarray:
    return np.unique(np.concatenate([mesh.facets[face].ravel() for face in faces if face in mesh.facets]))
