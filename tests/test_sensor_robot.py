"""Estimates on a robot: with NumPy alone, as monotone as SciPy's, and from readings that are still being written."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from finger3d.sensor import save
from tests.sensor_cases import curve, line, straight, together

NUMPY_ONLY = """
import importlib.abc, sys
class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        top = name.partition(".")[0]
        if top not in sys.stdlib_module_names and top not in ("numpy", "finger3d"):
            raise ImportError(f"{name} is not on the robot")
sys.meta_path.insert(0, Refuse())
import finger3d
print(finger3d.estimate(sys.argv[1], [float(sys.argv[2])])[0].mu)
"""


def test_an_estimate_needs_no_library_but_numpy(tmp_path: Path) -> None:
    kept = save(curve(straight), tmp_path / "calibration.json")
    said = subprocess.run(
        [sys.executable, "-c", NUMPY_ONLY, str(kept), repr(straight(0.3))], capture_output=True, text=True, check=True
    )
    assert float(said.stdout) == pytest.approx(0.3, abs=2e-3)


def test_several_readings_need_no_library_but_numpy(tmp_path: Path) -> None:
    joint = together(curve(straight), curve(line(0.01)))
    kept = save(joint, tmp_path / "calibration.json")
    code = NUMPY_ONLY.replace("[float(sys.argv[2])]", "dict(zip('ab', map(float, sys.argv[2:])))")
    readings = [repr(float(v)) for v in joint.at([0.3])[0]]
    said = subprocess.run(
        [sys.executable, "-c", code, str(kept), *readings], capture_output=True, text=True, check=True
    )
    assert float(said.stdout) == pytest.approx(0.3, abs=1e-3)


def test_the_ros_node_publishes_what_estimate_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ROS is not installed here: a stand-in for it records what the node publishes and logs."""
    published, logged = [], []

    class Node:
        def __init__(self, name: str) -> None:
            self.name = name

        def declare_parameter(self, name: str, default: str) -> SimpleNamespace:
            return SimpleNamespace(value=str(tmp_path / default))

        def create_publisher(self, kind: type, topic: str, depth: int) -> SimpleNamespace:
            return SimpleNamespace(publish=lambda message: published.append(message.data))

        def create_subscription(self, kind: type, topic: str, call: object, depth: int) -> None:
            assert topic == "strain"

        def get_logger(self) -> SimpleNamespace:
            return SimpleNamespace(warning=logged.append)

    messages = ModuleType("std_msgs.msg")
    messages.Float64 = messages.Float64MultiArray = SimpleNamespace
    node = ModuleType("rclpy.node")
    node.Node = Node
    for name, module in {"rclpy": ModuleType("rclpy"), "rclpy.node": node, "std_msgs": ModuleType("std_msgs"),
                         "std_msgs.msg": messages}.items():  # fmt: skip
        monkeypatch.setitem(sys.modules, name, module)
    save(curve(straight), tmp_path / "calibration.json")
    own = runpy.run_path(str(Path(__file__).parents[1] / "docs" / "friction_node.py"))["FrictionNode"]()
    own.on_strain(SimpleNamespace(data=straight(0.3)))
    own.on_strain(SimpleNamespace(data=0.2))
    assert published[0][0] == pytest.approx(0.3, abs=2e-3)
    assert published[0][2] < 0.3 < published[0][3]
    assert len(published) == len(logged) == 1
    assert logged[0].startswith("out of range")
