"""Child process of a sweep: what it prints does not disturb its results, and it ends with its input."""

from __future__ import annotations

import io
import pickle
import subprocess
import sys

from finger3d._process import child_environment


def test_it_answers_every_batch_and_ends_with_its_input() -> None:
    command = [sys.executable, "-P", "-m", "finger3d.analyses.sweep._child", str(subprocess.os.getpid())]
    given = pickle.dumps((None, [], 1)) + pickle.dumps((None, [], 1))
    done = subprocess.run(command, env=child_environment(), input=given, capture_output=True, timeout=60)
    assert done.returncode == 0
    answers = io.BytesIO(done.stdout)
    for _ in range(2):
        rows, reason = pickle.load(answers)
        assert rows == []
        assert reason.startswith("AttributeError")  # nothing is no body
    assert answers.read() == b""
