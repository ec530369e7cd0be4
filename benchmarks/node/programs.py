# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The programs that are compared: the drive and bare loops, each with a listener of its own."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from typing import Any, NamedTuple

from benchmarks.node.lateness import Window, windows_of_diagnostics
from benchmarks.node.process import Helper, Lane, Process
from benchmarks.sizes import Sizes

MOVE = (300.0, 50.0, 0.0)
"""The saw-tooth that a moving drive performs: V, Hz, steps (0: until it is stopped)."""
CONFIGURE, ACTIVATE, DEACTIVATE = 1, 3, 4
"""Numbers of lifecycle_msgs/Transition."""


class Turn(NamedTuple):
    """What one turn of a program came to."""

    cpu: float  # processor seconds of its process per second
    windows: list[Window]  # lateness of its ticks
    heard: dict[str, Any]  # the listener's report


class Program(ABC):
    """A process that publishes readings, between ``start`` and ``stop``."""

    process: Process

    def __init__(self, name: str) -> None:
        self.name = name
        self.lane = Lane()
        self.listener = Helper(
            ['-m', 'benchmarks.node.listener', *self.lane.ros_arguments], self.lane
        )

    @abstractmethod
    def wait(self) -> None:
        """Wait until the process is ready to start."""

    @abstractmethod
    def start(self) -> None:
        """Begin to publish."""

    @abstractmethod
    def stop(self) -> None:
        """Publish no more."""

    @abstractmethod
    def windows(self) -> list[Window]:
        """Return the lateness of the ticks since the last reset; a bare loop forgets it."""

    def reset(self) -> None:
        """Begin to count anew, after a first position."""
        self.listener.ask('wait_for_position')
        self.listener.ask('reset')

    def turn(self, settle_s: float, seconds: float) -> Turn:
        """Run for some seconds and return what came of it, without the beginning."""
        self.start()
        time.sleep(settle_s)
        self.reset()
        begin_s, cpu_s = time.monotonic(), self.process.cpu_s()
        time.sleep(seconds)
        cpu = (self.process.cpu_s() - cpu_s) / (time.monotonic() - begin_s)
        heard = self.listener.ask('report')
        windows = self.windows()
        self.stop()
        return Turn(cpu, windows, heard)

    def end(self) -> None:
        """Ask both processes to end."""
        self.process.end()
        self.listener.end()

    def close(self) -> None:
        """End both processes, and wait for them."""
        self.process.close()
        self.listener.close()


class Drive(Program):
    """The node, as its executable, with parameters by name; it moves from its first start on."""

    def __init__(self, name: str, parameters: Mapping[str, object] | None = None) -> None:
        super().__init__(name)
        self._moves = False
        words = ['-m', 'stickslip_ros.ros.node', *self.lane.ros_arguments]
        for parameter, value in {'autostart': 'false', **(parameters or {})}.items():
            words += ['-p', f'{parameter}:={value}']
        self.process = Process(words, self.lane)

    def wait(self) -> None:
        """Configure the drive, which loads its kernels."""
        self._change_state(CONFIGURE)
        self.listener.ask('wait_for_publishers')

    def start(self) -> None:
        """Activate the drive."""
        self.listener.ask('reset')
        self._change_state(ACTIVATE)
        if not self._moves:
            self.listener.ask('move', values=MOVE)
            self._moves = True

    def reset(self) -> None:
        """Begin to count anew, after a first report."""
        self.listener.ask('wait_for_ticks')
        super().reset()

    def stop(self) -> None:
        """Deactivate the drive."""
        self._change_state(DEACTIVATE)

    def windows(self) -> list[Window]:
        """Return what the diagnostics said."""
        told = self.listener.ask('report')['diagnostics']
        return windows_of_diagnostics(told.get('time', []))

    def _change_state(self, transition: int) -> None:
        if not self.listener.ask('change_state', transition=transition):
            raise self.process.fail(f'the drive refused transition {transition}')


class BareLoop(Program):
    """A bare loop, as `benchmarks.node.bare_loop` describes it."""

    process: Helper

    def __init__(self, name: str, *options: str) -> None:
        super().__init__(name)
        words = ['-m', 'benchmarks.node.bare_loop', *options, *self.lane.ros_arguments]
        self.process = Helper(words, self.lane)

    def wait(self) -> None:
        """Wait until the listener knows the loop."""
        self.listener.ask('wait_for_publishers')

    def start(self) -> None:
        """Start the loop."""
        self.process.ask('start')

    def stop(self) -> None:
        """Stop the loop."""
        self.process.ask('stop')

    def reset(self) -> None:
        """Begin to count anew."""
        super().reset()
        self.process.ask('windows')

    def windows(self) -> list[Window]:
        """Return what the loop noted."""
        windows: list[Window] = self.process.ask('windows')
        return windows


def opened(stack: ExitStack, makers: Sequence[Callable[[], Program]]) -> list[Program]:
    """Start programs, which end with the stack, and wait until all are ready."""
    programs: list[Program] = []
    stack.callback(_close, programs)
    programs.extend(make() for make in makers)
    for program in programs:
        program.wait()
    return programs


def _close(programs: Sequence[Program]) -> None:
    for program in programs:
        program.end()
    for program in programs:
        program.close()


def run_in_turn(makers: Sequence[Callable[[], Program]], sizes: Sizes) -> dict[str, list[Turn]]:
    """Run programs in turn, A B A B ...; return the turns of each by its name."""
    with ExitStack() as stack:
        programs = opened(stack, makers)
        turns: dict[str, list[Turn]] = {program.name: [] for program in programs}
        for _ in range(sizes.node_rounds):
            for program in programs:
                turns[program.name].append(program.turn(sizes.settle_s, sizes.turn_s))
    return turns
