# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Processes of a benchmark, and the processor time that they take."""

import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from stickslip_ros.process.children import bound_to_parent
from stickslip_ros.testing import reserve_domain

ROOT = Path(__file__).resolve().parent.parent.parent
END_TIMEOUT_S = 30.0
ANSWER = 'answer: '

_lanes = itertools.count()


class Lane:
    """A domain and a namespace of its own, so that programs do not hear one another."""

    def __init__(self) -> None:
        number = next(_lanes)
        self._held = reserve_domain()  # until nothing refers to the lane
        self.domain = self._held.__enter__()
        self.namespace = f'/bench_{os.getpid()}_{number}'

    @property
    def ros_arguments(self) -> list[str]:
        """Words that put a node into the namespace, and keep its log out of files."""
        return ['--ros-args', '--disable-external-lib-logs', '-r', f'__ns:={self.namespace}']


class Process:
    """A Python process with these words, whose nodes live in a lane; it talks to no other host."""

    def __init__(self, words: Sequence[str], lane: Lane) -> None:
        self._errors = tempfile.TemporaryFile('w+', encoding='utf-8')  # noqa: SIM115 - close()
        self._process = subprocess.Popen(
            bound_to_parent([sys.executable, *words]),
            cwd=ROOT,
            env=os.environ
            | {
                'ROS_DOMAIN_ID': str(lane.domain),
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
                'ROS_LOG_DIR': str(Path(tempfile.gettempdir(), 'stickslip_benchmarks')),
            },
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )

    def cpu_s(self) -> float:
        """Return the processor time of all its threads so far, user and system, s."""
        return time.clock_gettime(cpu_clock_of(self._process.pid))

    def fail(self, what: str) -> RuntimeError:
        """Return an error with what the process said last."""
        self._errors.seek(0)
        said = self._errors.read()[-2000:]
        return RuntimeError(f'{what} ({self._process.args!r}):\n{said}')

    def end(self) -> None:
        """Ask the process to end."""
        self._process.send_signal(signal.SIGTERM)

    def close(self) -> None:
        """End the process, and wait for it."""
        self.end()
        try:
            self._process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(BrokenPipeError):
                pipe.close()
        self._errors.close()


class Helper(Process):
    """A process that answers questions: a line of JSON in, a marked line of JSON out."""

    def ask(self, do: str, **arguments: Any) -> Any:
        """Ask for something and wait for the answer."""
        pipes = self._process.stdin, self._process.stdout
        assert pipes[0] is not None
        assert pipes[1] is not None
        with suppress(BrokenPipeError):
            pipes[0].write(json.dumps({'do': do, **arguments}) + '\n')
            pipes[0].flush()
        for line in pipes[1]:
            if line.startswith(ANSWER):
                return json.loads(line.removeprefix(ANSWER))
            sys.stderr.write(line)  # a library has something to say
        raise self.fail(f'no answer to {do}')

    def end(self) -> None:
        """End the questions."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.close()


def serve(served: object) -> None:
    """Answer the questions of a `Helper`, by methods of an object, until nobody asks any more."""
    for line in sys.stdin:
        question = json.loads(line)
        answer = getattr(served, question.pop('do'))(**question)
        sys.stdout.write(f'{ANSWER}{json.dumps(answer)}\n')
        sys.stdout.flush()


def cpu_clock_of(pid: int) -> int:
    """Return the number of the processor-time clock of a process, as clock_getcpuclockid does."""
    return (~pid << 3) | 2
