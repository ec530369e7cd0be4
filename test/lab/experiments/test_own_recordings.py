# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings of this package as experiments: their commands and their sensors are known."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.comparison.result import Incomparable
from stickslip_ros.lab.experiments.experiment import Experiment, Voltage
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.experiments.sensor_clock import lateness_of
from stickslip_ros.lab.fitting.assumed import ASSUMED_SHARES
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import Free, choose_free
from stickslip_ros.lab.fitting.problem import pose
from stickslip_ros.lab.measurements.recorded import recorded_stand
from stickslip_ros.parameters import SENSORS, Parameters, load_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import ReportingBench, RunWriter

MS_NS = 1_000_000
REALISTIC = Path(__file__).parents[3] / 'config' / 'realistic.yaml'
Plan = Sequence[tuple[int, Request]]
WAVES: Plan = (
    (3, Request('sawtooth', (213.31360581535392, 1000.0, 12.0))),
    (17, Request('waveform', (0.0, 0.0, 1.13e-3, 113.76725643485543, 3.4e-3, 20.0))),
    (24, Request('sawtooth', (171.7, -730.0, 0.0))),
    (31, Request('stop')),
    (33, Request('steps', (-4.0,))),
    (40, Request('voltage', (37.3,))),
    (42, Request('waveform', (0.0, 9.0, 4e-4, 80.1, 9.7e-4, 9.0), cycles=5)),
)
"""In time, ms: every command whose voltage is a table, some cut off by the next."""


def recorded(
    path: Path, plan: Plan, stand: Parameters, lasts_ms: int = 50, begins_ms: int = 0
) -> Path:
    run = ReportingBench(stand)
    with RunWriter(path, stand, wait=True) as writer:
        while (now_ns := run.bench.time_ns) < lasts_ms * MS_NS:
            if now_ns == begins_ms * MS_NS:
                run.record(writer)
            due = [each for at_ms, each in plan if at_ms * MS_NS == now_ns]
            run.update(now_ns + stand.block_ns, due)
    return writer.recorder.path


def experiment_of(path: Path, **known) -> Experiment:
    stand = recorded_stand(Recording(path))
    [one] = read_experiments([path], stand, ReadingOptions(**known))
    return one


def said(one: Experiment) -> tuple[str, ...]:
    assert isinstance(one.drive, Voltage)
    return one.drive.notes


def misses(one: Experiment, stand: Parameters, late_s: float = 0.0) -> dict[str, float]:
    """Give what a stand misses, per noise of the default sensors, which is white."""
    [found] = predict(stand, [one.sensed(late_s=late_s)])
    noises = {
        each.quantity: getattr(stand, each.name).noise_density
        * (0.5 * stand.trace.sample_rate) ** 0.5
        for each in SENSORS
    }
    return {
        seen.quantity: float(np.std(each.values - seen.values)) / noises[seen.quantity]
        for each, seen in zip(found, one.observed, strict=True)
    }


FREE = {'load_cell.contact': 'absent'}
SLOW = {'amplifier.slew_rate': 3e7, 'amplifier.bandwidth': 8e4, 'actuator.hysteresis': 0.1}
LATER: Plan = ((30, Request('sawtooth', (213.3, 1000.0, 15.0))),)
BACKWARDS: Plan = ((0, Request('sawtooth', (213.3, -1000.0, 5.0))),)
LEVEL: Plan = ((0, Request('voltage', (150.0,))),)


@pytest.mark.parametrize(
    ('plan', 'changes', 'begins_ms'),
    [
        *((WAVES, each, 0) for each in ({}, FREE, SLOW)),
        *((LATER, {}, 20), (BACKWARDS, {}, 0), (LEVEL, {}, 0)),
    ],
    ids=['ideal', 'free', 'slow', 'begun before its first command', 'backwards', 'level'],
)
def test_the_stand_of_a_recording_misses_nothing_but_the_noise_of_its_sensors(
    plan: Plan, changes: dict[str, Any], begins_ms: int, tmp_path: Path
):
    stand = Parameters().updated(changes)
    one = experiment_of(recorded(tmp_path / 'run.mcap', plan, stand, begins_ms=begins_ms))
    assert said(one) == ('as commanded',)
    found = misses(one, stand)
    assert ('force_n' in found) == (changes is not FREE)
    for quantity, missed in found.items():
        assert missed == pytest.approx(1.0, abs=0.12), quantity
    if plan is WAVES:
        other = stand.updated({'contact.friction': 1.02 * stand.contact.friction})
        assert misses(one, other)['position_m'] > 1.5, 'else nothing is tested'


@pytest.mark.parametrize('seed', [1, 2])
def test_the_cyclic_error_of_its_interferometer_pulls_no_parameter(seed, tmp_path):
    changes = {'actuator.resonance': 1.5e5, 'amplifier.bandwidth': 2e5, 'runner.damping': 20.0}
    optics = {'interferometer.cyclic_error': 1e-9, 'sim.seed': seed}
    stand = Parameters().updated({**FREE, **changes, **optics})
    plan = ((1, Request('sawtooth', (250.0, 1000.0, 8.0))),)
    one = experiment_of(recorded(tmp_path / 'run.mcap', plan, stand, 12))
    _, free, _ = choose_free(stand, ['contact.friction', 'runner.mass', *changes])
    problem = replace(pose(stand, free, [one]), noise=(5e-10,))
    [shown] = problem.predicted([stand])
    problem = problem.measured_at(shown)
    slopes = problem.slopes(problem.start)
    covariance = np.linalg.inv(slopes.T @ slopes)
    pulled = covariance @ (slopes.T @ problem.residuals(problem.start))
    assert np.all(np.abs(pulled) < 2.0 * np.sqrt(np.diag(covariance)))


def test_large_falls_before_small_ones_make_no_clock_late(tmp_path):
    stand = load_yaml(REALISTIC)
    saws = (
        (1, Request('sawtooth', (250.0, 1000.0, 8.0))),
        (10, Request('sawtooth', (150.0, 1000.0, 7.0))),
    )
    one = experiment_of(recorded(tmp_path / 'run.mcap', saws, stand, 25))
    assert isinstance(one.drive, Voltage)
    assert not lateness_of(one.observed[0], one.drive).is_clear


def test_a_stretch_begins_in_the_middle_of_a_wave(tmp_path):
    stand = Parameters().updated(FREE)
    load, endless = Request('load', (0.05, *(0.0,) * 5)), Request('sawtooth', (213.3, 1000.0, 0.0))
    path = recorded(tmp_path / 'run.mcap', ((0, load), *WAVES, (50, endless)), stand, 140)
    one = experiment_of(path, window_s=(0.11, 0.13))
    assert one.load_n == 0.05
    assert misses(one, stand)['position_m'] == pytest.approx(1.0, abs=0.12)


def test_a_model_is_compared_behind_the_low_pass_of_the_sensors(tmp_path):
    stand = Parameters()
    found = compare(recorded(tmp_path / 'run.mcap', WAVES, stand), stand)
    for quantity, most in (('position_m', 1.6e-10), ('force_n', 6e-5)):
        [one] = [each for each in found.quantities if each.name == quantity]
        [part] = one.parts
        assert np.std(part.a - part.b) < most, 'noise behind a low-pass: 0.15 nm, 0.055 mN'


def test_a_model_is_told_as_the_stand_that_was_run(tmp_path):
    stand = Parameters().updated({'load_cell.contact': 'absent', 'stand.preload': 0.35})
    path = recorded(tmp_path / 'run.mcap', WAVES, stand)
    found = compare(path, Parameters())
    assert found.b.changed == {'load_cell.contact': 'absent', 'stand.preload': 0.35}
    for given in (CompareOptions(frequency_hz=500.0), CompareOptions(steps=10)):
        with pytest.raises(Incomparable, match='is over time: its voltage gives frequency'):
            compare(path, Parameters(), options=given)


def test_a_window_cuts_off_the_force_that_steps_before_it_have_built_up(tmp_path):
    plan = ((0, Request('sawtooth', (213.3, 1000.0, 0.0))),)
    path = recorded(tmp_path / 'run.mcap', plan, Parameters(), 100)
    [note] = experiment_of(path, window_s=(0.07, 0.09)).notes
    assert (
        'the run begins 50 ms before the window, at rest, without the force of earlier steps'
        in note
    )
    assert experiment_of(path, window_s=(0.0, 0.09)).notes == ()


def test_of_a_closed_loop_the_wave_in_the_voltage_is_recognised(tmp_path):
    plan = ((0, Request('jog', (1000.0,))), (9, Request('jog', (0.0,))))
    one = experiment_of(recorded(tmp_path / 'run.mcap', plan, Parameters(), 20))
    assert 'cycles of a saw-tooth forwards' in said(one)[0]


@pytest.mark.parametrize(
    'move', [Request('sawtooth', (213.3, 1000.0, 9.0)), Request('jog', (1000.0,))]
)
def test_a_recording_keeps_the_range_of_its_amplifier(move, tmp_path):
    stand = Parameters().updated({'amplifier.voltage_min': -150.0, 'amplifier.voltage_max': 150.0})
    path = recorded(tmp_path / 'run.mcap', ((1, move),), stand, 12)
    [one] = read_experiments([path], Parameters(), ReadingOptions())
    assert isinstance(one.drive, Voltage)
    assert one.drive.rows[:, 1].min() < -140.0
    [shown] = predict(Parameters(), [one])
    assert np.ptp(shown[0].values) > 0.0
    own = Parameters().updated(dict(one.settings)).amplifier
    assert (own.voltage_min, own.voltage_max) == (-150.0, 150.0)


def test_a_voltage_that_did_not_follow_its_commands_is_recognised(tmp_path):
    stand = Parameters().updated({'fault.missed_steps': 0.3})
    plan = ((0, Request('sawtooth', (213.3, 1000.0, 30.0))),)
    one = experiment_of(recorded(tmp_path / 'run.mcap', plan, stand, 40))
    assert 'commanded' not in said(one)[0]


@pytest.mark.parametrize(
    'change',
    [
        Request('load', (0.1, *(0.0,) * 5)),
        Request('preload', (0.5,)),
        Request('zero_position'),
        Request('parameters', settings=(('runner.mass', 0.012),)),
        Request('fault', settings=(('fault.interferometer', 'freeze'),)),
    ],
    ids=lambda each: each.name,
)
def test_what_changes_the_stand_within_a_stretch_is_refused_by_its_name(change, tmp_path):
    plan = ((0, Request('sawtooth', (213.3, 1000.0, 0.0))), (11, change))
    path = recorded(tmp_path / 'run.mcap', plan, Parameters(), 20)
    with pytest.raises(RecordingError, match=rf'command {change.name} at 0\.011 s.*--window'):
        experiment_of(path)


def test_what_changed_before_a_stretch_holds_in_it_and_an_equal_value_changes_nothing(tmp_path):
    heavy = ('runner.mass', 0.012), ('step.amplitude', 213.3)
    plan = (
        (0, Request('parameters', settings=heavy)),
        (5, Request('steps', (40.0,))),
        (11, Request('parameters', settings=heavy)),
    )
    stand = Parameters().updated(FREE)
    path = recorded(tmp_path / 'run.mcap', plan, stand, 50)
    one = experiment_of(path, window_s=(0.01, 0.05))
    assert said(one)[0] == 'as commanded'
    assert misses(one, stand.updated({'runner.mass': 0.012}))['position_m'] < 1.2
    assert misses(one, stand)['position_m'] > 1.5


def test_a_sensor_that_holds_its_samples_keeps_its_low_pass(tmp_path):
    stand = Parameters().updated({'interferometer.sample_rate': 10e3})
    plan = ((0, Request('sawtooth', (213.3, 1000.0, 0.0))),)
    one = experiment_of(recorded(tmp_path / 'run.mcap', plan, stand, 20))
    assert [each.sensor.undone_hz for each in one.observed] == [0.0, 2000.0]


def test_a_recording_with_a_load_cell_is_fitted_to_the_noise(tmp_path):
    plan = ((0, Request('sawtooth', (213.31360581535392, 1000.0, 40.0))),)
    path = recorded(tmp_path / 'run.mcap', plan, Parameters(), 45)
    exact = dict.fromkeys(ASSUMED_SHARES, '+-0%')
    options = FitOptions(starts=2, assume=exact)
    found = fit(path, Free('contact.friction', start=0.25), options=options)
    assert found.holds
    [friction] = found.estimates
    assert abs(friction.value - 0.3) < 3.0 * friction.standard_error < 1e-3
    assert any(
        note.endswith('force_n: the low-pass of its sensor, 2000 Hz, was undone')
        for note in found.notes
    )
