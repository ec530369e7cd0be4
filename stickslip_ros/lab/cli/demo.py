# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip demo``: command a node in its own process over topics, record and draw it."""

import argparse
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.errors import StickSlipError
from stickslip_ros.files import make_folder
from stickslip_ros.instrument.compilation import KERNELS, compile_for, progress_reporter
from stickslip_ros.kernels.kernel import compilation_reported
from stickslip_ros.lab.cli.chosen import chosen_parameters
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.measurements.run_figure import plot_run
from stickslip_ros.parameters import NODE_NAME, Parameters, dump_yaml
from stickslip_ros.process.children import bound_to_parent
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.ros.diagnostics import STAMPS_OFF_MAX_S
from stickslip_ros.ros.executable import stay_on_this_host
from stickslip_ros.sections import Section, report_field, rows_of
from stickslip_ros.testing import Operator, open_context, reserve_domain
from stickslip_ros.units import MICRO, NANO

FREE_HZ, FREE_STEPS = 100.0, 8
"""Slow steps of the free runner: its ringing decays within each."""
PUSH_HZ, PUSH_STEPS, LOADED_STEPS, LAST_STEPS = 500.0, 100, 75, 10
"""Steps until the force against the load cell hardly rises; under a load, and after it; the last
steps, over which the force is averaged."""
_STEPS = FREE_STEPS + PUSH_STEPS + 2 * LOADED_STEPS
RAMP_LEVELS, LEVEL_S, RISE_S = 20, 0.004, 1e-4
"""Levels of the voltage ramp, to half the amplifier's range; the time of each, and of its rise."""
_LOAD_SHARE = 0.2
"""Load over preload: below the force of the drive, so that it holds."""
PAUSE_S = 0.03
END_TIMEOUT_S = 20.0
UNANSWERED = 'ignore:failed to send response:RuntimeWarning'
"""Warning of rclpy for an answer without a client; the operator then asks again."""


@dataclass(frozen=True, kw_only=True)
class DemoSummary:
    """Results of the demo."""

    steps: int = report_field('steps made', '.0f')  # of all bursts, counted by the drive
    free_step_m: float = report_field('step of the free runner', '.2f')
    force_n: float = report_field('force against the load cell', '.2f')  # mean over the last steps
    loaded_force_n: float = report_field('force under a load that pulls back', '.2f')  # the same
    behind_s: float  # largest lag of simulated time behind the clock, made up or given up
    dropped: int = report_field('messages dropped by the recorder', '.0f')
    exit_status: int = report_field('node ended with status', '.0f')  # after SIGINT
    recording: str

    @property
    def passed(self) -> bool:
        """Whether all steps were made, nothing was dropped, and the node ended cleanly."""
        return self.steps == _STEPS and self.dropped == 0 and self.exit_status == 0

    @property
    def verdict(self) -> str:
        if not self.passed:
            return 'the demo failed: check steps, dropped messages and status above'
        if self.behind_s > STAMPS_OFF_MAX_S:
            fell = f'simulated time fell {self.behind_s:.2g} s behind the clock'
            return f'this machine was too busy for real time: {fell}; no step is left out'
        return f'simulated time kept up with the clock; its largest lag was {self.behind_s:.2g} s'


def demo_verb(arguments: argparse.Namespace) -> Answer:
    """Run the demo and draw its recording."""
    parameters = chosen_parameters(arguments)
    make_folder(arguments.output)
    picture = arguments.output / 'demo.png'
    title = 'Stick and slip of the free runner, then force against the load cell'

    def say(line: str) -> None:
        if not arguments.json:
            print(line, file=sys.stderr, flush=True)

    summary = _run_demo(parameters, arguments.output, say)
    say('drawing its recording')
    plot_run(Recording(summary.recording), picture, title=title, with_steps=True)
    shown = Section('The drive, commanded over topics', rows_of(summary))
    files = f'recording {summary.recording}\npicture   {picture}\n\n{summary.verdict}'
    return Answer(summary, [shown, files], 0 if summary.passed else CHECK_FAILED)


def _run_demo(parameters: Parameters, folder: Path, say: Callable[[str], None]) -> DemoSummary:
    """
    Run the drive as a separate process and command it over topics.

    The runner walks freely, then against the load cell, out of reach of the free steps and of the
    ramp.

    """
    stay_on_this_host()
    file, settings = folder / 'demo.mcap', folder / 'demo_parameters.yaml'
    file.unlink(missing_ok=True)
    range_v = parameters.amplifier.range_v
    parameters = parameters.updated(
        {
            'load_cell.contact': 'one_sided',
            'load_cell.gap': (FREE_STEPS + 1) * parameters.actuator.gain * range_v,
            'record.directory': str(file.parent),
            'record.name': file.name,
            'record.on_start': False,
        }
    )
    settings.write_text(dump_yaml(parameters, 'Parameters of the demo.'), encoding='utf-8')
    chosen = os.environ.get('ROS_DOMAIN_ID')
    with compilation_reported(progress_reporter(say, KERNELS)):
        compile_for(parameters)
    say('starting the drive in a separate process')
    with (
        nullcontext(int(chosen)) if chosen else reserve_domain() as domain,
        _drive_process(settings, domain) as process,
        _operator(domain) as operator,
    ):
        await_start(operator, process)
        operator.wait_for_drive()
        say('commanding it: free steps, a voltage ramp, steps against the load cell, a load')
        answer = operator.switch('set_recording', wanted=True)
        if not answer.success:
            raise StickSlipError(f'the drive does not record: {answer.message}')
        bursts = _command(operator, parameters, range_v)
        operator.switch('set_recording', wanted=False)
        reports = len(operator.diagnostics)
        operator.spin_until(lambda: len(operator.diagnostics) > reports, 'diagnostics')
        process.send_signal(signal.SIGINT)
        exit_status = process.wait(END_TIMEOUT_S)
    return _summarise(operator, bursts, Recording(file), exit_status)


def await_start(operator: Operator, process: 'subprocess.Popen[bytes]') -> None:
    """Wait for a drive to start, perhaps after compiling, as long as its process lives."""

    def check() -> None:
        stop_if_asked()
        if process.poll() is not None:
            status = process.returncode
            raise StickSlipError(f'the drive ended with status {status}; see its log')

    operator.check = check
    state = operator.shake_hands(math.inf)
    if state != 'active':
        raise StickSlipError(f'the drive is {state}, not active; see its log')


@contextmanager
def _drive_process(settings: Path, domain: int) -> Iterator['subprocess.Popen[bytes]']:
    """Run the node in a separate process; end it by SIGINT with the context."""
    command = [sys.executable, '-W', UNANSWERED, '-m', 'stickslip_ros.ros.node']
    command += ['--ros-args', '--params-file', str(settings), '--log-level', 'warn']
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    process = subprocess.Popen(bound_to_parent(command), env=environment)
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
    operator = Operator(context)
    try:
        yield operator
    finally:
        operator.close()
        context.try_shutdown()


def _command(operator: Operator, parameters: Parameters, range_v: float) -> list[dict[str, Any]]:
    """Step freely, follow a voltage, step against the load cell; return the events of steps."""

    def order(name: str, *numbers: float) -> dict[str, Any]:
        before = len(operator.events)
        operator.command(name, numbers)
        return dict(operator.wait_for_event(name, before))

    def step(frequency_hz: float, count: int) -> dict[str, Any]:
        burst = order('sawtooth', range_v, frequency_hz, count)
        operator.spin_for(PAUSE_S)
        return burst

    operator.spin_for(PAUSE_S)
    free = step(FREE_HZ, FREE_STEPS)
    order('waveform', *_staircase(parameters.amplifier.voltage_min, 0.5 * range_v))
    push = step(PUSH_HZ, PUSH_STEPS)
    order('load', -_LOAD_SHARE * parameters.stand.preload)
    loaded = step(PUSH_HZ, LOADED_STEPS)
    order('load', 0.0)
    again = step(PUSH_HZ, LOADED_STEPS)
    operator.spin_for(PAUSE_S)
    return [free, push, loaded, again]


def _staircase(low_v: float, height_v: float) -> list[float]:
    """Return the rows of equal levels as a flat list: time, s, and voltage, V."""
    levels_v = low_v + height_v / RAMP_LEVELS * np.arange(RAMP_LEVELS + 1)
    begins_s = LEVEL_S * np.arange(RAMP_LEVELS)
    times_s = np.column_stack((begins_s, begins_s + RISE_S)).ravel()
    voltages_v = np.column_stack((levels_v[:-1], levels_v[1:])).ravel()
    rows = np.column_stack((times_s, voltages_v)).ravel().tolist()
    return [*rows, RAMP_LEVELS * LEVEL_S, float(levels_v[-1])]


def _summarise(
    operator: Operator, bursts: list[dict[str, Any]], recording: Recording, exit_status: int
) -> DemoSummary:
    position, force = recording.series('position'), recording.series('force')
    title = f'{NODE_NAME}: time'
    reports = [part[title] for part in operator.diagnostics if title in part]
    free, push, loaded, _ = bursts
    # At the middles of the second and of the last ramp the ringing is over, and delays are equal.
    middle_s, way_s = free['time_ns'] * NANO - 0.5 / FREE_HZ, (FREE_STEPS - 2) / FREE_HZ
    places_m = np.interp((middle_s - way_s, middle_s), position.time_s, position.value)
    return DemoSummary(
        steps=sum(burst['steps'] for burst in bursts),
        free_step_m=float(np.diff(places_m)[0]) / (FREE_STEPS - 2),
        force_n=_last(force, push),
        loaded_force_n=_last(force, loaded),
        behind_s=max(largest_lag_s(each) for each in reports),
        dropped=sum(channel.gaps or 0 for channel in recording.channels),
        exit_status=exit_status,
        recording=str(recording.path),
    )


def largest_lag_s(report: Mapping[str, str]) -> float:
    """Return the largest lag in a report, s; its lateness is NaN without ticks."""
    lags_s = float(report['lag_s']), float(report['behind_s'])
    return max(*lags_s, MICRO * float(report['lateness_max_us']))


def _last(force: Series, burst: dict[str, Any]) -> float:
    """Return the mean force over the last steps of a burst, N."""
    end_s = burst['time_ns'] * NANO
    return float(force.window(end_s - LAST_STEPS / PUSH_HZ, end_s).value.mean())
