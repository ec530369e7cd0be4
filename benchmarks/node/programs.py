"""The programs that are compared: the drive and bare loops, each with a listener of its own."""

import shutil
import subprocess
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from benchmarks.node.lateness import Window, windows_of_diagnostics
from benchmarks.node.process import Helper, Lane, Process

MOVE = (300.0, 50.0, 0.0)
"""The saw-tooth that a moving drive performs: V, Hz, steps (0: until it is stopped)."""
UNTUNED = """
import sys
from unittest.mock import patch
from rclpy.lifecycle import ManagedEntity
from stickslip_ros.process.signals import run
from stickslip_ros.ros import executable, node
with (
    patch.object(executable, 'wake_in_time'),
    patch.object(executable.gc, 'freeze'),
    patch.object(node, 'GarbageFreezer', ManagedEntity),
):
    sys.exit(run('drive', node.main, is_node=True))
"""
"""The executable without what lets it wake up in time; a name that has moved since is an error."""
CONFIGURE, ACTIVATE, DEACTIVATE = 1, 3, 4
"""Numbers of lifecycle_msgs/Transition."""


@dataclass(frozen=True)
class Turn:
    """
    What one turn of a program came to.

    Attributes
    ----------
    cpu : float
        Processor seconds of its process per second.
    windows : list of Window
        Lateness of its ticks.
    heard : dict
        The listener's report.

    """

    cpu: float
    windows: list[Window]
    heard: dict[str, Any]


class Program(ABC):
    """A process that publishes readings, between ``start`` and ``stop``."""

    lane: Lane
    process: Process
    listener: Helper

    def __init__(self, name: str) -> None:
        self.name = name
        self.lane = Lane()

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
    """
    The node, as its executable; parameters are given by name.

    It moves from its first start on if ``moves``; it asks for timely wake-ups if ``tuned``;
    ``before`` is what its command begins with, such as ``chrt``.

    """

    def __init__(
        self,
        name: str,
        parameters: Mapping[str, object] | None = None,
        *,
        moves: bool = True,
        tuned: bool = True,
        before: Sequence[str] = (),
    ) -> None:
        super().__init__(name)
        self._moves = moves
        words = ['-p', 'autostart:=false']
        for parameter, value in (parameters or {}).items():
            words += ['-p', f'{parameter}:={value}']
        program = ['-m', 'stickslip_ros.ros.node'] if tuned else ['-c', UNTUNED]
        main = [*program, *self.lane.ros_arguments, *words]
        self.process = Process(main, self.lane, before)
        self.listener = listener_in(self.lane)

    def wait(self) -> None:
        """Configure the drive, which loads its kernels."""
        self._change_state(CONFIGURE)
        self.listener.ask('wait_for_publishers')

    def start(self) -> None:
        """Activate the drive."""
        self.listener.ask('reset')
        self._change_state(ACTIVATE)
        if self._moves:
            self.listener.ask('move', values=MOVE)
            self._moves = False

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
        self.listener = listener_in(self.lane)
        self._is_silent = 'none' in options

    def wait(self) -> None:
        """Wait until the listener knows the loop."""
        if not self._is_silent:
            self.listener.ask('wait_for_publishers')

    def start(self) -> None:
        """Start the loop."""
        self.process.ask('start')

    def stop(self) -> None:
        """Stop the loop."""
        self.process.ask('stop')

    def reset(self) -> None:
        """Begin to count anew; nothing is heard of a loop that is silent."""
        if not self._is_silent:
            super().reset()
        self.process.ask('windows')

    def windows(self) -> list[Window]:
        """Return what the loop noted."""
        windows: list[Window] = self.process.ask('windows')
        return windows


def listener_in(lane: Lane) -> Helper:
    """Start a listener."""
    return Helper(['-m', 'benchmarks.node.listener', *lane.ros_arguments], lane)


def may_begin_with(words: Sequence[str]) -> bool:
    """Return whether commands may begin with these words; ``chrt --fifo`` needs a privilege."""
    if shutil.which(words[0]) is None:
        return False
    return not subprocess.run([*words, 'true'], capture_output=True, check=False).returncode


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


def in_turn(
    programs: Sequence[Program], rounds: int, settle_s: float, turn_s: float
) -> list[list[Turn]]:
    """Run programs in turn, A B A B ...; return the turns of each."""
    turns: list[list[Turn]] = [[] for _ in programs]
    for _ in range(rounds):
        for program, its in zip(programs, turns, strict=True):
            its.append(program.turn(settle_s, turn_s))
    return turns
