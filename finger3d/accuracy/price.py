"""Price of smaller error bars: time and memory of the same press with a third of them."""

from __future__ import annotations

from finger3d._cost import FIGURES_S, START_S, PressSize, duration, meshing_s
from finger3d.accuracy.richardson import ORDER
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.problem import Problem
from finger3d.meshing.given.given import GivenMesh
from finger3d.meshing.limits import check_memory

_FACTOR = (1.0 / 3.0) ** (1.0 / ORDER)


def price_of_a_third(problem: Problem, increments: int, seconds: float) -> str:
    """Return seconds, memory and edge lengths of the press with a third of its error bars, in one line.

    Parameters
    ----------
    increments : of the press
    seconds : that it took without meshing and output, its error bars included

    Returns
    -------
    str
        Empty where the mesh was given, so that there are no edge lengths to choose.
    """
    model, own = problem.model, problem.size
    if isinstance(model.design, GivenMesh):
        return ""
    finer = PressSize(own.dim, own.dofs * _FACTOR**-own.dim, own.contact_points * _FACTOR ** (1 - own.dim))

    def solving(size: PressSize) -> float:
        each = size.contact_s + (size.finite_strain_s if model.finite_strain else 0.0)
        return size.assembly_s + size.condensation_s + increments * each

    meshing = 0.0
    if own.dim == 3 and model.mesh.mesher == "ftetwild":
        meshing = meshing_s(problem.body.report.cells * _FACTOR**-own.dim)
    needed = seconds * solving(finer) / solving(own) + START_S + meshing + FIGURES_S[own.dim]
    memory = finer.press_gb()
    size, base = (_FACTOR * length for length in (model.mesh.size_mm, model.mesh.base_size_mm))
    where = f"mesh.size_mm = {size:.3g}, mesh.base_size_mm = {base:.3g}"
    if model.mesh.stick_refinement > 1.0:  # by default a mesh with sizes has none
        where += f", mesh.stick_refinement = {model.mesh.stick_refinement:g}"
    try:
        check_memory(memory, "a third of the error bars")
    except Finger3dError:
        return f"{memory:.2g} GB, more than this machine has ({where})"
    return f"about {duration(needed)} and {memory:.2g} GB ({where})"
