"""What a process of its own does with a case of `_cost`: press it."""

from __future__ import annotations

import time
from typing import Any

from finger3d.geometry.design import designs
from finger3d.mechanics.formulations import formulation_of

from ._cost import Case, assembled, condensed, in_steps, numbers, processor_s
from ._each_iteration import EachIteration

MODULE = __name__.rpartition(".")[2]


def prepare() -> None:
    """Load what every case needs, before the first fork; no factorisation, which would start threads."""
    import scipy.special  # noqa: F401 - a quadrature rule of linear elements takes it, and half a second
    from pypardiso import PyPardisoSolver

    from finger3d.contact.acceleration import threads_for
    from finger3d.fem.solvers.condense import is_installed

    if is_installed("pardiso"):
        PyPardisoSolver().libmkl.MKL_Get_Max_Threads()
    threads_for(1)
    designs()


def measured(given: dict[str, Any]) -> dict[str, Any]:
    """Sizes, seconds and processor time by stage, and numbers by increments of a case, given as a dict."""
    case = Case.of(given)
    used = time.process_time()
    parts, processor = assembled(case)
    answer: dict[str, Any] = {
        "dofs": int(parts.body.stiffness.upper.shape[0]),
        "contact_points": len(parts.surface.nodes),
        "mesh_from_cache": parts.body.report.from_cache,
    }
    seconds = {"mesh": parts.seconds["cad"] + parts.seconds["mesh"], "assembly": parts.seconds["assembly"]}
    if case.way == "each iteration":
        press = EachIteration(parts)
        begin, spent = time.perf_counter(), processor_s()
        values = press.run(case.counts[0])
        seconds |= {"condensation": 0.0, f"contact {case.counts[0]}": time.perf_counter() - begin}
        processor |= {"condensation": 0.0, f"contact {case.counts[0]}": processor_s() - spent}
        answer |= {"seconds": seconds, "processor_seconds": processor, "factorizations": press.solves}
        return {**answer, "numbers": {str(case.counts[0]): values}}
    spent = processor_s()
    problem = condensed(parts, case.solver)
    seconds["condensation"] = problem.body.condensed.seconds
    processor["condensation"] = processor_s() - spent
    answer |= {
        "rows": len(problem.body.condensed.compliance),
        "perturbed_pivots": problem.body.condensed.perturbed_pivots,
    }
    found, iterations, factorizations = {}, {}, {}
    for count in case.counts:
        begin, spent = time.perf_counter(), processor_s()
        workspace = formulation_of(problem.model).workspace()
        frames = in_steps(problem, count, workspace)
        factorizations[str(count)] = 1 + workspace.factorizations
        seconds[f"contact {count}"] = time.perf_counter() - begin
        processor[f"contact {count}"] = processor_s() - spent
        found[str(count)] = numbers(problem.points, frames[-1])
        iterations[str(count)] = sum(f.iterations for f in frames)
    usual = str(10 if 10 in case.counts else case.counts[0])
    answer |= {"numbers": found, "iterations": iterations, "factorizations": factorizations[usual]}
    return {**answer, "cpu_s": time.process_time() - used, "seconds": seconds, "processor_seconds": processor}
