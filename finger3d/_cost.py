"""Cost model: seconds on two cores and memory, from the size of the meshed part.

Calibrated on the Fig. 9 finger by the runs of validation/cost_of_accuracy.py and scaling.py, up to 386 000 unknowns in
2D and 1 010 000 in 3D.  Solids among them took 0.53 to 1.09 times the forecast time and 1.01 to 1.27 times the memory;
other presses 0.63 to 2.5 times the time, and solids meshed by fTetWild 0.79 to 1.19 times the memory.  The processor
time that large deformation took on one core was 0.69 to 1.48 times the forecast.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MAX_TETS = 1_000_000
"""Largest number of tets for pytetwild, which takes minutes below and hours above."""

MEMORY_SHARE = 0.8
"""Largest share of the machine's memory that a solution may need."""

START_S, FIGURES_S = 0.4, {2: 1.0, 3: 4.5}
"""Seconds to import the package, and to draw the figures by dimension."""

BASE_MB, CAD_MB = 170.0, 400.0
"""Memory of the package, and of CAD besides, with which unstructured meshes are made."""

GAUGE_S, GAUGE_CELL_S = 3e-3, 7e-7
"""Seconds for each gauge, and for each cell searched for it."""

AUTOMATIC_S = 4.0
"""Seconds that automatic increments may take in addition to those of the condensation."""

JUDGEMENT_S, JUDGEMENT_SHARE = 1.0, 0.1
"""Seconds that the judgement of effects may take in any case, and over those of the press."""

CALIBRATION_S, CALIBRATION_PRESSES = 60.0, 40.0
"""Forecast time of a calibration beyond which a finer mesh is recommended but not used, and its time over that of a
press without output: 12 to 32 in sections of 8 000 to 75 000 unknowns, 45 at large deformation, 50 to 75 in solids."""

INCREMENT_ERRORS_S, INCREMENT_ERRORS_SHARE = 0.2, 0.15
"""Seconds that the errors of the increments may take in any case, and over those of the press."""

GROWTH = {2: 1.2, 3: 1.6}
"""Power of the unknowns with which the seconds of a press grow, by dimension; from 161 000 to 523 000 of a solid."""

PRESS_TO_ROUND = 1.3
"""Time of a press over that of its last round of refinement: contact is solved again, and drawn."""

USUAL_INCREMENTS = 20
"""Usual number of automatic increments, at second order."""

LEAST_BARS_S = 0.5
COMPANIONS, COMPANIONS_BESIDE, FINER_COMPANION = 0.6, 0.45, 3.5
"""Seconds of the error bars of any press, and others over those of the press.  The companions have 0.35, 0.13 and 0.02
of its unknowns in solids; at large deformation they are pressed beside it.  The finer one of a coarse solid has 2.9."""

SOLUTIONS = 5
"""Contact solutions of an increment in small strain under an object that is not flat, whose normals change.

They were 4 to 7 under a ball, an edge and a wave, and 10 under triangulated objects, whose distances take longer still.
With them, forecasts for the wavy plate and the gear of geometries/ are 0.7 of the processor time of their presses.
"""

CONTACT_EXTENT = 0.7
"""Extents of the contact over those of the overlap of a rigid object; of Hertz's contact."""

BORDER_POINTS, BORDER_UNKNOWNS = {True: 1.2, False: 2.1}, 105.0
"""Contact points added along one edge of the border of stick, over what its refinement asks for, of swept and other
meshes; and unknowns for each of them."""

GAUGE_UNKNOWNS = 140.0
"""Unknowns for each contact point added close to a gauge, those around the gauge included; of the finger of Fig. 9."""

FOIL_ROWS = {2: 16, 3: 96}
"""Condensed rows of a foil with its mirror images, by dimension."""

FOIL_S = {2: 0.02, 3: 0.2}
"""Seconds to discretise a foil, by dimension."""

_NODES_PER_TET, _VERTICES_PER_TET = (1.36, 4.0), (0.16, 1.25)
"""Nodes and vertices of a quadratic mesh over its number of tets: inside, and on its surface times tets^(1/3).  Medians
of 152 meshes of fTetWild with 600 to 20 000 tets lie within 3 % of it, unknowns of large swept meshes within 1 %."""

_DOFS_PER_TRIANGLE = 4.1

_ITERATIONS_AN_INCREMENT = 9
"""Iterations of an increment at finite strain, which has about one factorisation of the tangent."""

_NUMERIC_FACTORISATION = 0.85
"""Time of a factorisation whose ordering is known, with the assembly of its tangent, over that of a condensation."""

_ITERATION_S, _LEAST_ITERATION_S = {2: 7.5e-7, 3: 2.8e-6}, 4e-3
"""Seconds of an iteration for each unknown by dimension, for a residual and both substitutions; and for any mesh.

Increments of sections of 500 to 144 000 unknowns took 0.65 to 2.4 times the time that follows, and 1.1 in the median.
"""

_LEAST_TETS = 1600.0
"""Tets of the coarsest meshes by fTetWild; see `tets_of_ftetwild`."""


@dataclass(frozen=True)
class PressSize:
    """Size of a meshed part: dimension, unknowns and contact points."""

    dim: int
    dofs: float
    contact_points: float

    @property
    def assembly_s(self) -> float:
        """Seconds of the assembly."""
        return 8e-6 * self.dofs if self.dim == 3 else 0.005 + 3e-6 * self.dofs

    @property
    def condensation_s(self) -> float:
        """Seconds of the condensation."""
        return float(6.0 * (self.dofs / 85_000.0) ** 1.75 if self.dim == 3 else 0.004 + 8e-6 * self.dofs)

    @property
    def contact_s(self) -> float:
        """Seconds of contact in an increment."""
        points = self.contact_points
        return float(0.0025 + (0.065 * (points / 680.0) ** 2.4 if self.dim == 3 else 0.038 * (points / 700.0) ** 2.75))

    @property
    def finite_strain_s(self) -> float:
        """Seconds that finite strain adds to an increment."""
        iteration = _LEAST_ITERATION_S + _ITERATION_S[self.dim] * self.dofs
        return _NUMERIC_FACTORISATION * self.condensation_s + _ITERATIONS_AN_INCREMENT * iteration

    @property
    def factor_mb(self) -> float:
        """Memory of the factorised stiffness."""
        return factor_mb(self.dofs, self.dim)

    def press_s(self, increments: int) -> float:
        """Return the seconds of a press in small strain, without meshing and output."""
        return self.condensation_s + increments * self.contact_s

    def press_gb(self, readings: int = 0) -> float:
        """Return the memory of a press in small strain, GB, without its states."""
        return 1e-3 * (self.factor_mb + BASE_MB) + rows_gb(self.dim * self.contact_points + readings)


def duration(seconds: float) -> str:
    """Return seconds in words, in minutes from 90 s on, in hours from 90 min on."""
    if seconds < 90.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def meshing_s(cells: float) -> float:
    """Return the seconds in which fTetWild meshes a body, and CAD prepares it."""
    return 3.0 + 3.5e-4 * cells


def meshing_limit_s(cells: float, triangles: int) -> float:
    """Return five times the seconds that fTetWild took on a loaded machine.

    With a coarse surface: 6 s for 4 700 tets, 149 s for 219 000.  With few tets: 27 s for 5 500 triangles, 197 s for
    34 000.
    """
    return 5.0 * (10.0 + 8e-4 * cells + 5e-3 * triangles)


def netgen_limit_s(cells: float) -> float:
    """Return ten times the seconds that netgen took on a loaded machine, and a minute."""
    return 60.0 + 4e-3 * cells


def tets_made(ratio: float) -> float:
    """Return the number of tets that fTetWild makes over the number that the field of edge lengths asks for.

    Cells grow faster than the field where its largest length is `ratio` times the smallest: nineteen meshes of five
    bodies, with ratios of 3 to 20, had 0.8 to 1.7 times the tets that follow.
    """
    return float(min(0.69 * (5.0 / ratio) ** 0.4, 1.0))


def tets_of_ftetwild(cells: float) -> float:
    """Return the number of tets that fTetWild makes where its edge lengths ask for `cells`; a coarse mesh stays finer.

    It made 1400 to 2000 where 70 to 800 were asked for, 2300 for 1200 and for 1900 (quarters of ten bodies).
    """
    return math.hypot(cells, _LEAST_TETS)


def tet_unknowns(cells: float, mixed: bool) -> float:
    """Return the unknowns of a mesh of quadratic tets; a mixed one has pressures at its vertices."""
    nodes, vertices = (a * cells + b * cells ** (2.0 / 3.0) for a, b in (_NODES_PER_TET, _VERTICES_PER_TET))
    return float(3.0 * nodes + vertices * mixed)


def factor_mb(dofs: float, dim: int) -> float:
    """Return the memory of a factorised stiffness; a million unknowns of a solid took 19.8 GB."""
    return float(1.19e-3 * dofs**1.2 if dim == 3 else 2.5e-3 * dofs)


def mesh_gb(cells: float, dim: int) -> float:
    """Return the memory of the factorised stiffness of a mesh, GB."""
    return 1e-3 * factor_mb(tet_unknowns(cells, False) if dim == 3 else _DOFS_PER_TRIANGLE * cells, dim)


def rows_gb(rows: float) -> float:
    """Return the memory of the dense compliance of condensed rows and its copies, GB."""
    return 40e-9 * rows**2
