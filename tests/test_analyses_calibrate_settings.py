"""Settings of a calibration."""

from __future__ import annotations

from finger3d.analyses.calibrate.settings import parsed_mus


def test_values_of_mu_are_spread_evenly() -> None:
    assert parsed_mus("0.02:1.2:25")[0::24] == (0.02, 1.2)
    assert len(parsed_mus("0.02:1.2:25")) == 25
    assert parsed_mus("0.1, 0.5") == (0.1, 0.5)
