# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Many independent runs at once, in threads or on a Dask cluster, with results in order."""

import importlib
import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple, TypeVar, cast

import stickslip_ros
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.extras import load_extra
from stickslip_ros.lab.runs.courses import Course, run_in_lanes
from stickslip_ros.lab.runs.journal import Journal
from stickslip_ros.process.stopping import Stopped, stop_if_asked

# ruff: noqa: PLC0415 - asyncio is slow to import, and needed for a cluster only

Case = TypeVar('Case')
_Result = TypeVar('_Result')
Progress = Callable[[int, int], None]
Keep = Callable[[int, Any], None]

WORKERS_MAX = 1024
SUBMITTED_MAX = 4 * WORKERS_MAX  # cases submitted at a time: enough for every worker
_LOOK_S = 0.1  # time between two checks for Ctrl-C, s
CONNECT_S = 10.0  # time limit for the answer of a scheduler, s
WORKERS_S = 10.0  # time limit without a worker, s


class Pool(NamedTuple):
    """Workers shared by many batches."""

    submit: Callable[..., Future[Any]]  # starts a call of a function with arguments
    workers: int  # number of workers
    check: Callable[[], None] = lambda: None  # raises an error of the workers


class Interrupted(Stopped):
    """A batch was stopped by Ctrl-C; ``rows`` has the finished cases by number."""

    def __init__(self, rows: dict[int, Any], total: int, journal: Journal | None) -> None:
        kept = f'; they are in {journal.path}, the same command goes on' if journal else ''
        super().__init__(f'stopped after {len(rows)} of {total} cases{kept}')
        self.rows = rows


def run_batch(
    task: Callable[[Case], _Result],
    cases: Sequence[Case],
    *,
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    pool: Pool | None = None,
    progress: Progress | None = None,
    bundle: int = 0,
) -> list[_Result]:
    """
    Run a task for every case; return the rows in order.

    Cases in the journal are skipped, others are appended to it. They run in ``workers`` threads
    (0: one per core), in a ``pool``, or on a Dask ``scheduler`` (then the task must be a function
    of a module). Finished cases are kept on Interrupted (Ctrl-C) and on StickSlipError: a refused
    case, a journal that cannot be written, MissingExtra (Dask), or ClusterError.

    """
    rows: dict[int, Any] = dict(journal.rows) if journal else {}
    show = progress or (lambda *_: None)

    def keep(index: int, row: Any) -> None:
        if index in rows:
            return
        if journal is not None:
            journal.append(index, row)
        rows[index] = row
        show(len(rows), len(cases))

    todo = [index for index in range(len(cases)) if index not in rows]
    try:
        show(len(rows), len(cases))
        if todo:
            with nullcontext(pool) if pool else pool_of(workers, scheduler) as found:
                size = max(1, min(bundle, math.ceil(len(todo) / found.workers)))
                parts = (todo[first : first + size] for first in range(0, len(todo), size))
                given = ((part, [cases[index] for index in part]) for part in parts)
                _run(found, partial(_results, task, bool(bundle)), given, keep)
    except KeyboardInterrupt:
        raise Interrupted(rows, len(cases), journal) from None
    return [rows[index] for index in range(len(cases))]


def run_courses(
    course_of: Callable[[Case], Course[_Result]], cases: Sequence[Case], bundle: int, **how: Any
) -> list[_Result]:
    """Run courses as ``run_batch`` runs tasks, a ``bundle`` at a time per worker."""
    task = cast('Callable[[Case], _Result]', course_of)
    return run_batch(task, cases, bundle=bundle, **how)


@contextmanager
def pool_of(workers: int, scheduler: str = '') -> Iterator[Pool]:
    """Return threads or a Dask cluster, as ``run_batch`` takes them, for a context."""
    if not 0 <= workers <= WORKERS_MAX:
        limit = f'not from 0 to {WORKERS_MAX}'
        raise OutOfRange('number of workers', workers, '', limit, '0 takes one per core')
    if scheduler:
        with _cluster(scheduler) as pool:
            yield pool
    else:
        cores = getattr(os, 'sched_getaffinity', lambda _: range(os.cpu_count() or 1))
        many = workers or len(cores(0))
        with ThreadPoolExecutor(many) as executor:
            yield Pool(executor.submit, many)


def _results(task: Callable[[Any], Any], in_courses: bool, cases: list[Any]) -> list[Any]:
    made = map(task, cases)
    return run_in_lanes(made) if in_courses else list(made)


def _run(
    pool: Pool,
    task: Callable[[list[Any]], list[Any]],
    todo: Iterator[tuple[list[int], list[Any]]],
    keep: Keep,
) -> None:
    """Run all parts, at most SUBMITTED_MAX at a time; keep the finished cases."""
    futures: dict[Future[Any], list[int]] = {}
    ended: SimpleQueue[Future[Any]] = SimpleQueue()

    def submit(most: int) -> None:
        for part, cases in islice(todo, most):
            future = pool.submit(task, cases)
            futures[future] = part
            future.add_done_callback(ended.put)

    def keep_all(future: Future[Any]) -> None:
        for index, row in zip(futures[future], future.result(), strict=True):
            keep(index, row)

    try:
        submit(SUBMITTED_MAX)
        while futures:
            future = None
            while future is None:
                stop_if_asked()
                try:
                    future = ended.get(timeout=_LOOK_S)
                except Empty:
                    pool.check()
            keep_all(future)
            del futures[future]
            submit(1)
    except BaseException:
        begun = [future for future in futures if not future.cancel()]
        wait(begun)
        for future in begun:
            if not future.cancelled() and future.exception() is None:
                keep_all(future)
        raise


class ClusterError(StickSlipError):
    """A Dask cluster cannot be used."""

    def __init__(self, address: str, problem: str, hint: str) -> None:
        super().__init__(f'scheduler {address}: {problem}; {hint}')


@contextmanager
def _cluster(address: str) -> Iterator[Pool]:
    import asyncio

    distributed = load_extra('a Dask scheduler', 'distributed')
    client = _connect(distributed, address)
    again = 'start it again, then the same command: what is done is kept'
    seen_s = time.monotonic()

    def check() -> None:
        nonlocal seen_s
        if client.scheduler_info()['workers']:
            seen_s = time.monotonic()
        elif time.monotonic() - seen_s > WORKERS_S:
            raise ClusterError(address, f'has had no worker for {WORKERS_S:g} s', again)

    def submit(function: Callable[..., Any], *given: Any) -> Future[Any]:
        # Dask's own executor mistakes the result of a lost worker for an exception.
        result = result_of(client.submit(function, *given, pure=False))
        return asyncio.run_coroutine_threadsafe(result, client.loop.asyncio_loop)

    async def result_of(begun: Any) -> Any:
        return await begun

    try:
        _check_workers(client, address)
        yield Pool(submit, sum(client.nthreads().values()), check)
    except CancelledError:
        raise ClusterError(address, 'went away', again) from None
    except distributed.KilledWorker:
        raise ClusterError(address, 'its workers died', again) from None
    finally:
        client.close()


def _connect(distributed: Any, address: str) -> Any:
    import asyncio

    async def knock() -> None:
        comm = await distributed.comm.connect(address, timeout=CONNECT_S)
        await comm.close()

    try:
        # A failed client is not cleaned up completely, so connect without one first.
        asyncio.run(knock())
        for _ in range(round(CONNECT_S / _LOOK_S)):
            stop_if_asked()
            with suppress(AssertionError):
                return distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
            # The scheduler still reports a batch that has just ended.
            time.sleep(_LOOK_S)
        raise ClusterError(address, 'still clears up another batch', 'try again in a minute')
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        hint = 'check the address, or start one with: dask scheduler'
        raise ClusterError(address, f'does not answer ({reason})', hint) from None


def _check_workers(client: Any, address: str) -> None:
    """Refuse a cluster without workers, or with another version of the package."""
    import asyncio

    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except (TimeoutError, asyncio.TimeoutError):
        hint = f'start some with: dask worker {address}'
        raise ClusterError(address, f'has no worker after {WORKERS_S:g} s', hint) from None
    name, ours = stickslip_ros.__name__, stickslip_ros.__version__

    def version() -> str:
        # A nested function is sent by value, so it runs without the package.
        try:
            return str(importlib.import_module(name).__version__)
        except ImportError:
            return 'none'

    versions = {client.run_on_scheduler(version), *client.run(version).values()}
    if versions != {ours}:
        others = ', '.join(sorted(versions - {ours}))
        problem = f'scheduler and workers need {name} {ours}, some have {others}'
        raise ClusterError(address, problem, 'install it on all of them')
