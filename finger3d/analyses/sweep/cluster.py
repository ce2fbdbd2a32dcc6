"""Where a sweep runs: worker processes of this machine, or a Dask cluster that is there already."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import metadata
from typing import Any

from finger3d._machine import cores
from finger3d._process import child_environment
from finger3d.errors import Finger3dError, MissingError

CONNECT_S = 10.0
"""Time limit to reach a scheduler, and for the first worker to be there."""

_MEMORY_SHARE = 0.9

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

# only Linux's libraries are known to bear that a process is copied which has loaded them
_METHOD = "forkserver" if sys.platform == "linux" else "spawn"

_QUIET = {
    "distributed.worker.multiprocessing-method": _METHOD,
    # Dask would have all memory given back to the system at once: a sixth of a press goes into getting it again
    "distributed.nanny.pre-spawn-environ": _ONE_THREAD,
    # what Dask logs of a lost worker is told by the sweep in its own words
    "logging.distributed": "critical",
    # it would look 50 to 1000 times a second what every worker is at, and nobody reads that
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.admin.system-monitor.disk": False,
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.tick.interval": "1s",
}


def prepare() -> None:
    """Let a process load what workers need while this one goes on; each worker is then a copy of it.

    That it cannot be started is told where a worker is.
    """
    if _METHOD != "forkserver":
        return
    from multiprocessing import forkserver, set_forkserver_preload

    # it loads this very package, and takes nothing that lies where the user is for a module
    path = child_environment()["PYTHONPATH"]
    set_forkserver_preload(["finger3d.analyses.sweep.preload"])
    with suppress(OSError), _for_us_alone(), _environment(_ONE_THREAD | {"PYTHONPATH": path, "PYTHONSAFEPATH": "1"}):
        forkserver.ensure_running()


@contextmanager
def _environment(wanted: Mapping[str, str]) -> Iterator[None]:
    """This process's environment with some names set, for what is started in the block."""
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def local(workers: int) -> Iterator[Any]:
    """Client of `workers` processes on this machine, one thread each, with their share of its memory as the limit."""
    import dask
    import distributed.utils
    from distributed import Client, LocalCluster
    from distributed.system import MEMORY_LIMIT

    prepare()
    # Dask would have it load pandas and others, and load them here as well
    distributed.utils._forkserver_preload_set = True
    with dask.config.set(_QUIET):
        try:
            with _for_us_alone():
                cluster = LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True, host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",  # None would still ask for port 8787, and warn if it is taken
                    memory_limit=int(_MEMORY_SHARE * MEMORY_LIMIT / workers), silence_logs=logging.CRITICAL,
                    env={**os.environ, **_ONE_THREAD},  # that of now: the copied process may be older
                )  # fmt: skip
        except (OSError, RuntimeError, TimeoutError) as error:
            raise MissingError(f"sweep: no worker could be started on this machine: {error}") from None
        with cluster, Client(cluster) as client:
            yield client


@contextmanager
def _for_us_alone() -> Iterator[None]:
    """Workers started here, or by threads started here, never see Ctrl-C: who started them ends them."""
    from multiprocessing import resource_tracker

    # it lifts the block where it is started, so it goes first
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def remote(address: str) -> Iterator[Any]:
    """Client of the cluster whose scheduler is at `address`, which has workers with this version of finger3d."""
    import asyncio

    from distributed import Client

    if ":" not in address.removeprefix("tcp://").removeprefix("tls://"):
        raise Finger3dError(f"--scheduler {address}: must be HOST:PORT, for instance tcp://127.0.0.1:8786")
    for name in ("distributed", "distributed.client"):  # the second has a level of its own in Dask's configuration
        logging.getLogger(name).setLevel(logging.CRITICAL)
    silent = MissingError(
        f"--scheduler {address}: no Dask scheduler answered within {CONNECT_S:g} s; start one with `dask scheduler`, "
        "or look at the address"
    )
    try:
        asyncio.run(asyncio.wait_for(_greet(address), CONNECT_S))
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except ValueError as error:
        raise Finger3dError(f"--scheduler {address}: no address: {error}") from None
    except (OSError, TimeoutError, ImportError):
        raise silent from None
    with client:
        try:
            _ready(client, address)
        except OSError:
            raise silent from None
        yield client


async def _greet(address: str) -> None:
    """Reach a scheduler and leave: a Client waits without end for one that accepts and says nothing."""
    from distributed.comm import connect

    comm = await connect(address, timeout=CONNECT_S)
    comm.abort()


def _ready(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise MissingError(
            f"--scheduler {address}: has no worker; start some with `dask worker {address} --nthreads 1`"
        ) from None
    for worker, version in client.run(version_here).items():
        if version != version_here():
            raise MissingError(
                f"--scheduler {address}: the worker {worker} has finger3d {version}; install {version_here()} there"
            )


def version_here() -> str:
    """Version of finger3d where this is called; that it can be called there says that it is installed."""
    return metadata.version("finger3d")


def default_workers(bodies: int) -> int:
    """As many as there are cores, and no more than bodies."""
    return max(1, min(cores(), bodies))
