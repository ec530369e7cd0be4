"""A full disk ends the recording and nothing else; the node says so and records elsewhere."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from stickslip_ros.errors import RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover
from stickslip_ros.testing import Operator, open_context

SIZE_BYTES = 1_000_000
MAIN = (sys.executable, '-m', 'stickslip_ros.ros.node')
END_TIMEOUT_S = 20.0


def mount(folder: Path) -> bool:
    """Mount a small file system; tell whether this process may."""
    command = ['mount', '-t', 'tmpfs', '-o', f'size={SIZE_BYTES}', 'none', str(folder)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[tuple[Path, tuple[str, ...]]]:
    """Give a folder that runs full, and what starts a process that finds it so."""
    folder = tmp_path / 'small'
    folder.mkdir()
    if mount(folder):
        yield folder, ()
        subprocess.run(['umount', str(folder)], check=True)
    else:
        yield folder, ('prlimit', f'--fsize={SIZE_BYTES}')


@pytest.fixture
def drive(
    small_disk: tuple[Path, tuple[str, ...]], ros_domain: int, tmp_path: Path
) -> Iterator[Any]:
    """Start the executable; its folder ``runs`` is on the small disk."""
    folder, limit = small_disk
    (tmp_path / 'runs').symlink_to(folder)
    values = ('record.compression:=none', 'record.flush_period:=0.2')
    words = [word for value in values for word in ('-p', value)]
    process = subprocess.Popen(
        [*limit, *MAIN, '--ros-args', *words],
        env={**os.environ, 'ROS_DOMAIN_ID': str(ros_domain)},
        cwd=tmp_path,
        stderr=subprocess.DEVNULL,
    )
    yield process
    process.send_signal(signal.SIGINT)
    assert process.wait(END_TIMEOUT_S) == 0


@pytest.fixture
def operator(drive: Any, open_operator: Callable[[], Operator]) -> Operator:
    return open_operator()


@pytest.fixture
def open_operator(ros_domain: int) -> Iterator[Callable[[], Operator]]:
    """Give a function that gives an operator of the drive in the other process."""
    context = open_context(ros_domain)
    met: list[Operator] = []

    def meet() -> Operator:
        met.append(Operator(context))
        met[0].wait_for_drive()
        return met[0]

    yield meet
    for each in met:
        each.close()
    context.try_shutdown()


def test_a_full_disk_ends_the_recording_and_not_the_drive(operator: Operator, tmp_path: Path):
    parts: list[Any] = []

    def listen(message: DiagnosticArray) -> None:
        parts.extend(message.status)

    operator.node.create_subscription(DiagnosticArray, '/diagnostics', listen, 100)
    assert operator.set_recording(wanted=True).success
    event = operator.wait_for_event('recording', 0)
    assert (event['number'], event['result']) == (0, 'RECORDING_FAILED')
    assert re.search('No space left|File too large', event['message'])

    def bad() -> list[Any]:
        return [
            each
            for each in parts
            if each.name.endswith('recorder') and each.level == DiagnosticStatus.ERROR
        ]

    operator.spin_until(lambda: bool(bad()), 'the error of the recorder')
    assert bad()[0].message.startswith('stopped: ')
    operator.spin_for(0.2)
    answer = operator.set_recording(wanted=False)
    assert not answer.success
    assert 'has stopped' in answer.message
    [source] = (tmp_path / 'runs').iterdir()
    with pytest.raises(RecordingError, match='stickslip recover'):
        Recording(source)
    _, mended = recover(source, tmp_path / 'mended.mcap')
    position = Recording(mended).series('position')
    assert len(position) == 1 + round((position.time_s[-1] - position.time_s[0]) * 1e3) > 100

    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    (tmp_path / 'runs').unlink()
    (tmp_path / 'runs').symlink_to(elsewhere)
    assert operator.set_recording(wanted=True).success
    operator.spin_for(0.05)
    path = tmp_path / operator.set_recording(wanted=False).message
    recording = Recording(path)
    assert path.resolve().parent == elsewhere
    assert {channel.gaps for channel in recording.channels} == {0}
    assert [each for each in operator.events if each['number'] == 0] == [event]
