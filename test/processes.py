# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Processes of tests: they end with the run that started them, and no limit guesses their time."""

import ctypes
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from waiting import LOOK_S, PROGRESS_S, wait_until

from stickslip_ros.process.children import bound_to_parent

_PR_SET_PDEATHSIG = 1


def end_with_parent() -> None:
    """Have the system kill this process when the thread that has started it is gone."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def start_process(words: Sequence[object], **options: Any) -> 'subprocess.Popen[str]':
    """Start a process that is killed when this one is gone; ``options`` are those of Popen."""
    bound = bound_to_parent([*map(str, words)], 'KILL')
    return subprocess.Popen(bound, **{'text': True, **options})


def processor_ticks(pid: int) -> dict[int, int]:
    """Return the processor time that a process and its descendants have used, in clock ticks."""
    children: dict[int, list[int]] = {}
    ticks: dict[int, int] = {}
    for stat in Path('/proc').glob('[0-9]*/stat'):
        with suppress(OSError):  # it may end meanwhile
            fields = stat.read_bytes().rpartition(b')')[2].split()
            one = int(stat.parent.name)
            children.setdefault(int(fields[1]), []).append(one)
            ticks[one] = sum(map(int, fields[11:15]))
    tree = [pid]
    for one in tree:  # grows meanwhile
        tree += children.get(one, [])
    return {one: ticks.get(one, 0) for one in tree}


def is_gone(pid: int) -> bool:
    """Return whether a process has ended: of a zombie the init process has not yet heard."""
    try:
        state = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except OSError:
        return True
    return state == 'Z'


def progress_of(process: 'subprocess.Popen[Any]') -> Callable[[], int]:
    """Return a function that tells how much a process and its descendants have worked."""
    return lambda: sum(processor_ticks(process.pid).values())


def finish(process: 'subprocess.Popen[Any]') -> tuple[Any, Any]:
    """Read a process to its end, as ``communicate`` does; kill it when it no longer works."""

    def outputs() -> tuple[Any, Any] | None:
        try:
            return process.communicate(timeout=LOOK_S)
        except subprocess.TimeoutExpired:
            return None

    try:
        return wait_until(
            outputs,
            f'the end of {process.args!r}',
            progress=progress_of(process),
            pause=lambda _: None,
        )
    except TimeoutError as error:
        process.kill()
        told: tuple[Any, Any] = ('', '')
        with suppress(subprocess.TimeoutExpired):  # a child of it may hold the pipes
            told = process.communicate(timeout=PROGRESS_S)
        raise TimeoutError(f'{error}; it said {told[0]!r} and {told[1]!r}') from None


def run_process(words: Sequence[object], **options: Any) -> 'subprocess.CompletedProcess[str]':
    """
    Run a process to its end, as ``subprocess.run`` does with captured output.

    Raises
    ------
    TimeoutError
        If it no longer works and does not end.
    CalledProcessError
        If ``check`` is among the options and its status is not 0; its output goes to stderr.

    """
    check = options.pop('check', False)
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
    with start_process(words, **{**streams, **options}) as process:
        output, errors = finish(process)
    done = subprocess.CompletedProcess(process.args, process.returncode, output, errors)
    if check and done.returncode:
        sys.stderr.write(f'{output}{errors}')  # pytest shows it with the error
        done.check_returncode()
    return done
