"""The executable: one process, ended cleanly by signals, recording complete."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.instrument.reports import Status
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.operator import Operator
from stickslip_ros.ros.timeliness import KNOWS_SLICES, SLICE_S, slice_s

#: A process compiles nothing here, but loads kernels and finds its peers.
END_TIMEOUT_S = 20.0
MAIN = (sys.executable, '-m', 'stickslip_ros.ros.main')
CLI_DRIVE = (str(Path(sys.executable).with_name('stickslip')), 'drive')


@pytest.fixture
def start(domain: int, tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Give a function that starts the executable; what still runs at the end is killed."""
    started: list[subprocess.Popen[str]] = []

    def start_process(*words: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            words,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start_process
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def meet(domain: int) -> Iterator[Callable[..., Operator]]:
    """Give a function that gives an operator who hears the drive."""
    met: list[tuple[Operator, Context]] = []

    def meet_drive(namespace: str = '', *, wait: bool = True) -> Operator:
        context = Context()
        rclpy.init(
            args=['--ros-args', '-r', f'__ns:={namespace}'] if namespace else [],
            context=context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        met.append((Operator(context), context))
        if wait:
            met[-1][0].wait_for_drive()
        return met[-1][0]

    yield meet_drive
    for operator, context in met:
        operator.close()
        context.try_shutdown()


def end(process: subprocess.Popen[str], *signals: int) -> tuple[int, str]:
    """Send signals; give exit status and what stands on stderr."""
    for number in signals:
        process.send_signal(number)
    _, errors = process.communicate(timeout=END_TIMEOUT_S)
    return process.returncode, errors


@pytest.mark.parametrize(
    'signals',
    [
        (signal.SIGINT,),
        (signal.SIGTERM,),
        (signal.SIGINT, signal.SIGINT),
        (signal.SIGINT, signal.SIGTERM, signal.SIGINT),
    ],
    ids=['SIGINT', 'SIGTERM', 'SIGINT twice', 'all at once'],
)
def test_a_signal_ends_the_drive_cleanly_and_completes_the_recording(
    start: Callable, meet: Callable, tmp_path: Path, signals: tuple[int, ...]
):
    process = start(*MAIN, '--ros-args', '-p', f'record.directory:={tmp_path}/runs')
    operator = meet()
    path = operator.set_recording(wanted=True).message
    operator.command_sawtooth(300.0, 500.0, 0.0)
    operator.spin_until(lambda: bool(operator.status & Status.MOVING), 'the move')
    operator.spin_for(0.2)
    status, errors = end(process, *signals)
    assert status == 0
    assert 'Traceback' not in errors
    recording = Recording(path)
    assert {channel.gaps for channel in recording.channels} == {0}
    recorded = {channel.topic: channel.messages for channel in recording.channels}
    assert recorded['/command/sawtooth'] == 1
    assert recorded['/position'] >= 200
    assert recording.metadata['stickslip_recorder']['written'] == str(sum(recorded.values()))


@pytest.mark.parametrize(
    ('assignment', 'line'),
    [
        (
            'stand.prelaod:=0.3',
            "drive: parameter 'stand.prelaod' is not known; did you mean stand.preload",
        ),
        (
            'stand.preload:=101.0',
            'drive: stand.preload 101 N is above the maximum 100 N; lower it',
        ),
        (
            'stand.preload:=much',
            (
                "drive: stand.preload 'much' is not a finite number; "
                'give a number such as 0.5 or 60e-9'
            ),
        ),
    ],
)
def test_a_refused_parameter_is_one_clear_line_and_status_2(
    start: Callable, assignment: str, line: str
):
    status, errors = end(start(*MAIN, '--ros-args', '-p', assignment))
    assert status == 2
    [only] = errors.splitlines()
    assert only.startswith(line)


@pytest.mark.skipif(not KNOWS_SLICES, reason='Linux grants slices from 6.12 on')
def test_what_wakes_the_drive_has_short_slices(start: Callable, meet: Callable):
    """Only threads that libraries start when they are imported have others."""
    process = start(*MAIN)
    meet()
    threads = list(Path(f'/proc/{process.pid}/task').iterdir())
    prompt = {each for each in threads if slice_s(int(each.name)) == pytest.approx(SLICE_S)}
    assert Path(f'/proc/{process.pid}/task/{process.pid}') in prompt
    assert {each for each in threads if (each / 'comm').read_text().startswith('dds')} < prompt
    assert end(process, signal.SIGINT)[0] == 0


def test_a_transition_that_does_not_fit_does_not_end_the_process(start: Callable, meet: Callable):
    process = start(*MAIN)
    operator = meet()
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
    future = operator.ask(ChangeState, 'change_state', request)
    operator.spin_until(lambda: future.done() or process.poll() is not None, 'an answer')
    assert process.poll() is None
    assert not future.result().success
    assert end(process, signal.SIGINT)[0] == 0


def test_the_command_line_hands_its_parameters_and_ros_arguments_to_the_node(
    start: Callable, meet: Callable, tmp_path: Path
):
    settings = tmp_path / 'settings.yaml'
    settings.write_text('/**:\n  ros__parameters:\n    stand:\n      preload: 0.3\n')
    words = ('--params', str(settings), '--set', 'sim.seed=5', '--set', 'runner.mass=4e-3')
    process = start(*CLI_DRIVE, *words, '--ros-args', '-r', '__ns:=/left')
    operator = meet('/left')
    operator.spin_until(lambda: bool(operator.info), 'the info')
    told = operator.info['parameters']
    assert (told['stand.preload'], told['sim.seed'], told['runner.mass']) == (0.3, 5, 4e-3)
    status, errors = end(process, signal.SIGINT)
    assert status == 0
    assert 'Traceback' not in errors


@pytest.mark.parametrize('name', ['12'])
def test_a_text_that_looks_like_something_else_reaches_the_node_as_a_text(
    start: Callable, meet: Callable, name: str
):
    process = start(*CLI_DRIVE, '--set', f'record.name={name}')
    operator = meet(wait=False)
    operator.spin_until(lambda: bool(operator.info) or process.poll() is not None, 'the info')
    assert process.poll() is None, process.communicate()[1]
    assert operator.info['parameters']['record.name'] == name
    assert end(process, signal.SIGINT)[0] == 0
