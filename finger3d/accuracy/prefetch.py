"""The mesh of a press's companion, made beside the press, where pytetwild makes both and neither is kept yet.

``python -m finger3d.accuracy.prefetch`` is the child that does it: its mesh goes into the cache, where the error
estimate finds it.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from typing import Self

from finger3d._process import child_environment, end_with
from finger3d.accuracy.companions import companions
from finger3d.mechanics.model import Model
from finger3d.mechanics.solve import build, contact_box, symmetry
from finger3d.scene import Scene, parse, tree

_NODES = 1.55
"""Nodes of a quadratic mesh for each of its tets."""


class MeshPrefetch:
    """Meshes the companion of a scene in a child process, if that takes long and can begin at once.

    A child that fails costs time only: the estimate then makes the mesh itself, and says what is wrong.

    Parameters
    ----------
    scene : what is pressed; None: nothing is wanted
    """

    def __init__(self, scene: Scene | None) -> None:
        self._scene = scene
        self._child: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        if self._scene is None or self._scene.tables.mesh.tolerance is not None or not _takes_long(self._scene.model()):
            return self
        # a session of its own, so that all of it can be ended: pytetwild runs in a child of the child
        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__, str(os.getpid())], env=child_environment(), stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        assert self._child.stdin is not None
        with suppress(BrokenPipeError), self._child.stdin as stream:
            stream.write(pickle.dumps(tree.plain(self._scene.given)))
        return self

    def wait(self) -> None:
        """Until the mesh is there, or will not be."""
        if self._child is not None:
            self._child.wait()

    def __exit__(self, *_: object) -> None:
        if self._child is not None and self._child.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
            self._child.wait()


def _takes_long(model: Model) -> bool:
    """Whether pytetwild must make the body's mesh, and its companion's too."""
    if model.domain != "solid" or model.mesh.mesher == "swept" or model.design.section() is not None:
        return False
    from finger3d.meshing import cache
    from finger3d.meshing.sizing import rounded_zone

    zone, axes = rounded_zone(model.design, model.mesh, contact_box(model)), symmetry(model)
    return not (cache.folder() / f"{cache.key(model.design, model.mesh, zone, axes)}.npz").exists()


def _expected(model: Model) -> Model:
    """The companion that will be asked for, by the size that the mesh will have."""
    from finger3d.meshing.sizing import forecast, rounded_zone, sizing
    from finger3d.meshing.tetwild import box

    zone = rounded_zone(model.design, model.mesh, contact_box(model))
    field = sizing(model.design, model.mesh, zone, *box(model.design, symmetry(model)))
    coarse, fine = companions(model, 3.0 * _NODES * forecast(model.design, field))
    return replace(model, mesh=[*coarse, *fine][0])


if __name__ == "__main__":
    end_with(int(sys.argv[1]))
    build(_expected(parse(pickle.load(sys.stdin.buffer)).model()))
