"""Command ``validate``, which has left the package."""

from __future__ import annotations

import pytest

from finger3d import cli


def test_the_package_says_where_the_studies_are(capsys: pytest.CaptureFixture) -> None:
    assert cli.main(["validate", "patch_test"]) == 2
    assert "python -m validation" in capsys.readouterr().err
