"""Law of the interface: a layer between the surfaces deforms in series with the bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import Coulomb
from finger3d.contact.law import ContactLaw, NormalLaw, Signorini
from finger3d.contact.rules import RULES, RuleName
from finger3d.contact.state import ContactState


@dataclass(frozen=True)
class Layer(NormalLaw):
    """Winkler layer: the gap is -k p, in a linear law."""

    mm_per_MPa: float

    def compliance(self, area: np.ndarray) -> np.ndarray:
        return self.mm_per_MPa / area


def pressed(rule: RuleName, law: NormalLaw) -> np.ndarray:
    """Force on two uncoupled points of 0.5 and 2 mm2 with a compliance of 1 mm/N, pressed by 1 mm."""
    problem = ContactProblem.of(
        ContactState.at_rest(np.zeros(2), 2),
        np.array([[-1.0, 0.0], [-1.0, 0.0]]),
        np.eye(4).reshape(2, 2, 2, 2),
        ContactLaw(Coulomb(0.5), law),
        1.0,
        area=np.array([0.5, 2.0]),
    )
    found = RULES[rule](problem)
    assert found.outcome.ok
    assert found.residual <= 1e-12
    return found.state.force[:, 0]


@pytest.mark.parametrize("rule", RULES)
def test_a_layer_acts_in_series_with_the_body(rule: RuleName) -> None:
    # springs in series: 1 mm over 1 mm/N of the body and k / A of the layer
    np.testing.assert_allclose(pressed(rule, Layer(0.5)), [1.0 / (1.0 + 1.0), 1.0 / (1.0 + 0.25)], rtol=1e-12)


def test_bare_surfaces_add_no_compliance() -> None:
    np.testing.assert_allclose(pressed("projection", Signorini()), [1.0, 1.0], rtol=1e-12)
