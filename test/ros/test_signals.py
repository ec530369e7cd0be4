"""Signals at every stage of a process: it ends as it should, and every recording is whole."""

import random
import signal
import subprocess
import sys
from collections.abc import Callable
from itertools import repeat
from pathlib import Path

import pytest
from executables import CLI_DRIVE, CONTROLLER, DRIVE, await_handlers, end, pelt

from stickslip_ros.recording.reader import Recording

IMPORTS_FOR_EVER = """
import sys, time
class Finder:
    def find_spec(self, name, *_):
        if name == 'numpy':
            print('importing', flush=True)
            time.sleep(600)
sys.meta_path.insert(0, Finder())
sys.argv = {words}
from stickslip_ros import entry
sys.exit(entry.{name}())
"""
LATEST_S = 1.0


def assert_lives(process: subprocess.Popen[str], time_s: float) -> None:
    """Let a process go on for a time."""
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(time_s)


@pytest.mark.parametrize(
    ('words', 'status'),
    [
        (['drive'], 0),
        (['position_controller'], 0),
        (['stickslip', 'drive'], 0),
        (['stickslip', 'simulate'], 130),
    ],
)
def test_a_signal_during_imports_ends_an_executable_in_one_line(words: list[str], status: int):
    program = IMPORTS_FOR_EVER.format(words=words, name=words[0])
    with subprocess.Popen(
        [sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == 'importing\n'
        line = f'{words[0]}: ended by SIGINT before it had started\n'
        assert end(process, signal.SIGINT) == (status, line)


@pytest.mark.parametrize('records', [False, True])
@pytest.mark.parametrize('seed', range(2))
def test_signals_from_a_random_moment_on_leave_a_whole_recording(
    start: Callable, tmp_path: Path, seed: int, records: bool
):
    chance = random.Random(seed)
    words = ('-p', 'record.on_start:=true', '-p', f'record.directory:={tmp_path}')
    process = start(*DRIVE, '--ros-args', *words)
    await_handlers(process)
    while records and not list(tmp_path.glob('*.mcap')):
        assert_lives(process, 0.01)
    assert_lives(process, chance.uniform(0.0, LATEST_S))
    status, errors = pelt(process, iter(lambda: chance.uniform(0.0, 0.03), None))
    assert status == 0
    assert 'Traceback' not in errors
    paths = list(tmp_path.glob('*.mcap'))
    assert len(paths) >= records
    for path in paths:
        recording = Recording(path)
        counted = sum(channel.messages for channel in recording.channels)
        assert recording.metadata['stickslip_recorder']['written'] == str(counted)


@pytest.mark.parametrize('words', [DRIVE, CLI_DRIVE, CONTROLLER])
def test_signals_until_the_process_is_gone_do_not_kill_it(
    start: Callable, meet: Callable, words: tuple[str, ...]
):
    """The interpreter takes its time to end, and gives signals with handlers back to death."""
    process = start(*words)
    operator = meet(wait=False)
    operator.spin_until(lambda: len(operator.node.get_node_names()) > 1, 'the node')
    status, errors = pelt(process, repeat(1e-3))
    assert status == 0
    assert 'Traceback' not in errors
