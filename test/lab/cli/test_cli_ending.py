# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every verb as a process: stopped by a signal it ends in one line, and streams may be closed."""

import fcntl
import os
import pty
import signal
import subprocess
import sys
import termios
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from processes import finish, progress_of, run_process, start_process
from waiting import wait_until

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.cli.verbs import VERBS
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.storage import CLOSING_RECORD

STICKSLIP = Path(sys.executable).with_name('stickslip')
LOST_STEPS = '1000000'
"""Steps that nobody waits for."""

PROGRESS = ('[INFO]', 'starting the drive', 'commanding it', 'drawing', 'read    ', '        ')
"""What a node logs, and how far the demo says that it is."""

Reached = Callable[[int, Path], bool]


def knows_signals(pid: int, folder: Path) -> bool:
    """Return whether a process catches SIGTERM: the first thing that it does by itself."""
    for line in Path(f'/proc/{pid}/status').read_text().splitlines():
        if line.startswith('SigCgt:'):
            return bool(int(line.split()[1], 16) >> (signal.SIGTERM - 1) & 1)
    return False


def has_written(name: str, size_bytes: int = 1) -> Reached:
    """Return whether a file in the folder has come to a size."""

    def reached(pid: int, folder: Path) -> bool:
        file = folder / name
        return file.exists() and file.stat().st_size >= size_bytes

    return reached


def has_looked(times: int) -> Reached:
    """Return whether a verb has looked so often if it shall end."""
    return has_written('looks', times)


WATCHED = """
import sys
from stickslip_ros.process import stopping

def noted(stop_if_asked=stopping.stop_if_asked, file=open('looks', 'ab', buffering=0)):
    stop_if_asked()
    file.write(b'.')

stopping.stop_if_asked = noted
from stickslip_ros.lab.cli.start import stickslip
sys.exit(stickslip())
"""
"""A verb that notes in a file each time it looks."""


SIMULATE = ['simulate', '--voltage', '300', '--steps', LOST_STEPS, '-o', 'run.mcap']
SWEEP = ['sweep', '--amplitude', '1e-9:160e-9:3000', '--steps', '300', '-o', 'table.csv']
MOMENTS: list[tuple[list[str], Reached]] = [
    (SIMULATE, has_written('run.mcap', 300_000)),
    (SWEEP, has_written('table.csv.journal', 2_000)),
    (['zero-amplitude', '--steps', LOST_STEPS], has_looked(50)),
    (['bode', '--frequency', '1:100:1000'], has_looked(50)),
    (['compare', 'points.csv', 'model', '--steps', LOST_STEPS], has_looked(50)),
    (['fit', 'points.csv', '--free', 'contact.friction', '--starts', '1000'], has_looked(50)),
    (['drive'], knows_signals),
    (['command', 'sawtooth', '300', '500', '0'], knows_signals),  # waits for a drive
    (['demo', '--output', '.'], has_written('demo.mcap')),
    (['panel', '--port', '0'], has_looked(5)),
    (['replay', 'voltage.csv', '-o', 'again.mcap'], has_written('again.mcap', 300_000)),
    (['optimise', 'force', '-o', 'wave.csv', '--workers', '1'], has_looked(50)),
    (['figures', '--only', 'fig2', '--points', '1000'], has_looked(50)),
    (['validate', '--output', '.'], has_looked(5)),
    (['twin'], knows_signals),
]


QUICK = {
    'contact', 'draw', 'import', 'export', 'info', 'plot', 'recover', 'parameters', 'interface',
    'compile',
}  # fmt: skip
"""Verbs that are over before a signal comes; of imports see test_executable.py."""


def test_the_table_has_every_verb_that_takes_its_time():
    assert {words[0] for words, _ in MOMENTS} | QUICK == VERBS.keys()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder with the files that verbs want to read."""
    rows = '\n'.join(f'{0.2 + 0.1 * i},{60e-9 + i * 1e-8},0.05' for i in range(8))
    header = 'preload_n,amplitude_m,force_n'
    (tmp_path / 'points.csv').write_text(f'{header}\n{rows}\n', encoding='utf-8')
    wave = 'time_s,voltage_v\n0.0,0.0\n1000.0,300.0\n'
    (tmp_path / 'voltage.csv').write_text(wave, encoding='utf-8')
    return tmp_path


def stopped(
    words: list[str], folder: Path, reached: Reached, number: signal.Signals, ros_domain: int
) -> tuple[int, str]:
    """Start a verb, send it a signal twice at a moment; return its status and its errors."""
    environment = {
        **os.environ,
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_DOMAIN_ID': str(ros_domain),
        'ROS_LOG_DIR': str(folder / 'log'),
    }
    with start_process(
        [sys.executable, '-c', WATCHED, *words],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:

        def is_there() -> bool:
            assert process.poll() is None, process.communicate()
            return reached(process.pid, folder)

        wait_until(is_there, f'the moment of {words[0]}', progress=progress_of(process))
        for _ in range(2):
            process.send_signal(number)
        _, errors = finish(process)
    return process.returncode, errors


OFTEN = {'simulate', 'sweep', 'drive'}
"""Verbs that `make test` stops; `make test-all` stops each."""


@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize(
    'place',
    [
        pytest.param(place, id=words[0], marks=() if words[0] in OFTEN else pytest.mark.slow)
        for place, (words, _) in enumerate(MOMENTS)
    ],
)
def test_a_stopped_verb_ends_in_one_line_and_leaves_whole_files(place, folder, ros_domain):
    words, reached = MOMENTS[place]
    number = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[place % 3]
    status, errors = stopped(words, folder, reached, number, ros_domain)
    *before, last = errors.splitlines()
    assert last.startswith('stickslip: ')
    assert not [line for line in before if not line.startswith(PROGRESS)]
    assert status == (0 if words[0] in ('drive', 'twin') else 130)
    for file in folder.glob('*.mcap'):
        assert CLOSING_RECORD in Recording(file).metadata
    for file in folder.glob('*.journal'):
        kept = len(file.read_text(encoding='utf-8').splitlines()) - 1
        assert f'stopped after {kept} of' in last
        assert str(file.name) in last


def in_its_terminal() -> None:
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.mark.usefixtures('compiled_kernels')
def test_a_verb_whose_terminal_is_closed_ends_at_once_and_leaves_whole_files(tmp_path: Path):
    terminal, own_end = pty.openpty()
    with start_process(
        [STICKSLIP, *SIMULATE],
        cwd=tmp_path,
        stdin=own_end,
        stdout=own_end,
        stderr=own_end,
        start_new_session=True,
        preexec_fn=in_its_terminal,
    ) as process:
        os.close(own_end)
        os.set_blocking(terminal, False)

        def is_under_way() -> bool:
            with suppress(OSError):
                os.read(terminal, 1 << 16)
            return has_written('run.mcap', 300_000)(process.pid, tmp_path)

        wait_until(is_under_way, 'a recording', progress=progress_of(process))
        os.close(terminal)
        finish(process)
        assert process.returncode == 130
    assert CLOSING_RECORD in Recording(tmp_path / 'run.mcap').metadata


@pytest.mark.parametrize('verb', ['parameters', 'drive'])
def test_a_closed_output_is_refused_in_one_line(verb: str):
    ended = shell(verb, '>&-')
    assert ended.returncode == 2
    assert ended.stderr == (
        'stickslip: standard output is closed; send it to a file, or to /dev/null\n'
    )


@pytest.mark.parametrize('closed', ['<&- 2>&-'])
def test_other_streams_may_be_closed(closed: str, capsys: pytest.CaptureFixture[str]):
    main(['parameters'])
    assert shell('parameters', closed).stdout == capsys.readouterr().out


def shell(verb: str, redirection: str) -> subprocess.CompletedProcess[str]:
    return run_process(['/bin/sh', '-c', f'exec "$0" "$@" {redirection}', STICKSLIP, verb])
