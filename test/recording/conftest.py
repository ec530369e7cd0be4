# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the tests of recordings share: one run with a topic of every type."""

import resource
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.interface import cdr
from stickslip_ros.interface import messages as m
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    INT32,
    JOINT_STATE,
    POINT_STAMPED,
    STRING,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.recorder import Recorder

COLUMNS = ('sample', 't[s],voltage[V],foot[m],position[m],force[N]')
MS_NS = 1_000_000

CHANNELS = (
    Channel('/stand/position', POINT_STAMPED, Qos(100)),
    Channel('/stand/force', WRENCH_STAMPED, Qos(100, reliable=False)),
    Channel('/stand/voltage', VECTOR3_STAMPED, Qos(10)),
    Channel('/stand/trace', FLOAT64_ARRAY, Qos(10)),
    Channel('/stand/command/steps', INT32, Qos(10)),
    Channel('/stand/command/preload', FLOAT64, Qos(10)),
    Channel('/stand/drive/status', UINT32, Qos(1, latched=True)),
    Channel('/stand/drive/event', STRING, Qos(10)),
    Channel('/stand/truth/position', POINT_STAMPED, Qos(100)),
    Channel('/stand/joint_states', JOINT_STATE, Qos(10)),
)


def _run() -> Iterator[tuple[str, int, bytes]]:
    """Give 20 ms of a run: every topic, at its own rate."""
    yield '/stand/drive/status', 0, cdr.pack_uint32(5)
    for tick in range(20):
        at_ns = tick * MS_NS
        position_m = tick * 1e-9
        yield '/stand/position', at_ns, cdr.pack_stamped(at_ns, 'runner', (position_m, 0, 0))
        yield '/stand/truth/position', at_ns, cdr.pack_stamped(at_ns, 'runner', (-1, 0, 0))
        wrench = cdr.pack_stamped(at_ns, 'load_cell', (-tick, 0, 0, 0, 0, 0.5))
        yield '/stand/force', at_ns, wrench
        if tick % 10 == 0:
            voltage = cdr.pack_stamped(at_ns, 'base', (10.0 * tick, 0, 0))
            yield '/stand/voltage', at_ns, voltage
            yield '/stand/trace', at_ns, cdr.pack_float64_array(_block(tick), COLUMNS)
            joint = m.JointMessage(at_ns, 'base', ('runner',), (position_m,), (), (-tick,))
            yield '/stand/joint_states', at_ns, cdr.pack_joints(joint)
    yield '/stand/command/steps', at_ns, cdr.pack_int32(-3)
    yield '/stand/command/preload', at_ns, cdr.pack_float64(0.4)
    yield '/stand/drive/event', at_ns, cdr.pack_string('{"result": "SUCCEEDED"}')


def _block(tick: int) -> np.ndarray:
    """Give 10 ms of a trace at 1 kS/s; a column k is the time in s, k times over."""
    time_s = np.arange(tick, tick + 10) * 1e-3
    return time_s[:, None] * np.array([1.0, 2.0, 3.0, 4.0, 5.0])


@pytest.fixture(scope='session')
def run() -> list[tuple[str, int, bytes]]:
    return list(_run())


@pytest.fixture(scope='session')
def record_in_parts() -> Callable[..., Recorder]:
    """Record messages; a part begins before the first one of each period."""

    def record(
        path: Path,
        channels: Sequence[Channel],
        run: Iterable[tuple[str, int, bytes]],
        period_ns: int,
        **options: Any,
    ) -> Recorder:
        part = 0
        with Recorder(path, channels, **options) as recorder:
            for topic, time_ns, data in run:
                if time_ns // period_ns > part:
                    part = time_ns // period_ns
                    recorder.begin_part(time_ns)
                recorder.put(topic, time_ns, data, wait=True)
        assert recorder.error is None
        return recorder

    return record


@pytest.fixture(scope='session')
def channels() -> tuple[Channel, ...]:
    return CHANNELS


@pytest.fixture(scope='session')
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a finished recording of the run."""
    path = tmp_path_factory.mktemp('recorded') / 'run.mcap'
    metadata = {'stickslip_run': {'seed': '7', 'specimen': 'steel µ'}}
    attachments = {'parameters.yaml': ('application/yaml', b'seed: 7\n')}
    recorder = Recorder(
        path,
        CHANNELS,
        metadata=metadata,
        attachments=attachments,
        form=FileForm(chunk_size_bytes=2000),
    )
    with recorder:
        for topic, time_ns, data in _run():
            recorder.put(topic, time_ns, data)
    assert recorder.error is None
    return path


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None, object, object]:
    """Lift the limit of small_disk with the test: pytest itself may write into a file."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        return (yield)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture
def small_disk() -> Callable[[int], None]:
    """Give a switch that makes every file of this process end at a size, as a full disk does."""
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size_bytes: int) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))

    return limit
