"""Clusters for sweeps: worker processes of this machine, or an existing Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING

from finger3d._machine import cores
from finger3d.errors import Finger3dError, MissingError

if TYPE_CHECKING:
    from distributed import Client

CONNECT_S = 10.0
"""Time limit to reach a scheduler, and for the first worker to be there."""


@contextmanager
def local(workers: int) -> Iterator[Client]:
    """Yield the client of a Dask cluster of `workers` processes on this machine, with one thread each.

    Raises
    ------
    MissingError
        If no process could be started.
    """
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        try:
            with _interrupts_deferred():
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
                client = stack.enter_context(Client(stack.enter_context(cluster)))
        except (OSError, RuntimeError, TimeoutError) as error:
            raise MissingError(f"sweep: no worker could be started on this machine: {error}") from None
        yield client


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Deliver Ctrl-C after the block, and never to processes and threads that the block starts.

    A terminal sends it to every process; this one stops the workers.
    """
    resource_tracker.ensure_running()  # which would unblock the signal when it is started
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def remote(address: str) -> Iterator[Client]:
    """Client of the cluster whose scheduler is at `address`, which has workers with this version of finger3d."""
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
    from distributed.comm.core import connect

    comm = await connect(address, timeout=CONNECT_S)
    comm.abort()


def _ready(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError:
        raise MissingError(
            f"--scheduler {address}: has no worker; start some with `dask worker {address} --nthreads 1`"
        ) from None
    here = version_here()
    for worker, there in client.run(version_here).items():
        if there != here:
            raise MissingError(f"--scheduler {address}: the worker {worker} has finger3d {there}; install {here} there")


def version_here() -> str:
    """Return the version of finger3d in the process that calls this."""
    return version("finger3d")


def default_workers(bodies: int) -> int:
    """Return the number of cores, or of bodies if these are fewer."""
    return max(1, min(cores(), bodies))
