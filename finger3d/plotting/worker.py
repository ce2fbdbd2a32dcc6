"""Pictures beside the computation: a child process loads matplotlib while the model is solved, and draws then.

``python -m finger3d.plotting.worker`` is the child: it calls what it is sent on its standard input; nothing else calls
it.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from io import BytesIO
from threading import Thread
from typing import Any, Self

from finger3d._process import child_environment

_PATIENCE_S = 20.0  # for pictures that were begun when the user interrupted


class PlotWorker:
    """Calls functions that draw, in a child process unless matplotlib is loaded in this one already.

    A child that fails costs time, but no picture: the calls are then made here, where an error says what is wrong.

    Parameters
    ----------
    wanted : whether anything will be drawn
    module : where the functions are that will; the child loads it meanwhile
    formulae : whether it also gets ready to set formulae, which the ticks of logarithmic axes are
    """

    def __init__(self, wanted: bool = True, module: str = "finger3d.plotting.figures", formulae: bool = True) -> None:
        self._wanted = wanted
        self._words = [module, *["formulae"] * formulae]
        self._calls: list[partial[Any]] = []
        self._child: subprocess.Popen[bytes] | None = None
        self._sender: Thread | None = None

    def __enter__(self) -> Self:
        if self._wanted and "matplotlib" not in sys.modules:
            # a group of its own: Ctrl-C is for the parent, which lets begun pictures be finished
            self._child = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, *self._words], env=child_environment(), process_group=0,
                stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is None:
            return
        if not self._sender:
            self._close()
        try:
            self._child.wait(_PATIENCE_S if self._sender else 0.0)
        except subprocess.TimeoutExpired:
            self._child.kill()

    def draw(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> None:
        """Note a call of a function of some module, with arguments that can be pickled."""
        self._calls.append(partial(function, *args, **kwargs))

    def begin(self) -> None:
        """Let the child start on what was noted, while this process goes on."""
        if self._child is None or not self._calls or self._sender:
            return
        # The pipe holds less than a picture needs, and the child may be loading still: a thread waits for it.
        data = pickle.dumps(self._calls, pickle.HIGHEST_PROTOCOL)
        self._sender = Thread(target=self._close, args=(data,))
        self._sender.start()

    def finish(self) -> None:
        """Wait until all is drawn."""
        if self._child is None or not self._sender or self._child.wait() != 0:
            for call in self._calls:
                call()
        self._calls = []

    def _close(self, last: bytes = b"") -> None:
        assert self._child is not None
        stream = self._child.stdin
        assert stream is not None
        if not stream.closed:
            with suppress(BrokenPipeError), stream:  # of a child that has died: `finish` sees it, and draws here
                stream.write(last)


def _main(module: str, *words: str) -> None:
    _warm_up(module, "formulae" in words)
    sent = sys.stdin.buffer.read()
    for call in pickle.loads(sent) if sent else ():
        call()
    # All is on disk. To take down matplotlib and the rest in good order would keep the parent waiting for 0.25 s.
    os._exit(0)


def _warm_up(module: str, formulae: bool = True) -> None:
    """All that a first picture takes besides its own drawing, while the parent computes: modules, fonts, formulae."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    import_module(module)
    figure = Figure(figsize=(1.0, 1.0))
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(xlabel="x (mm)", title="x")
    draw = axes.semilogy if formulae else axes.plot  # the ticks of the first are powers, which are set as formulae
    draw([1.0, 100.0], label="x")
    axes.legend(title="x")
    figure.savefig(BytesIO(), format="png")


if __name__ == "__main__":
    _main(*sys.argv[1:])
