"""Verdict on the paper's claims: one table that is made from the rows of the studies."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ._rows import Row

STRESS, STRAIN, WIDE, LARGE = "plane stress", "plane strain", "20 mm wide", "20 mm wide, large deformation"
COLUMNS = (STRESS, STRAIN, WIDE, LARGE)
HOLDS, PARTLY, FAILS = "holds", "holds partly", "fails"


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and the rows that judge it.

    Attributes
    ----------
    text, where : what the paper says, and its figure or section
    measure : the number of the cells, and its bound
    rows : for every column that is judged, a study and a pattern that finds its rows by what they measure
    """

    text: str
    where: str
    measure: str
    rows: Mapping[str, tuple[str, str]]

    def found(self, column: str, kept: Mapping[str, Sequence[Row]]) -> list[Row]:
        """Return the rows that judge the claim in a column; none where it is not judged."""
        study, pattern = self.rows.get(column, ("", ""))
        return [row for row in kept.get(study, ()) if re.search(pattern, row.what)]


def verdict(rows: Sequence[Row]) -> str:
    """Return whether all, some or none of the rows hold."""
    held = sum(row.within for row in rows)
    return HOLDS if held == len(rows) else PARTLY if held else FAILS


def _both(study: str, what: str, nus: str = "0.4[359]|0.49") -> dict[str, tuple[str, str]]:
    """Rows of both plane states in one study; Poisson's ratios of a nearly incompressible finger in plane strain."""
    return {STRESS: (study, f"^{what}.*plane stress"), STRAIN: (study, f"^{what}.*plane strain, nu = ({nus})")}


def _wide(what: str, study: str = "wide_finger_claims") -> dict[str, tuple[str, str]]:
    """Rows of the finger 20 mm wide in one study, in small strain and at large deformation."""
    return {WIDE: (study, f"^{what}.*20 mm wide(?!, large)"), LARGE: (study, f"^{what}.*{LARGE}")}


def _everywhere(study: str, what: str) -> dict[str, tuple[str, str]]:
    """Rows of the study of a figure, and of the same statement in the finger 20 mm wide."""
    return {**_both(study, what), **_wide(what)}


CLAIMS = (
    Claim(
        "The results need no Poisson's ratio", "gives none", "force at nu = 0.49 over that at 0.3: 1 ± 0.1",
        {
            STRESS: ("fig02_deformation", "^nu need not be told: force.*plane stress"),
            STRAIN: ("fig02_deformation", "^nu need not be told: force.*plane strain"),
            **_wide("nu need not be told"),
        },
    ),
    Claim(
        "An increment of 0.1 mm, ten in all, is small enough", "Sec. II-A",
        "change of the sum of the friction forces by more increments: at most 0.02",
        {
            STRESS: ("increment_size", r"sum of \|f_t\|.*plane stress"),
            STRAIN: ("increment_size", r"sum of \|f_t\|.*plane strain, nu = 0.49"),
            **_wide("ten increments"),
        },
    ),
    Claim(
        "The contact condition found is unique", "Sec. II-A", "other solutions found from many starts: 0",
        {
            column: ("uniqueness_search", f"^other solutions.*mu up to 1, {column}$")
            for column in (STRESS, STRAIN, WIDE)
        },
    ),
    Claim(
        "The normal force is always semi-circular", "Fig. 3",
        "largest distance from a half ellipse over its peak: at most 0.05", _everywhere("fig03_forces", "f_n is semi"),
    ),
    Claim(
        "Friction has one minimum and one maximum", "Fig. 3", "extrema at full depth: 2",
        _everywhere("fig03_forces", "f_t has one"),
    ),
    Claim(
        "Both edges slip and the middle sticks", "Fig. 4", "1 if so",
        _everywhere("fig04_zones", "stick in the middle"),
    ),
    Claim(
        "The slip zones grow with the depth", "Sec. II-B", "growth of the share that slips from a fifth of the depth: "
        "more than 0", _everywhere("fig04_zones", "slip zones grow in their share"),
    ),
    Claim(
        "With depth the shear strain changes, the normal strains do not noticeably", "Fig. 5",
        "change over that of the shear, absolute and of the normalised profile: at most 0.25",
        _everywhere("fig05_strains_depth", "eps_"),
    ),
    Claim(
        "The normal force hardly depends on mu", "Fig. 6", "force at mu = 1 over that at 0.06: 1 ± 0.1",
        _everywhere("fig06_forces_mu", "f_n does not"),
    ),
    Claim(
        "More friction means more tangential force", "Fig. 6",
        "sum of the friction forces at mu = 1 over that at 0.25: at least 1.1",
        _everywhere("fig06_forces_mu", "f_t is large"),
    ),
    Claim(
        "More friction means less slip", "Fig. 6", "slip zone at mu = 1 over that at 0.06: at most 0.5",
        _everywhere("fig06_forces_mu", "the slip zone is small"),
    ),
    Claim(
        "The shear strain tells mu", "Fig. 7", "its largest change over its largest value: at least 0.05",
        _everywhere("fig07_strains_mu", "gamma_xy changes with mu"),
    ),
    Claim(
        "It does so better than the strain along x at the centre", "Fig. 7", "change of that strain over the largest "
        "of the shear: at most 1", _everywhere("fig07_strains_mu", "gamma_xy changes more.*: change"),
    ),
    Claim(
        "It does so near the edge of the contact", "Fig. 7", "place of its largest change over the half-width: at "
        "least 0.5", _everywhere("fig07_strains_mu", "gamma_xy changes most"),
    ),
    Claim(
        "A kinetic coefficient of half the static one changes little", "Fig. 8",
        "change of the shear over its largest value: at most 0.05",
        {**_both("fig08_kinetic", "ratios .7 and .5"), **_wide("ratio .5 changes")},
    ),
    Claim(
        "So the static coefficient can be estimated all the same", "Sec. II-B",
        "that change over the one by mu = 0.06 to 1: at most 0.1",
        {**_both("fig08_kinetic", "mu can be told"), **_wide("mu can be told")},
    ),
    Claim(
        "A plane model is enough for the design", "Sec. III-A",
        "change of the gauge's strain with mu over that in plane strain: at least 0.5",
        {WIDE: ("fig9_in_3d", "gauge at 30 degrees changes with mu as")},
    ),
    Claim(
        "The contact of the finger of Fig. 9 is about 79 mm wide", "Fig. 10", "mm as deformed: 79, and 1 more or less",
        {**_both("fig10_deformation", "contact about 79 mm wide: as deformed"), **_wide("contact about 79")},
    ),
    Claim(
        "Its shear strain changes more than that of the half cylinder", "Fig. 11", "ratio of the largest changes in "
        "one plane state: at least 1",
        {
            STRESS: ("fig11_shear_mu", "^larger change.*plane stress against plane stress"),
            STRAIN: ("fig11_shear_mu", "^the geometry does it.*nu = 0.4"),
        },
    ),
    Claim(
        "It changes at large mu, too, at x = 36 mm", "Fig. 11",
        "change from mu = 0.5 to 1 over that from 0.06: at least 0.1",
        {STRAIN: ("fig11_shear_mu", "^gamma_xy at x = 36.*nu = 0.4"), **_wide("gamma_xy at x = 36")},
    ),
    Claim(
        "This is because the edge slips easily", "Sec. III-B", "slip zone at mu = 1 over the half-width: at least 0.02",
        {STRAIN: ("fig11_shear_mu", "^the edge slips.*nu = 0.4"), **_wide("the edge slips")},
    ),
    Claim(
        "A gauge at 30 degrees is the most linear", "Fig. 12",
        "its bend over the smallest of 15, 30, 45 and 60 degrees: at most 1.1",
        _everywhere("fig12_gauge_angles", "30 degrees is the most linear"),
    ),
    Claim(
        "Its strain falls as mu grows", "Figs. 12, 14", "rising steps over all movement: at most 0.05",
        _everywhere("fig12_gauge_angles", "strain at 30 degrees falls"),
    ),
    Claim(
        "R = 100, H = 36.6 mm is the most sensitive geometry", "Sec. III-B",
        "its sensitivity over that of the best: at least 0.9",
        {
            STRAIN: ("design_search", r"^R = 100.*plane strain.*over the best, R"),
            WIDE: ("design_search", r"^R = 100.*20 mm wide.*over the best, R"),
        },
    ),
    Claim(
        "x = 36 mm and 30 degrees is the most sensitive gauge", "Sec. III-B",
        "its sensitivity over that of the best: at least 0.9",
        {
            STRAIN: ("design_search", "^x = 36 mm, 30 degrees is.*plane strain"),
            WIDE: ("design_search", "^x = 36 mm, 30 degrees is.*20 mm wide"),
        },
    ),
    Claim(
        "It measures mu up to 0.5 with 0.1", "Sec. IV", "error of mu = 0.5 by a noise of 1.5e-4, free strain and foil: "
        "at most 0.1",
        {
            STRAIN: ("fig14_measured", "^error of mu at .5.*plane strain$"),
            **_wide("error of mu at .5", "fig14_measured"),
        },
    ),
    Claim(
        "A second-order equation approximates the strain", "Fig. 14", "largest distance from it over the change of "
        "the strain: at most 0.05",
        {
            STRAIN: ("fig14_measured", "^a second-order equation.*plane strain$"),
            **_wide("a second-order equation", "fig14_measured"),
        },
    ),
    Claim(
        "A slow press avoids the effect of viscosity", "Sec. IV", "error of mu = 0.25 by a press of 100 s: at most 0.1",
        {column: ("speed_of_a_press", f"^error of mu = .25 read in 100 s.*{column}$") for column in (STRAIN, WIDE)},
    ),
    Claim(
        "The method is applicable to smaller sensors", "Sec. V", "standard deviation of mu = 0.25, R = 5, width 6 mm: "
        "at most 0.1",
        {
            WIDE: ("small_fingers", "^standard deviation of mu = 0.25,.*small strain, R = 5 mm"),
            LARGE: ("small_fingers", "^standard deviation of mu = 0.25,.*large deformation, R = 5 mm"),
        },
    ),
)  # fmt: skip


def lines(kept: Mapping[str, Sequence[Row]], figures: str) -> list[str]:
    """Return the table in Markdown, with a link to the figure of its study in each cell; `figures` is their folder."""
    out = [
        "| the paper's claim | measured by | " + " | ".join(COLUMNS) + " |",
        "|---|---" + "|---" * len(COLUMNS) + "|",
    ]
    for claim in CLAIMS:
        cells = [_cell(claim, column, kept, figures) for column in COLUMNS]
        out.append("| " + " | ".join((f"{claim.text} ({claim.where})", claim.measure, *cells)) + " |")
    return out


def _cell(claim: Claim, column: str, kept: Mapping[str, Sequence[Row]], figures: str) -> str:
    rows = claim.found(column, kept)
    if not rows:
        return "–"
    study = claim.rows[column][0]
    return f"**{verdict(rows)}**: [{_numbers(rows)}]({figures}/{study}.png)"


def _numbers(rows: Sequence[Row]) -> str:
    """Return the number of a cell, or the range of several; that of a ratio is relative to what is wanted."""
    values = sorted(row.got / row.wanted if row.measure == "relative" else row.got for row in rows)
    low, high = (f"{value:.2g}" if abs(value) < 1.0 else f"{value:.3g}" for value in (values[0], values[-1]))
    return low if low == high else f"{low} to {high}"


def summary(kept: Mapping[str, Sequence[Row]]) -> str:
    """Return a sentence with the numbers of claims that hold, hold partly and fail in every column."""
    parts = []
    for column in COLUMNS:
        told = [verdict(rows) for claim in CLAIMS if (rows := claim.found(column, kept))]
        numbers = ", ".join(str(told.count(state)) for state in (HOLDS, PARTLY, FAILS))
        parts.append(f"{column} {numbers}")
    return f"Claims that hold, hold partly and fail: {'; '.join(parts)}."
