"""The demo: a node in its own process, commanded from this one, recorded and plotted."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.channels import Channel, name_in_file
from stickslip_ros.interface.topics import NODE_NAME, PREFIX, recorded_channels
from stickslip_ros.parameters import Parameters, dump_yaml
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.ros.client import open_context
from stickslip_ros.ros.executable import stay_on_this_host
from stickslip_ros.testing.operator import Operator, deep_queues
from stickslip_ros.units import NANO

FREE_HZ, FREE_STEPS = 100.0, 8
"""Slow steps of a runner that touches nothing: its ringing dies out within each."""
PUSH_HZ, PUSH_STEPS, LOADED_STEPS, LAST_STEPS = 500.0, 100, 75, 10
"""Steps until the force against the load cell hardly rises; under a load, and after it; the last
of them, over which the force is averaged."""
STEPS = FREE_STEPS + PUSH_STEPS + 2 * LOADED_STEPS
RAMP_SHARES = tuple(n / 20.0 for n in range(1, 21))
"""Levels of the direct-voltage ramp, as shares of half the amplifier's range."""
LEVEL_S = 0.004
LOAD_SHARE = 0.2
"""Load over preload: below the force that the drive generates, so that it holds."""
PAUSE_S = 0.03
END_TIMEOUT_S = 20.0
DOMAINS = 100
UNANSWERED = 'ignore:failed to send response:RuntimeWarning'
"""What rclpy warns of when an answer meets nobody; the operator then asks again."""


@dataclass(frozen=True)
class DemoSummary:
    """
    What the demo saw.

    Attributes
    ----------
    steps : int
        Steps of all bursts, as the drive counted them.
    free_step_m : float
        Motion of the free runner per step.
    force_n, loaded_force_n : float
        Mean load-cell reading over the last steps against the load cell: without load, and under
        a load that pulls back.
    real_time_factor, lateness_mean_us, lateness_p99_us, lateness_max_us : float
        Worst second that the drive reported; the factor is the mean of all.
    overruns : int
        Ticks that began more than a period late.
    behind_s : float
        By how much simulated time fell behind the clock, as ticks were too late to be made up.
    dropped, unheard : int
        Messages that the recorder lost, and recorded readings that did not reach the operator.
    published, received : dict of str to int
        Messages by topic: in the recording, and seen (commands: sent) by the operator from just
        before its start to just after its end.
    positions_equal, positions_altered, positions_recorded : int
        Positions that are the same on the topic and in the file, to the bit; that are not; and all
        in the file.
    exit_status : int
        Of the node after SIGINT.
    recording : str
        The file.

    """

    steps: int
    free_step_m: float
    force_n: float
    loaded_force_n: float
    real_time_factor: float
    lateness_mean_us: float
    lateness_p99_us: float
    lateness_max_us: float
    overruns: int
    behind_s: float
    dropped: int
    unheard: int
    published: dict[str, int]
    received: dict[str, int]
    positions_equal: int
    positions_altered: int
    positions_recorded: int
    exit_status: int
    recording: str

    @property
    def passed(self) -> bool:
        """
        Whether steps were made, nothing was altered or dropped, and the node ended cleanly.

        What an operator that is held up by other processes does not take in time is lost to it, as
        the quality of service says, and no fault.

        """
        heard = self.positions_equal > 0 and self.positions_altered == 0
        whole = self.steps == STEPS and self.dropped == 0 and heard
        return whole and self.exit_status == 0

    @property
    def verdict(self) -> str:
        """What the numbers mean, in a sentence."""
        if not self.passed:
            return 'NOT as it should be: look at steps, dropped, differing and status above'
        pace = 'simulated time kept up with the clock'
        if self.behind_s > 0.0:
            fell = f'simulated time fell {self.behind_s:.2g} s behind the clock'
            pace = f'this machine was too busy for real time: {fell}'
        lost = f'{self.unheard} readings did not reach the operator, but are recorded'
        return f'{pace}; {lost if self.unheard else "nothing was lost"}'


def run_demo(
    parameters: Parameters, folder: Path, say: Callable[[str], None] = lambda _: None
) -> DemoSummary:
    """
    Run the drive as a process of its own and command it over topics.

    The runner walks freely, then against the load cell, which stands some steps before it.

    Parameters
    ----------
    parameters : Parameters
        The stand; the demo decides on ``load_cell.contact`` and ``load_cell.gap``.
    folder : Path
        Receives ``demo.mcap`` (an older one is replaced) and the parameters.
    say : callable
        Receives a line for every thing that is begun.

    Raises
    ------
    StickSlipError
        If the node ends or refuses to start, or does not answer once it has started.

    """
    stay_on_this_host()
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / 'demo.mcap'
    file.unlink(missing_ok=True)
    parameters = _demo_stand(parameters, file)
    settings = folder / 'demo_parameters.yaml'
    settings.write_text(dump_yaml(parameters, 'Parameters of the demo.'), encoding='utf-8')
    domain = int(os.environ.get('ROS_DOMAIN_ID') or 1 + os.getpid() % DOMAINS)
    say('starting the drive, a process of its own')
    with drive_process(settings, domain) as process, _operator(domain) as stand:
        await_start(stand, process)
        stand.wait_for_drive()
        say('commanding it: free steps, a voltage ramp, steps against the load cell, a load')
        marks = _session(stand, parameters)
        recording, channels = Recording(file), recorded_channels(parameters)
        unheard = _hear_the_rest(stand, recording, channels)
        process.send_signal(signal.SIGINT)
        exit_status = process.wait(END_TIMEOUT_S)
    topics = {key: channel.topic for key, channel in channels.items()}
    return _summarise(stand, marks, recording, topics, unheard, exit_status)


def _demo_stand(parameters: Parameters, file: Path) -> Parameters:
    """Return the stand with its load cell out of reach of the free steps and of the ramp."""
    stroke_m = parameters.actuator.gain * _range_v(parameters)
    return parameters.updated(
        {
            'load_cell.contact': 'one_sided',
            'load_cell.gap': (FREE_STEPS + 1) * stroke_m,
            'record.directory': str(file.parent),
            'record.name': file.name,
            'record.on_start': False,
        }
    )


def _range_v(parameters: Parameters) -> float:
    return parameters.amplifier.voltage_max - parameters.amplifier.voltage_min


def await_start(stand: Operator, process: 'subprocess.Popen[bytes]') -> None:
    """Wait for a drive that starts, as long as its process lives: it may have to compile."""

    def check() -> None:
        stop_if_asked()
        if process.poll() is not None:
            status = process.returncode
            raise StickSlipError(f'the drive ended with status {status}; its log says why')

    stand.check = check
    state = stand.shake_hands(math.inf)
    if state != 'active':
        raise StickSlipError(f'the drive is {state}, not active; its log says why')


@contextmanager
def drive_process(settings: Path, domain: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run the node in a process of its own; it is ended with the context, and in its own way."""
    command = [sys.executable, '-W', UNANSWERED, '-m', 'stickslip_ros.ros.node']
    command += ['--ros-args', '--params-file', str(settings), '--log-level', 'warn']
    for name, depth in deep_queues('position').items():  # an operator may be held up for long
        command += ['-p', f'{name}:={depth}']
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    process = subprocess.Popen(command, env=environment)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextmanager
def _operator(domain: int) -> Iterator[Operator]:
    context = open_context(domain)
    stand = Operator(context)
    try:
        yield stand
    finally:
        stand.close()
        context.try_shutdown()


def _session(stand: Operator, parameters: Parameters) -> dict[str, int]:
    """Record what the demo does; return marks: simulated times in ns and steps."""
    stand.received.clear()
    answer = stand.set_recording(wanted=True)
    if not answer.success:
        raise StickSlipError(f'the drive does not record: {answer.message}')
    marks = _move_and_push(stand, parameters)
    stand.set_recording(wanted=False)
    stand.switch('set_paused', wanted=True)  # nothing new comes while the rest is heard
    reports = len(stand.diagnostics)
    stand.spin_until(lambda: len(stand.diagnostics) > reports, 'diagnostics')
    return marks


def _hear_the_rest(stand: Operator, recording: Recording, channels: dict[str, Channel]) -> int:
    """Wait for recorded readings that are on their way; return how many have not come."""
    positions = {round(time_s / NANO) for time_s in recording.series('position').time_s}
    counts = {channel.topic: channel.messages for channel in recording.channels}
    others = {
        key: counts[channel.topic]
        for key, channel in channels.items()
        if not (key.startswith(PREFIX) or key == 'position' or channel.qos.latched)
    }

    def unheard() -> int:
        short = sum(max(0, count - stand.received[key]) for key, count in others.items())
        return len(positions - stand.positions.keys()) + short

    with suppress(StickSlipError):
        stand.spin_until(lambda: not unheard(), 'the rest', END_TIMEOUT_S)
    return unheard()


def _move_and_push(stand: Operator, parameters: Parameters) -> dict[str, int]:
    """Step freely, follow a voltage, step against the load cell; return the marks of that."""
    range_v = _range_v(parameters)

    def order(name: str, *numbers: float) -> dict[str, Any]:
        before = len(stand.events)
        stand.command(name, numbers)
        return dict(stand.wait_for_event(name, before))

    def step(frequency_hz: float, count: int) -> dict[str, Any]:
        burst = order('sawtooth', range_v, frequency_hz, count)
        stand.spin_for(PAUSE_S)
        return burst

    stand.spin_for(PAUSE_S)
    free = step(FREE_HZ, FREE_STEPS)
    for share in RAMP_SHARES:
        order('voltage', parameters.amplifier.voltage_min + 0.5 * share * range_v)
        stand.spin_for(LEVEL_S)
    push = step(PUSH_HZ, PUSH_STEPS)
    order('load', -LOAD_SHARE * parameters.stand.preload)
    loaded = step(PUSH_HZ, LOADED_STEPS)
    order('load', 0.0)
    again = step(PUSH_HZ, LOADED_STEPS)
    stand.spin_for(PAUSE_S)
    return {
        'steps': sum(burst['steps'] for burst in (free, push, loaded, again)),
        'free_end_ns': free['time_ns'],
        'push_end_ns': push['time_ns'],
        'loaded_end_ns': loaded['time_ns'],
    }


def _summarise(
    stand: Operator,
    marks: dict[str, int],
    recording: Recording,
    topics: dict[str, str],
    unheard: int,
    exit_status: int,
) -> DemoSummary:
    position, force = recording.series('position'), recording.series('force')
    summaries = {channel.topic: channel for channel in recording.channels}
    published = {name_in_file(key): summaries[name].messages for key, name in topics.items()}
    recorded = dict(
        zip((round(t / NANO) for t in position.time_s), position.value.tolist(), strict=True)
    )
    both = stand.positions.keys() & recorded.keys()
    title = f'{NODE_NAME}: time'
    reports = [part[title] for part in stand.diagnostics if title in part]
    times = [report for report in reports if int(report['ticks'])]
    # The middles of the second ramp and of the last one: the ringing is over, what is late is so
    # in both.
    middle_s = marks['free_end_ns'] * NANO - 0.5 / FREE_HZ
    way_m = _at(position, middle_s) - _at(position, middle_s - (FREE_STEPS - 2) / FREE_HZ)
    return DemoSummary(
        steps=marks['steps'],
        free_step_m=way_m / (FREE_STEPS - 2),
        force_n=_last(force, marks['push_end_ns']),
        loaded_force_n=_last(force, marks['loaded_end_ns']),
        real_time_factor=sum(float(t['real_time_factor']) for t in times) / len(times),
        lateness_mean_us=max(float(t['lateness_mean_us']) for t in times),
        lateness_p99_us=max(float(t['lateness_p99_us']) for t in times),
        lateness_max_us=max(float(t['lateness_max_us']) for t in times),
        overruns=int(times[-1]['overruns_total']),
        behind_s=float(times[-1]['behind_s']),
        dropped=sum(channel.gaps for channel in recording.channels),
        unheard=unheard,
        published=published,
        received={name_in_file(key): stand.received[key] for key in topics},
        positions_equal=sum(stand.positions[t] == recorded[t] for t in both),
        positions_altered=sum(stand.positions[t] != recorded[t] for t in both),
        positions_recorded=len(recorded),
        exit_status=exit_status,
        recording=str(recording.path),
    )


def _at(series: Series, time_s: float) -> float:
    return float(np.interp(time_s, series.time_s, series.value))


def _last(series: Series, time_ns: int) -> float:
    """Return the mean over the last steps before a time."""
    end_s = time_ns * NANO
    return float(series.window(end_s - LAST_STEPS / PUSH_HZ, end_s).value.mean())
