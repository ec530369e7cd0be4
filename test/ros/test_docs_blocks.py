# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Each command of the pages for the start and of the how-to pages runs as it stands there."""

import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from executables import BIN, end
from pages import DOCS, Block, blocks_of, commands_of
from processes import run_process, start_process
from rig_recording import write_a_bag, write_a_rig

from stickslip_ros import (
    CompareOptions,
    Parameters,
    SpringContact,
    compare,
    open_run,
    simulate,
    sweep,
)
from stickslip_ros.process.signals import ENDED, STOPPED

PAGES = sorted([*DOCS.glob('start/*.md'), *DOCS.glob('howto/*.md')])
INSTALLED = 'needs an installed ROS 2: there are no wheels of its command line and builder'
LEFT_OUT = {
    'ros2 ': INSTALLED,
    'rosdep ': INSTALLED,
    'colcon ': INSTALLED,
    'make ': 'installs the environment of a clone, in which this test runs already',
    'pip install ': 'loads packages; make test-all has them from its lock',
    'python docs/examples/anc300.py': 'goes on beside a drive; test_docs_doors.py does that',
    'ssh ': 'needs a second host',
}
"""How commands begin that are left out, and why."""
GOES_ON = {
    'drive': ('drive', ENDED),
    'stickslip drive': ('drive', ENDED),
    'stickslip twin': ('twin', ENDED),
    'stickslip panel': ('http', STOPPED),
}
"""How programs begin that go on until Ctrl-C, a word that they say first, and their status."""
CLOCK_AHEAD_S = 5021.3
HALF_A_ROW_S = 1e-4
NOISE_M = 1e-9


def write_a_table(path: Path, preload_n: float = 0.5) -> None:
    """Write forces of the paper's stand over the stroke, as a laboratory does."""
    table = sweep({}, {'stand.preload': [preload_n], 'amplitude_m': np.linspace(60e-9, 160e-9, 6)})
    rows = 1e9 * table['amplitude_m'], 1e3 * table['force_mean_n']
    header = 'amplitude (nm),force (mN)'
    np.savetxt(path, np.column_stack(rows), '%.1f', ',', header=header, comments='')


def write_a_stand(path: Path) -> None:
    path.write_text('/**: {ros__parameters: {runner: {damping: 20.0}}}\n')


def write_a_loop(path: Path) -> None:
    """Write a loop of a sphere of 2 mm under 200 mN, in a rig of 2 N/um."""
    stand = Parameters().updated({'contact.radius': 2e-3})
    contact = SpringContact(stand, 0.2, rig_n_per_m=2e6)
    turns_nm = [0.0, *[2.0] * 75, *[-2.0] * 150, *[2.0] * 150]
    rows = [(1e3 * contact.move(1e-9 * step, 0.2), 200.0, 2.0) for step in turns_nm]
    table = np.column_stack((np.cumsum(turns_nm), rows))
    header = 'displacement (nm),tangential force (mN),normal force (mN),rig stiffness (N/um)'
    np.savetxt(path, table, '%.2f', ',', header=header, comments='')


def write_a_voltage(path: Path) -> None:
    path.write_text('time_s,voltage_v\n0.0,10.0\n0.005,60.0\n0.010,20.0\n')


def write_a_run(path: Path) -> None:
    simulate({}, voltage_v=300.0, steps=20, record=path)


def write_the_experiment(path: Path) -> None:
    [table] = blocks_of(DOCS / 'howto/compare.md', 'csv')
    path.write_text(table.text)


OF_THE_READER: dict[str, Callable[[Path], object]] = {
    'experiment.csv': write_the_experiment,
    'fitted.yaml': write_a_stand,
    'force.csv': write_a_table,
    'loop2.csv': write_a_loop,
    'measured.csv': write_a_voltage,
    'mine.yaml': write_a_stand,
    'p01.csv': partial(write_a_table, preload_n=0.1),
    'p05.csv': write_a_table,
    'rig.mcap': write_a_rig,
    'rigbag': write_a_bag,
    'runs/demo.mcap': write_a_run,
}
"""Files that a reader has before a page, each written where a command first reads it."""


def is_of(beginnings: Iterable[str], command: str) -> str:
    """Return which of the beginnings a command has, or nothing."""
    return next((each for each in beginnings if f'{command} '.startswith(each)), '')


def begin(command: str) -> 'subprocess.Popen[str]':
    """Start a program that goes on; return it when it has said that it does."""
    word, _ = GOES_ON[is_of(GOES_ON, command)]
    port = ' --port 0' if ' panel' in command else ''  # that of the page may be taken
    streams = {'stdout': subprocess.PIPE, 'stderr': subprocess.STDOUT}
    process = start_process(['bash', '-c', f'exec {command}{port}'], **streams)
    said = []
    for line in process.stdout or ():
        said.append(line)
        if word in line:
            return process
    raise AssertionError((command, said))


def stop(command: str, process: 'subprocess.Popen[str]') -> None:
    """End a program by Ctrl-C, as its reader does."""
    status, errors = end(process, signal.SIGINT)
    assert status == GOES_ON[is_of(GOES_ON, command)][1], (command, errors)


def run_the_block(block: Block, programs: ExitStack) -> None:
    """Run the commands of a block in this folder; programs that go on are stopped by the stack."""
    for command in commands_of(block):
        if is_of(LEFT_OUT, command):
            continue
        words = shlex.split(command, comments=True)
        for before, name in zip(['', *words], words, strict=False):
            if name in OF_THE_READER and before != '-o' and not Path(name).exists():
                Path(name).parent.mkdir(exist_ok=True)
                OF_THE_READER[name](Path(name))
        if is_of(GOES_ON, command):
            programs.callback(stop, command, begin(shlex.join(words)))
        else:
            done = run_process(['bash', '-ec', command])
            assert done.returncode == 0, (command, done.stdout, done.stderr)


@pytest.fixture
def folder(tmp_path: Path, ros_domain: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder as a clone is: with its environment, its layouts and stands, and runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('PATH', f'{BIN}:{os.environ["PATH"]}')
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    monkeypatch.setenv('MPLBACKEND', 'agg')
    (tmp_path / '.venv').symlink_to(sys.prefix)
    (tmp_path / 'config').symlink_to(DOCS.parent / 'config')
    (tmp_path / 'runs').mkdir()
    return tmp_path


def check_the_walk() -> None:
    """Check what the page for developers says of its walk."""
    position_m = open_run('runs/walk.mcap').frame['position_m'].iloc[-1]
    assert position_m == pytest.approx(1e-6, abs=NOISE_M)
    aligned = compare('runs/stage.mcap', 'measured.csv', options=CompareOptions(align=True))
    assert aligned.alignment.shift_s == pytest.approx(-CLOCK_AHEAD_S, abs=HALF_A_ROW_S)
    assert abs(aligned.quantities[0].agreement.bias) < NOISE_M


@pytest.mark.slow  # up to some minutes a page
@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.stem)
def test_every_command_of_a_page_runs_as_it_stands(page: Path, folder: Path):
    with ExitStack() as programs:
        for block in blocks_of(page):
            if block.language in ('csv', 'python') and block.file:
                Path(block.file).write_text(block.text)
            if block.language == 'sh':
                with programs.pop_all():
                    run_the_block(block, programs)
    if page.name == 'ros_developer.md':
        check_the_walk()


def test_every_reason_to_leave_a_command_out_has_one_and_blocks_say_what_they_hold():
    blocks = [block for page in PAGES for block in blocks_of(page)]
    assert all(block.language for block in blocks)
    of_a_shell = [block for block in blocks if block.language == 'sh']
    commands = [command for block in of_a_shell for command in commands_of(block)]
    assert {is_of(LEFT_OUT, command) for command in commands} - {''} == LEFT_OUT.keys()
    assert {is_of(GOES_ON, command) for command in commands} - {''} == GOES_ON.keys()
    words = {word for command in commands for word in command.split()}
    assert OF_THE_READER.keys() <= words
