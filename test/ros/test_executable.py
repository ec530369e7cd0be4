# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The executables: on this host, one process each, ended cleanly by signals at every stage."""

import os
import random
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from executables import CLI_DRIVE, DRIVE, await_handlers, end, pelt
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from processes import progress_of, start_process
from waiting import wait_until

from stickslip_ros.instrument.reports import Status
from stickslip_ros.lab.cli.main import main as stickslip
from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros import executable
from stickslip_ros.ros.executable import DISCOVERY_VARIABLE, stay_on_this_host
from stickslip_ros.ros.node import main as drive
from stickslip_ros.runtime.pacing import KNOWS_SLICES, SLICE_S, scheduling
from stickslip_ros.testing.stand import FIRST_PORT, PORTS_PER_DOMAIN
from stickslip_ros.units import NANO


@pytest.mark.parametrize(
    'signals',
    [(signal.SIGHUP,), (signal.SIGINT, signal.SIGHUP, signal.SIGTERM) * 50],
    ids=['SIGHUP', 'many'],
)
def test_a_signal_ends_the_drive_cleanly_and_completes_the_recording(
    start: Callable, meet: Callable, tmp_path: Path, signals: tuple[int, ...]
):
    process = start(*DRIVE, '--ros-args', '-p', f'record.directory:={tmp_path}/runs')
    operator = meet()
    path = operator.set_recording(wanted=True).message
    operator.command('sawtooth', (300.0, 500.0, 0.0))
    operator.spin_until(lambda: bool(operator.status & Status.MOVING), 'the move')
    operator.spin_for(0.3)  # a backlog of readings may count as time
    status, errors = end(process, *signals)
    assert status == 0
    assert 'Traceback' not in errors
    recording = Recording(path)
    assert {channel.gaps for channel in recording.channels} == {0}
    recorded = {channel.topic: channel.messages for channel in recording.channels}
    assert recorded['/command/sawtooth'] == 1
    assert round(recording.series('position').time_s[-1] / NANO) >= max(operator.positions)
    assert recording.metadata['stickslip_recorder']['written'] == str(sum(recorded.values()))


def test_a_signal_ends_a_node_that_has_nothing_to_do(start: Callable, meet: Callable):
    process = start(*DRIVE, '--ros-args', '-p', 'autostart:=false')
    operator = meet(wait=False)
    operator.spin_until(lambda: NODE_NAME in operator.node.get_node_names(), NODE_NAME)
    status, errors = end(process, signal.SIGTERM)
    assert status == 0
    assert 'Traceback' not in errors


def test_a_refused_parameter_is_one_clear_line_and_status_2(start: Callable):
    """Libraries may say more, with other words."""
    status, errors = end(start(*DRIVE, '--ros-args', '-p', 'stand.prelaod:=0.3'))
    assert status == 2
    [only] = [each for each in errors.splitlines() if each.startswith('drive:')]
    line = "drive: parameter 'stand.prelaod' is not known; did you mean stand.preload"
    assert only.startswith(line)
    assert 'Traceback' not in errors


@pytest.mark.parametrize(
    ('words', 'line'),
    [
        (('stand',), "'stand' is not known; put parameters and names after --ros-args"),
        (('-p', 'stand.preload:=0.3'), "'-p' is not known; put parameters and names after"),
        (('--ros-args', '--param'), "Failed to parse ROS arguments: Couldn't parse trailing"),
        (('--ros-args', '--bogus'), "['--bogus'] is not known to ROS; put parameters and names"),
        (
            ('--ros-args', '-p', os.fsdecode(b'record.name:=\xff')),
            r"'record.name:=\udcff' is not t",
        ),
        *(
            (('--ros-args', '-p', 'autostart:=false', '-p', f'{name}:={value}'), f'{name} {line}')
            for name, value, line in (
                ('feet.count', '[]', '[] is not an array of at least one; give one value or more'),
                ('stand.preload', '[]', '[] is not a finite number; give a number such as 0.5'),
                ('use_sim_time', '[]', '[] is not true or false; write true or false'),
                ('use_sim_time', '3', '3 is not true or false; write true or false'),
                ('qos_overrides./force.publisher.depth', '[]', '[] is not a policy; give a'),
            )
        ),
        (('--ros-args', '-p', 'sim.seeds:=[]'), "parameter 'sim.seeds' is not known; did you"),
    ],
)
def test_a_word_that_nobody_heeds_is_refused(words, line, monkeypatch, capsys):
    for step in ('begin', 'wake_in_time', 'stay_on_this_host'):  # for a process of its own
        monkeypatch.setattr(executable, step, lambda: None)
    assert drive(['drive', *words]) == 2
    assert capsys.readouterr().err.startswith(f'drive: {line}')


def test_the_command_line_refuses_likewise(capsys: pytest.CaptureFixture[str]):
    assert stickslip(['drive', '--set', 'stand.preload=101']) == 2
    line = 'stickslip: stand.preload 101 N is above the maximum 100 N; lower it'
    assert capsys.readouterr().err.startswith(line)


def test_a_transition_that_does_not_fit_does_not_end_the_process_whose_threads_wake_in_time(
    start: Callable, meet: Callable, ros_domain: int
):
    """Only the thread that waits for signals, and those of libraries, have long slices."""
    process = start(*DRIVE)
    operator = meet()
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
    future = operator.ask(ChangeState, 'change_state', request)
    operator.spin_until(lambda: future.done() or process.poll() is not None, 'an answer')
    assert process.poll() is None
    assert not future.result().success
    if KNOWS_SLICES:  # which Linux grants from 6.12 on
        threads = list(Path(f'/proc/{process.pid}/task').iterdir())
        told = {each: scheduling(int(each.name)) for each in threads}
        prompt = {
            each for each in threads if told[each] and told[each].runtime_ns == SLICE_S * 1e9
        }
        names = {each: each / 'comm' for each in threads if each.exists()}
        assert {each for each in names if names[each].read_text().startswith('dds')} < prompt
    assert udp_addresses(process.pid, ros_domain) == {EVERYWHERE}  # without the profile
    assert end(process, signal.SIGINT)[0] == 0


def test_the_command_line_hands_its_parameters_and_ros_arguments_to_the_node(
    start: Callable, meet: Callable, tmp_path: Path
):
    settings = tmp_path / 'settings.yaml'
    settings.write_text('/**:\n  ros__parameters:\n    stand:\n      preload: 0.3\n')
    values = ('sim.seed=5', 'runner.mass=4e-3', 'record.name=12')  # a text that looks otherwise
    words = [word for value in values for word in ('--set', value)]
    process = start(
        *CLI_DRIVE, '--params', str(settings), *words, '--ros-args', '-r', '__ns:=/left'
    )
    operator = meet('/left')
    operator.spin_until(lambda: bool(operator.info), 'the info')
    told = operator.info['parameters']
    assert (told['stand.preload'], told['sim.seed'], told['runner.mass']) == (0.3, 5, 4e-3)
    assert told['record.name'] == '12'
    status, errors = end(process, signal.SIGINT)
    assert status == 0
    assert 'Traceback' not in errors


IMPORTS_FOR_EVER = """
import sys, threading
class Finder:
    def find_spec(self, name, *_):
        if name == 'numpy':
            print('importing', flush=True)
            threading.Event().wait()
sys.meta_path.insert(0, Finder())
sys.argv = {words}
from stickslip_ros.{module} import {name}
sys.exit({name}())
"""
LATEST_S = 1.0
"""Processor time of a drive at the latest random moment."""


@pytest.mark.parametrize(
    ('words', 'status'),
    [
        (['drive'], 0),
        (['stickslip', 'drive'], 0),
        (['stickslip', 'simulate', '--voltage', '1'], 130),
    ],
)
def test_a_signal_during_imports_ends_an_executable_in_one_line(words: list[str], status: int):
    module = 'lab.cli.start' if words[0] == 'stickslip' else 'ros.start'
    program = IMPORTS_FOR_EVER.format(words=words, name=words[0], module=module)
    with start_process(
        [sys.executable, '-c', program], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout.readline() == 'importing\n'
        line = f'{words[0]}: ended by SIGINT before it had started\n'
        assert end(process, signal.SIGINT) == (status, line)


@pytest.mark.parametrize(
    ('seed', 'records'), [(0, True), pytest.param(1, False, marks=pytest.mark.slow)]
)
def test_signals_from_a_random_moment_until_the_process_is_gone_leave_a_whole_recording(
    start: Callable, tmp_path: Path, seed: int, records: bool
):
    """The interpreter takes its time to end, and gives signals with handlers back to death."""
    chance = random.Random(seed)
    words = ('-p', 'record.on_start:=true', '-p', f'record.directory:={tmp_path}')
    process = start(*DRIVE, '--ros-args', *words)
    await_handlers(process)
    used = progress_of(process)
    ticks = used() + chance.uniform(0.0, LATEST_S) * os.sysconf('SC_CLK_TCK')

    def has_come() -> bool:
        assert process.poll() is None, process.communicate()
        return used() >= ticks and (not records or any(tmp_path.glob('*.mcap')))

    wait_until(has_come, 'a random moment', progress=used)
    status, errors = pelt(process, iter(lambda: chance.uniform(0.0, 2e-3), None))
    assert status == 0
    assert 'Traceback' not in errors
    paths = list(tmp_path.glob('*.mcap'))
    assert len(paths) >= records
    for path in paths:
        recording = Recording(path)
        counted = sum(channel.messages for channel in recording.channels)
        assert recording.metadata['stickslip_recorder']['written'] == str(counted)


PROFILE = Path(__file__).resolve().parents[2] / 'config/loopback.xml'
EVERYWHERE, ON_THIS_HOST = '00000000', '0100007F'
"""The addresses 0.0.0.0 and 127.0.0.1 as /proc/net/udp writes them."""


@pytest.mark.parametrize(
    ('given', 'kept'), [(None, 'LOCALHOST'), ('', 'LOCALHOST'), ('SUBNET', 'SUBNET')]
)
def test_discovery_leaves_this_host_only_if_it_was_told_to(monkeypatch, given, kept):
    monkeypatch.setenv(DISCOVERY_VARIABLE, given or '')
    if given is None:
        monkeypatch.delenv(DISCOVERY_VARIABLE)
    stay_on_this_host()
    assert os.environ[DISCOVERY_VARIABLE] == kept


def udp_sockets(pid: int) -> list[tuple[str, int]]:
    """Give address, in hexadecimal digits, and port of each UDP socket of a process."""
    own = set()
    for each in Path(f'/proc/{pid}/fd').iterdir():
        with suppress(OSError):  # it may be closed meanwhile
            own.update(re.findall(r'^socket:\[(\d+)\]$', str(each.readlink())))
    rows = [line.split() for line in Path(f'/proc/{pid}/net/udp').read_text().splitlines()[1:]]
    ends = [row[1].split(':') for row in rows if row[9] in own]
    return [(address, int(port, 16)) for address, port in ends]


def udp_addresses(pid: int, domain: int) -> set[str]:
    """Give the addresses to which a process has bound ports of a domain."""
    first = FIRST_PORT + PORTS_PER_DOMAIN * domain
    of_domain = range(first, first + PORTS_PER_DOMAIN)
    return {address for address, port in udp_sockets(pid) if port in of_domain}


def test_the_profile_binds_the_ports_of_the_domain_to_this_host(start, meet, ros_domain):
    names = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')  # Jazzy, Kilted
    process = start('env', *(f'{name}={PROFILE}' for name in names), *DRIVE)
    operator = meet()  # has no profile, and hears the drive
    assert udp_addresses(process.pid, ros_domain) == {ON_THIS_HOST}
    operator.command('voltage', 50.0)
    assert operator.wait_for_event('voltage', 0)['result'] == 'DONE'
    assert end(process, signal.SIGINT)[0] == 0
