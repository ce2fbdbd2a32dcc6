"""Errors that a user can correct, and outcomes of a solution."""

from __future__ import annotations

import errno
from enum import Enum


class Finger3dError(Exception):
    """A mistake in the input, described in one line: what, where, and what to do. Exit code 2."""

    exit_code = 2


class MissingError(Finger3dError):
    """Something required is missing, for instance a package or a converged increment. Exit code 3."""

    exit_code = 3


class UnresolvedError(Finger3dError):
    """The mesh is too coarse for the object. Exit code 3.

    Attributes
    ----------
    size_mm : edge length that resolves it; None if none is known
    """

    exit_code = 3

    def __init__(self, text: str, size_mm: float | None = None) -> None:
        super().__init__(text)
        self.size_mm = size_mm


FAILURES = Finger3dError, ArithmeticError, ValueError, RuntimeError, MemoryError
"""Errors of a press beside another one, which goes on without it."""

OUT_OF_MEMORY = (
    "out of memory; finished increments are kept; `finger3d plan` forecasts the memory, a larger mesh.size_mm or fewer "
    "increments and gauges need less"
)
"""What a user reads when memory runs out. Exit code 3."""


def out_of_memory(error: BaseException) -> bool:
    """Whether an exception says that memory ran out: of Python and NumPy, of the system, or of its loader."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM or "cannot allocate memory" in str(error).lower()
    texts = ("cannot allocate memory", "failed to map segment", "can't start new thread")
    return isinstance(error, ImportError | RuntimeError) and any(text in str(error).lower() for text in texts)


class Outcome(Enum):
    """Outcome of an increment. The value of a member is the text that a user reads: what failed, and what to try."""

    CONVERGED = "converged"
    NO_CONVERGENCE = (
        "contact did not settle to the tolerance; try more increments, a finer mesh, or a smaller friction coefficient"
    )
    CYCLED = (
        "the paper's swap rule repeated a state and has no answer for this increment; use [contact] rule = 'projection'"
    )
    WRONG_WAY = (
        "Eqs. (1)-(4) hold, but friction helps slip at some points, which the paper's rule does not exclude; "
        "use [contact] rule = 'projection'"
    )
    UNSTABLE = (
        "the material law is not stable at the strains reached, its stress falls; change its constants in "
        "[effects.large_deformation], or press less"
    )
    NEWTON = (
        "large deformation did not settle; the increments before are good; try more increments, a shallower press, a "
        "fillet where a sharp edge of the finger folds over, or small strain, effects.auto = false"
    )
    FORCE_NOT_REACHED = (
        "the prescribed force is not reached before finger or object come to the base; prescribe a smaller force, or "
        "a depth"
    )
    SLIPS = (
        "the whole contact slips: friction does not balance the prescribed tangential force; prescribe another one, or "
        "a larger normal force"
    )
    NOT_HELD = (
        "the object does not rest under the prescribed tangential force; prescribe its slide, more friction, or a "
        "larger normal force"
    )
    INDEFINITE = "the compliance is not positive: the body is not held; fix its base, or check the mesh"
    PASSED_THROUGH = (
        "the object would pass through the finger's surface within an increment, or the surface through it; the "
        "increments before are good; try more increments, or a finer mesh"
    )
    UNRESOLVED = "the object passes between the contact points; try a smaller mesh.size_mm"
    NOT_FINITE = "the compliance or the gap contains NaN or infinity; check the mesh and the material"

    @property
    def ok(self) -> bool:
        """Whether the increment may be trusted."""
        return self is Outcome.CONVERGED

    @property
    def is_cycle(self) -> bool:
        """Whether the paper's rule ended without a solution; later increments are solved nevertheless."""
        return self in (Outcome.CYCLED, Outcome.WRONG_WAY)

    def __str__(self) -> str:
        return str(self.value)
