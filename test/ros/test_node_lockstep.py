# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""In lockstep the drive goes no further than it was told, and delays change no byte."""

import random
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pytest
from mcap_records import rows_of
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from waiting import LOOK_S, wait_until

from stickslip_ros.errors import UnknownName
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.client import LockstepClient
from stickslip_ros.ros.executable import end_node

BLOCK_S = 1e-3
BLOCK_NS = 1_000_000
LOCKSTEP = {'sim.lockstep': True}
BLOCKS = 60
TARGET_M = 40e-9
GAIN_V_PER_M = 2e8
DELAY_MAX_S = 1.5e-3
"""Longest delay that a test puts between two messages, wall-clock."""


def time_ns_of(stand: Any) -> int:
    return int(stand.drive.session.bench.time_ns)


def spin_until(executor: SingleThreadedExecutor, stamps: Sequence[float], count: int) -> None:
    wait_until(
        lambda: len(stamps) >= count,
        f'{count} blocks',
        progress=lambda: len(stamps),
        pause=lambda _: executor.spin_once(timeout_sec=LOOK_S),
    )


def wait_for_time(stand: Any, time_ns: int) -> None:
    stand.operator.spin_until(lambda: time_ns_of(stand) == time_ns, f'{time_ns} ns')


def test_nothing_happens_before_the_first_grant_and_then_only_what_was_granted(start_drive):
    stand = start_drive(LOCKSTEP, wait=False)
    operator = stand.operator
    operator.wait_for_topics()
    assert operator.set_recording(wanted=True).success  # an answer, though no block was run
    assert time_ns_of(stand) == 0
    operator.command('grant', (BLOCK_S, 0))
    wait_for_time(stand, BLOCK_NS)
    operator.command('grant', (5.9 * BLOCK_S, 0))
    wait_for_time(stand, 5 * BLOCK_NS)
    operator.command('grant', (5.0 * BLOCK_S, 0))  # again, and backwards: no more
    operator.command('grant', (2.0 * BLOCK_S, 0))
    assert operator.trigger('stop').success
    assert time_ns_of(stand) == 5 * BLOCK_NS


def test_what_is_refused_is_counted_and_a_refused_command_counts_as_received(start_drive):
    stand = start_drive(LOCKSTEP, wait=False)
    operator = stand.operator
    operator.wait_for_topics()
    operator.command('grant', (-1.0, 0.0))
    operator.spin_until(lambda: stand.drive.guard.count == 1, 'the refusal')
    odd = Float64MultiArray(data=[0.0])
    odd.layout.data_offset = 1
    operator.send('waveform', odd)
    assert time_ns_of(stand) == 0
    operator.command('grant', (BLOCK_S, 1))
    wait_for_time(stand, BLOCK_NS)


def test_a_pause_holds_what_was_granted_and_a_step_needs_a_grant(start_drive: Callable):
    stand = start_drive(LOCKSTEP, wait=False)
    operator = stand.operator
    operator.wait_for_topics()
    operator.switch('set_paused', wanted=True)
    answer = operator.trigger('step_simulation')
    why = 'the next block is not granted; send command/grant first'
    assert (answer.success, answer.message) == (False, f'step_simulation refused: {why}')
    operator.command('grant', (3 * BLOCK_S, 0))
    operator.spin_until(lambda: stand.drive.session._time_control.is_granted(0), 'the grant')
    assert operator.trigger('step_simulation').success
    assert time_ns_of(stand) == BLOCK_NS
    operator.switch('set_paused', wanted=False)
    wait_for_time(stand, 3 * BLOCK_NS)


class Controller:
    """
    A proportional controller of the position, on a node of its own.

    Every block it sends a voltage and a load, in an order and after delays that its seed draws.

    """

    def __init__(self, stand: Any, blocks: int, seed: int, namespace: str = '') -> None:
        self.node = Node('controller', context=stand.context)
        self._executor = SingleThreadedExecutor(context=stand.context)
        self._executor.add_node(self.node)
        self._random = random.Random(seed)
        self._blocks = blocks
        self.stamps_ns: list[int] = []
        self.client = LockstepClient(
            self.node, BLOCK_S, self._answer, first=[('voltage', 150.0)], namespace=namespace
        )

    def _answer(self, stamp_s: float, position_m: float) -> Iterable[tuple[str, float]]:
        self.stamps_ns.append(round(stamp_s * 1e9))
        voltage_v = 150.0 + GAIN_V_PER_M * (TARGET_M - position_m)
        commands = [
            ('voltage', min(300.0, max(0.0, voltage_v))),
            ('load', 0.05 if len(self.stamps_ns) % 20 < 10 else 0.0),
        ]
        self._random.shuffle(commands)
        for command in commands:
            time.sleep(self._random.uniform(0.0, DELAY_MAX_S))
            yield command
        time.sleep(self._random.uniform(0.0, DELAY_MAX_S))

    def run(self) -> None:
        spin_until(self._executor, self.stamps_ns, self._blocks)

    def close(self) -> None:
        self.client.close()
        end_node(self._executor, self.node)


def controlled_run(start_drive: Callable, path: Path, seed: int) -> Path:
    """Record a run under control; give the file."""
    stand = start_drive(
        {**LOCKSTEP, 'record.on_start': True, 'record.name': path.name, 'trace.period': 0.01},
        wait=False,
    )
    controller = Controller(stand, BLOCKS, seed)
    controller.run()
    wait_for_time(stand, (BLOCKS + 1) * BLOCK_NS)  # the block that the last answer granted
    assert stand.operator.change_state('deactivate')
    assert controller.stamps_ns == [n * BLOCK_NS for n in range(1, BLOCKS + 1)]
    assert controller.client.sent == 1 + 2 * BLOCKS
    controller.close()
    stand.close()
    return path.rename(path.with_name(f'{seed}.mcap'))


def test_a_controller_gets_the_same_bytes_whatever_the_delays(start_drive, tmp_path):
    files = [controlled_run(start_drive, tmp_path / 'run.mcap', seed) for seed in (1, 2)]
    assert rows_of(files[0]) == rows_of(files[1])
    recording = Recording(files[0])
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/command/voltage'] == BLOCKS + 1
    assert counts['/command/load'] == BLOCKS
    assert recording.series('position').value[-1] != 0.0


def test_a_client_in_another_namespace_and_with_a_longer_block(start_drive: Callable):
    stand = start_drive(LOCKSTEP, '/left', wait=False)
    node = Node('other', context=stand.context, namespace='/elsewhere')
    executor = SingleThreadedExecutor(context=stand.context)
    executor.add_node(node)
    seen_s: list[float] = []

    def answer(stamp_s: float, _: float) -> list[tuple[str, float]]:
        seen_s.append(stamp_s)
        return []

    client = LockstepClient(node, 5 * BLOCK_S, answer, namespace='/left')
    spin_until(executor, seen_s, 4)
    assert seen_s == pytest.approx([5e-3, 10e-3, 15e-3, 20e-3])
    assert client.granted_ns == 25 * BLOCK_NS
    client.close()
    end_node(executor, node)


def test_a_client_refuses_a_command_that_there_is_not(start_drive: Callable):
    stand = start_drive(LOCKSTEP, wait=False)
    client = LockstepClient(stand.operator.node, BLOCK_S, lambda *_: [])
    for name in ('volts', 'grant'):
        with pytest.raises(UnknownName, match=f"command '{name}' is not known; use voltage, "):
            client.command(name, 1.0)
    assert client.sent == 0
    client.close()
