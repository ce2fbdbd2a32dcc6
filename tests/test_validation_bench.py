"""make bench: what it measures on a small mesh, and that a busy machine is named."""

from __future__ import annotations

import pytest

from validation import _bench as bench


def test_a_child_measures_every_stage() -> None:
    found = bench._child(6.0)
    assert set(found) == {
        "assembly", "condensation", "contact", "contact_all", "dofs", "rows", "factorisation", "mumps"
    }  # fmt: skip
    assert all(value > 0.0 for value in found.values())
    assert found["dofs"] > 10 * found["rows"]


def test_ratios_are_of_the_chain_to_the_plain_factorisation() -> None:
    best = {"assembly": 1.0, "condensation": 11.0, "contact": 2.0, "factorisation": 10.0, "dofs": 1e5, "rows": 9.0}
    chain, assembly = bench._ratios(best)
    assert (chain.got, assembly.got) == pytest.approx((1.4, 0.1))
    assert chain.verdict == "holds"


def test_a_busy_machine_is_named_in_every_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "cores", lambda: 2)
    monkeypatch.setattr(bench.os, "getloadavg", lambda: (0.5, 0.5, 0.5))
    assert "BUSY" not in bench._row("anything", 1.0, 3.0).reason
    monkeypatch.setattr(bench.os, "getloadavg", lambda: (8.0, 1.0, 1.0))
    row = bench._row("anything", 1.0, 3.0)
    assert "load 8.0 on 2 cores, BUSY" in row.reason
    assert row.passed  # told, not failed: the others' work is no fault of the code
    assert row.verdict == "does not hold"
