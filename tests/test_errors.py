"""Errors and outcomes: exit codes, and how a lack of memory is recognised."""

from __future__ import annotations

import pytest

from finger3d import cli
from finger3d.errors import OUT_OF_MEMORY, out_of_memory


@pytest.mark.parametrize(
    ("error", "memory"),
    [
        (MemoryError("Unable to allocate 6 GiB"), True), (OSError(12, "Cannot allocate memory"), True),
        (RuntimeError("can't start new thread"), True), (ImportError("x.so: failed to map segment"), True),
        (OSError(2, "No such file"), False), (RuntimeError("other"), False),
        (ValueError("cannot allocate memory"), False),
    ],
)  # fmt: skip
def test_what_says_that_memory_ran_out(error: BaseException, memory: bool, monkeypatch, capsys) -> None:
    assert out_of_memory(error) is memory

    def fails(*args: object, **kwargs: object) -> int:
        raise error

    monkeypatch.setattr(cli, "app", fails)
    if memory:
        assert cli.main(["info"]) == 3
        assert capsys.readouterr().err == f"finger3d: {OUT_OF_MEMORY}\n"
    else:
        with pytest.raises(type(error)):
            cli.main(["info"])
