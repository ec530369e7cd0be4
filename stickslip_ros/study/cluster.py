"""Cases on the workers of a Dask cluster, an optional dependency."""

import asyncio
import importlib
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from typing import Any

import stickslip_ros
from stickslip_ros.errors import StickSlipError
from stickslip_ros.study.extras import load_extra

CONNECT_S = 10.0
"""Time that a scheduler has to answer, s."""
WORKERS_S = 10.0
"""Time that it has to get its first worker, s."""


class ClusterError(StickSlipError):
    """
    A cluster cannot be used.

    Parameters
    ----------
    address : str
        Its scheduler.
    problem : str
        What is wrong with it.
    mend : str
        What the user can do about it.

    """

    def __init__(self, address: str, problem: str, mend: str) -> None:
        super().__init__(f'scheduler {address}: {problem}; {mend}')
        self.address = address


@contextmanager
def cluster_executor(address: str) -> Iterator[Executor]:
    """
    Give an executor whose tasks run on a Dask cluster.

    Parameters
    ----------
    address : str
        Address of the scheduler, such as ``tcp://192.0.2.1:8786``.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    ClusterError
        If the scheduler does not answer, has no workers, or its workers another version; later,
        if it goes away.

    """
    distributed = load_extra('a Dask scheduler', 'distributed')
    client = _connect(distributed, address)
    again = 'start it again, then the same command: what is done is kept'
    try:
        _check_workers(client, address)
        yield client.get_executor(pure=False)
    except CancelledError:
        raise ClusterError(address, 'went away', again) from None
    except distributed.KilledWorker:
        raise ClusterError(address, 'its workers died', again) from None
    finally:
        client.close()


def _connect(distributed: Any, address: str) -> Any:
    async def knock() -> None:
        comm = await distributed.comm.connect(address, timeout=CONNECT_S)
        await comm.close()

    try:
        # A client that fails leaves half of itself behind, so the first word is without one.
        asyncio.run(knock())
        return distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        mend = 'check the address, or start one with: dask scheduler'
        raise ClusterError(address, f'does not answer ({reason})', mend) from None


def _check_workers(client: Any, address: str) -> None:
    """Refuse a cluster without workers, or with another version of the package."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except (TimeoutError, asyncio.TimeoutError):
        mend = f'start some with: dask worker {address}'
        raise ClusterError(address, f'has no worker after {WORKERS_S:g} s', mend) from None
    name, ours = stickslip_ros.__name__, stickslip_ros.__version__

    def version() -> str:
        # A nested function is sent as a whole, so it arrives where the package is missing too.
        try:
            return str(importlib.import_module(name).__version__)
        except ImportError:
            return 'none'

    versions = {client.run_on_scheduler(version), *client.run(version).values()}
    if versions != {ours}:
        others = ', '.join(sorted(versions - {ours}))
        problem = f'scheduler and workers need {name} {ours}, some have {others}'
        raise ClusterError(address, problem, 'install it on all of them')
