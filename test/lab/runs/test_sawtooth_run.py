# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A saw-tooth run without ROS: what it reports, when it is steady, its file, what it refuses."""

import dataclasses
import math
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap_records import rows_of

from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.drive.ledger import EnergyLedger
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongKind
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.lab.runs.sawtooth_run import (
    STEADY_ERROR,
    STEADY_STEPS_MAX,
    STEADY_STEPS_MIN,
    force_at_n,
    is_steady,
    is_steered_by_requests,
    relative_residual,
    run_drive,
    scatter_of,
    simulate,
    start_on_wave,
    step_length_m,
    voltage_for,
)
from stickslip_ros.parameters import AmplifierParameters, Parameters, dump_yaml, parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import RUN_RECORD

ROUNDING = 1e-12
MIRROR = 1e-9
"""A voltage from the upper end has fewer digits than one from zero."""
FORCE_ERROR = 0.01
"""Of a reference force that is given to the millinewton."""
MEASURED = ('wall_s', 'real_time_factor')
AMPLITUDE_M, FREQUENCY_HZ, STEPS = 160e-9, 1000.0, 220
# The stand cuts time at its samples, which moves steps by less than the error of the default step.
OTHER_STEPS = 2e-4

STIFFNESS_N_PER_M, GAP_M = 1e5, 2e-7
PRESSED = {'load_cell.contact': 'one_sided', 'load_cell.gap': GAP_M}
HELD = plant_of(Parameters())[0]
FREE = plant_of(Parameters().updated({'load_cell.contact': 'absent'}))[0]
BEHIND_GAP = plant_of(Parameters().updated(PRESSED))[0]
FOLLOWING_ERROR = 0.1
"""Of k A: a little of the contacts slips from the first nanometre on."""
SAME_FORCE = 2e-3
"""A one-sided load cell is met in short steps, a fixed one in long ones."""


def _computed(result: SawtoothRun) -> dict:
    """Return what does not depend on the machine or on the file."""
    return {
        name: value
        for name, value in dataclasses.asdict(result).items()
        if name not in {*MEASURED, 'recording'}
    }


def ran(stand: Parameters, **how: Any) -> SawtoothRun:
    """Return what a run comes to that nobody records."""
    return simulate(stand, **how, record=False).result


def test_a_run_reports_what_was_asked_for_and_what_came_of_it(recorded_run):
    result, path = recorded_run
    assert set(dataclasses.asdict(result)) == {
        'preload_n', 'voltage_v', 'amplitude_m', 'frequency_hz', 'force_mean_n',
        'force_net_n', 'force_ramp_start_n', 'step_length_m', 'step_scatter_m',
        'step_correlation_m', 'steady', 'steps', 'simulated_s',
        'wall_s', 'real_time_factor', 'energy_residual', 'recording',
    }  # fmt: skip
    assert (result.preload_n, result.voltage_v, result.frequency_hz) == (0.5, 300.0, 1000.0)
    assert result.amplitude_m == pytest.approx(160e-9, rel=ROUNDING, abs=0.0)
    assert result.steps == 20
    assert not result.steady
    # The last fall ends behind 20 ms; a recording goes on to the end of its block of 10 ms.
    assert result.simulated_s == pytest.approx(0.03, rel=ROUNDING, abs=0.0)
    assert result.real_time_factor == pytest.approx(
        result.simulated_s / result.wall_s, rel=ROUNDING, abs=0.0
    )
    assert result.recording == str(path)
    assert abs(result.energy_residual) < 1e-3


def test_recording_a_run_does_not_change_it(recorded_run, stand):
    silent = _computed(ran(stand, voltage_v=300.0, steps=20))
    recorded = _computed(recorded_run[0])
    assert silent.pop('simulated_s') == pytest.approx(0.021, rel=ROUNDING, abs=0.0)
    # The energy balance is that of the end, which a recording puts off.
    for result in (silent, recorded):
        result.pop('energy_residual')
    recorded.pop('simulated_s')
    assert silent == recorded


@pytest.mark.parametrize('contact', ['attached', 'absent'])
def test_a_run_backwards_is_the_mirror_image(contact, stand):
    stand = stand.updated({'load_cell.contact': contact})
    forwards, backwards = (
        ran(stand, voltage_v=300.0, frequency_hz=sign * 1000.0, steps=15) for sign in (1.0, -1.0)
    )
    assert forwards.step_length_m > 0.0
    names = ('force_mean_n', 'force_net_n', 'force_ramp_start_n', 'step_length_m', 'frequency_hz')
    for name in names:
        there, back = getattr(forwards, name), getattr(backwards, name)
        assert back == pytest.approx(-there, rel=MIRROR, abs=0.0)
    assert backwards.steps == forwards.steps


@pytest.mark.parametrize(('preload_n', 'mean_n'), [(0.1, 0.061), (0.5, 0.172), (1.0, 0.224)])
def test_a_run_without_a_number_of_steps_goes_on_until_it_is_steady(preload_n, mean_n, stand):
    result = ran(stand.updated({'stand.preload': preload_n}), voltage_v=300.0)
    assert result.steady
    assert STEADY_STEPS_MIN <= result.steps <= STEADY_STEPS_MAX
    assert result.force_mean_n == pytest.approx(mean_n, rel=FORCE_ERROR, abs=0.0)
    assert result.force_ramp_start_n > result.force_mean_n


def test_below_the_0_amplitude_the_force_without_elastic_following_vanishes(stand):
    below_m = 40e-9
    result = run_drive(stand.updated({'runner.damping': 80.0}), below_m, FREQUENCY_HZ)
    following_n = STIFFNESS_N_PER_M * below_m
    assert abs(result.force_net_n) < FOLLOWING_ERROR * following_n
    # Right after the fall the runner still stands where the ramp left it.
    assert result.force_ramp_start_n == pytest.approx(following_n, rel=FOLLOWING_ERROR, abs=0.0)


@pytest.mark.parametrize('cell_n_per_m', [1e5, 3e6])
@pytest.mark.parametrize(
    ('law', 'stick_n_per_m'), [('mdr', 0.0), ('dahl', 2e6), ('coulomb', math.inf)]
)
def test_elastic_following_is_that_of_cell_and_contacts_in_series(
    law, stick_n_per_m, cell_n_per_m, stand
):
    bristles = {'contact.law': law, 'friction_law.bristle_stiffness': 2e6}
    cell = {'load_cell.stiffness': cell_n_per_m, 'runner.damping': 80.0}
    stand = stand.updated({**bristles, **cell})
    stick_n_per_m = stick_n_per_m or sum(
        each.stick_stiffness_n_per_m for each in contacts_of(stand)
    )
    result = run_drive(stand, 20e-9, FREQUENCY_HZ)
    half_n = 0.5 * 20e-9 / (1.0 / cell_n_per_m + 1.0 / stick_n_per_m)
    assert result.force_mean_n - result.force_net_n == pytest.approx(half_n, rel=3e-4)
    # Bristles slide at any amplitude: only the contact model has a 0-amplitude.
    assert law != 'mdr' or abs(result.force_net_n) < FOLLOWING_ERROR * half_n


def test_a_load_cell_that_nothing_presses_has_no_net_force(stand):
    behind = stand.updated(PRESSED)
    assert run_drive(behind, 40e-9, FREQUENCY_HZ, 2).force_net_n == 0.0
    pressed = run_drive(behind, AMPLITUDE_M, FREQUENCY_HZ, 12)
    following_n = STIFFNESS_N_PER_M * pressed.amplitude_m
    left_n = pressed.force_mean_n - pressed.force_net_n
    assert 0.97 * 0.5 * following_n < left_n < 0.5 * following_n


def test_a_free_runner_has_no_force_but_steps(stand):
    result = ran(
        stand.updated({'load_cell.contact': 'absent'}), voltage_v=300.0, frequency_hz=200.0
    )
    assert result.steady
    assert result.force_mean_n == result.force_net_n == result.force_ramp_start_n == 0.0
    zero_amplitude_m, within_m = 66e-9, 2e-9  # both to the nanometre, and ringing
    assert result.step_length_m == pytest.approx(160e-9 - zero_amplitude_m, rel=0.0, abs=within_m)


@pytest.mark.parametrize(('preload_n', 'known_n'), [(0.5, 0.332), (1.0, 0.569)])
def test_piezos_that_ring_generate_the_known_force(preload_n, known_n, stand):
    """Known: 150 kHz, D = 0.1, from a simulation of every spring in C."""
    rings = {'actuator.resonance': 150e3, 'actuator.damping_ratio': 0.1}
    rung = stand.updated({**rings, 'stand.preload': preload_n})
    assert run_drive(rung, 160e-9, 1000.0).force_mean_n == pytest.approx(known_n, rel=2e-3)


def test_progress_is_told_up_to_the_number_of_steps(stand):
    told = []

    def tell(done: int, wanted: int) -> None:
        told.append((done, wanted))

    alone = stand.updated({'limits.soft_min': -1e-3, 'limits.soft_max': 1e-3})
    ran(alone, voltage_v=300.0, steps=12, progress=tell)
    assert told == [(steps, 12) for steps in range(1, 13)]
    told.clear()
    ran(stand, voltage_v=300.0, steps=12, progress=tell)
    assert told == [(steps, 12) for steps in (1, 10, 11, 12)]  # ten blocks go together
    told.clear()
    ran(stand, voltage_v=300.0, progress=tell)
    assert {wanted for _, wanted in told} == {0}


@pytest.mark.parametrize(
    ('voltage_v', 'frequency_hz', 'steps', 'kind', 'message'),
    [
        (301.0, 1000.0, 5, OutOfRange, "amplitude 301 V is above the amplifier's 300 V"),
        (300.0, 0.0, 5, OutOfRange, 'frequency 0 Hz is not a frequency'),
        (300.0, 1000.0, -5, OutOfRange, 'steps -5 is not a whole number'),
        (math.nan, 1000.0, 5, WrongKind, 'nan is not a finite number'),
    ],
)
def test_a_run_that_the_stand_cannot_make_is_refused_before_a_file_is_made(
    voltage_v, frequency_hz, steps, kind, message, stand, tmp_path
):
    path = tmp_path / 'run.mcap'
    with pytest.raises(kind) as caught:
        simulate(stand, voltage_v=voltage_v, frequency_hz=frequency_hz, steps=steps, record=path)
    assert message in str(caught.value)
    assert not path.exists()


def test_a_drive_rests_where_its_wave_starts_unless_told_otherwise(stand):
    backwards = check_request(Request('sawtooth', (240.0, -100.0, 5.0)), Parameters())
    assert start_on_wave(stand, backwards).amplifier.voltage_initial == 240.0
    chosen = stand.updated({'amplifier.voltage_initial': 100.0})
    assert start_on_wave(chosen, backwards) == chosen


@pytest.mark.parametrize(
    'chosen',
    [
        Parameters(amplifier=AmplifierParameters(voltage_initial=0.0)),
        Parameters().updated({'amplifier.voltage_initial': 0.0}),
        Parameters().updated({'amplifier.voltage_initial': '0.0'}),
        parse_yaml('/**: {ros__parameters: {amplifier: {voltage_initial: 0.0}}}', 'text'),
        parse_yaml(dump_yaml(Parameters(), ''), 'a file with every parameter'),
    ],
)
def test_a_default_that_was_chosen_counts_and_others_leave_the_choice_open(chosen):
    backwards = check_request(Request('sawtooth', (240.0, -100.0, 5.0)), Parameters())
    chosen = pickle.loads(pickle.dumps(chosen.updated({'amplifier.slew_rate': 1e7})))
    assert start_on_wave(chosen, backwards) is chosen
    assert chosen == Parameters().updated({'amplifier.slew_rate': 1e7})
    unchosen = pickle.loads(pickle.dumps(Parameters().updated({'amplifier.slew_rate': 1e7})))
    assert start_on_wave(unchosen, backwards).amplifier.voltage_initial == 240.0


def test_the_residual_is_relative_to_the_work_of_the_feet():
    ledger = EnergyLedger(10.0, 1.0, 2.0, 3.0, 1.0, 3.0, 1.0)
    assert ledger.residual_j == 1.0
    assert relative_residual(ledger) == 0.1
    assert relative_residual(ledger._replace(feet_work_j=0.0)) == 0.0


def test_a_stroke_is_turned_into_volts(stand):
    assert voltage_for(stand, 80e-9) == pytest.approx(150.0, rel=ROUNDING, abs=0.0)
    bipolar = stand.updated({'amplifier.voltage_min': -300.0})
    assert voltage_for(bipolar, 320e-9) == pytest.approx(600.0, rel=ROUNDING, abs=0.0)


@pytest.mark.parametrize(
    ('stroke_m', 'hint'), [(161e-9, 'lower it'), (160.0, 'lower it; 160 nm is 1.6e-07 m')]
)
def test_a_stroke_beyond_the_amplifier_is_refused(stroke_m, hint, stand):
    with pytest.raises(OutOfRange) as caught:
        voltage_for(stand, stroke_m)
    assert str(caught.value) == (
        f'amplitude {stroke_m:.6g} m is above the 1.6e-07 m that the amplifier reaches; {hint}'
    )


def test_a_run_whose_recording_is_deleted_ends_and_says_so(stand, tmp_path):
    path = tmp_path / 'run.mcap'

    def delete(done: int, wanted: int) -> None:
        path.unlink(missing_ok=True)

    with pytest.raises(RecordingError, match='it was deleted, moved or replaced'):
        simulate(stand, voltage_v=300.0, steps=20, record=path, progress=delete)


@pytest.mark.parametrize('end_n', [0.0, 0.3, 1.0])
def test_a_preload_ramp_is_the_same_with_and_without_sensors(end_n: float):
    ramp = {'stand.preload': 0.5, 'stand.preload_end': end_n, 'stand.preload_rate': 10.0}
    parameters = Parameters().updated(ramp)
    alone = run_drive(parameters, AMPLITUDE_M, FREQUENCY_HZ, STEPS)
    stand = ran(parameters, amplitude_m=AMPLITUDE_M, frequency_hz=FREQUENCY_HZ, steps=STEPS)
    assert alone.preload_n == pytest.approx(end_n or 0.5, rel=1e-12)
    assert alone.force_mean_n == pytest.approx(stand.force_mean_n, rel=OTHER_STEPS)


def _ramps(values, column=1):
    ramps = np.zeros((len(values), 3))
    ramps[:, column] = values
    return ramps


def test_a_run_on_the_load_cell_is_steady_when_its_mean_position_is():
    flat = np.ones(STEADY_STEPS_MIN)
    assert is_steady(HELD, _ramps(flat))
    assert not is_steady(HELD, _ramps(flat[1:]))
    count = np.arange(STEADY_STEPS_MIN + 500)
    for cycles in (30.0, 200.0, 900.0):
        for error, steady in ((0.9 * STEADY_ERROR, True), (1.1 * STEADY_ERROR, False)):
            ways = 1.0 - error * np.exp((count[-1] - count) / cycles)
            assert is_steady(HELD, _ramps(ways)) is steady
            assert is_steady(HELD, _ramps(-ways)) is steady
    assert not is_steady(HELD, _ramps(1e-4 * count))


@pytest.mark.parametrize(
    ('cell_n_per_m', 'preload_n', 'amplitude_m', 'frequency_hz'),
    [(3e4, 1.0, 113e-9, 200.0), (3e4, 0.37, 87.3e-9, 1000.0), (1e5, 1.0, 160e-9, 713.0)],
)
def test_a_steady_force_is_that_of_4000_cycles(
    cell_n_per_m, preload_n, amplitude_m, frequency_hz, stand
):
    stand = stand.updated({'load_cell.stiffness': cell_n_per_m, 'stand.preload': preload_n})
    steady = run_drive(stand, amplitude_m, frequency_hz)
    assert steady.steady
    long = run_drive(stand, amplitude_m, frequency_hz, 4000)
    assert steady.force_mean_n == pytest.approx(long.force_mean_n, rel=5e-4, abs=0.0)


def test_a_free_run_is_steady_when_its_step_length_is():
    count = np.arange(STEADY_STEPS_MIN + 50)
    assert is_steady(FREE, _ramps(1e-9 * count, column=2))
    assert not is_steady(FREE, _ramps(1e-9 * count**1.1, column=2))
    assert not is_steady(FREE, _ramps(1e-9 * count[:100], column=2))


def test_the_step_length_is_the_mean_of_the_last_ten():
    ends = np.concatenate((np.zeros(50), np.arange(1.0, 11.0)))
    assert step_length_m(_ramps(ends, column=2)) == 1.0
    assert step_length_m(_ramps([3.0, 8.0], column=2)) == 4.0


def test_even_steps_and_a_single_one_do_not_scatter():
    even_m = scatter_of(np.diff(1e-7 * np.arange(20_000)))
    assert even_m[0] < 1e-15
    assert even_m[1] == 0.0
    assert scatter_of(np.array([1e-7])) == (0.0, 0.0)


@pytest.mark.parametrize('count', [2, 3, 64, 65, 1000])
def test_a_correlation_length_is_that_of_the_sums_of_products(count):
    steps_m = 1e-7 + np.cumsum(np.random.default_rng(count).normal(scale=1e-9, size=count))
    deviations_m = steps_m - steps_m.mean()
    products = np.array([deviations_m[: count - lag] @ deviations_m[lag:] for lag in range(count)])
    after = int(np.argmax(products < products[0] / np.e))
    drop = products[after - 1] - products[after]
    lag = after - (products[0] / np.e - products[after]) / drop
    expected_m = (steps_m.std(), steps_m.mean() * lag)
    assert scatter_of(steps_m) == pytest.approx(expected_m, rel=ROUNDING)


def test_forces_are_those_of_the_load_cell_that_there_is():
    ramps = np.array([[0.0, 0.0, 0.0], [5e-7, 3e-7, 6e-7]])
    stiff = STIFFNESS_N_PER_M
    for plant, mean_n, start_n in (
        (HELD, stiff * 3e-7, stiff * 5e-7),
        (FREE, 0.0, 0.0),
        (BEHIND_GAP, stiff * (3e-7 - GAP_M), stiff * (5e-7 - GAP_M)),
    ):
        assert force_at_n(plant, ramps[-1, RAMP_MEAN]) == pytest.approx(mean_n, rel=ROUNDING)
        assert force_at_n(plant, ramps[-1, 0]) == pytest.approx(start_n, rel=ROUNDING)
        assert force_at_n(plant, ramps[0, RAMP_MEAN]) == 0.0


def test_a_run_that_has_not_come_to_the_load_cell_is_not_steady():
    assert not is_steady(BEHIND_GAP, _ramps(np.full(STEADY_STEPS_MIN, 0.5 * GAP_M)))
    assert is_steady(BEHIND_GAP, _ramps(np.full(STEADY_STEPS_MIN, 2.0 * GAP_M)))


@pytest.mark.parametrize('run', ['drive', 'bench'])
def test_behind_a_gap_the_drive_presses_as_hard_as_when_it_is_fixed(run, stand):
    pressed = stand.updated(PRESSED)
    fixed, behind = (
        run_drive(each, 160e-9, 1000.0) if run == 'drive' else ran(each, voltage_v=300.0)
        for each in (stand, pressed)
    )
    assert behind.steady
    assert behind.force_mean_n == pytest.approx(fixed.force_mean_n, rel=SAME_FORCE)
    assert behind.force_ramp_start_n == pytest.approx(fixed.force_ramp_start_n, rel=SAME_FORCE)


@pytest.fixture(scope='module')
def again(tmp_path_factory) -> Path:
    """Give another recording of the run that `recorded_run` gives."""
    path = tmp_path_factory.mktemp('again') / 'other_name.mcap'
    simulate(Parameters(), voltage_v=300.0, steps=20, record=path)
    return path


def test_two_recordings_of_a_run_differ_only_in_the_wall_clock_time(recorded_run, again):
    one, other = recorded_run[1], again
    assert rows_of(one) == rows_of(other)
    one, other = Recording(one), Recording(other)
    assert one.attachments == other.attachments
    runs = [dict(each.metadata[RUN_RECORD], wall_start='') for each in (one, other)]
    assert runs[0] == runs[1]
    assert {**one.metadata, RUN_RECORD: {}} == {**other.metadata, RUN_RECORD: {}}


@pytest.mark.parametrize(
    ('settings', 'frequency_hz', 'steps'),
    [
        ({'capacitive_probe.enabled': True, 'sim.joint_states_rate': 3000.0 / 7.0}, 917.3, 73),
        ({'trace.sample_rate': 1e4, 'sim.block': 1e-4}, 917.3, 73),
        ({}, -7.3, 2),  # ends far from where blocks that go together end
    ],
)
def test_blocks_that_go_together_leave_the_bytes_of_blocks_that_go_alone(
    settings: dict[str, float], frequency_hz: float, steps: int, monkeypatch, tmp_path
):
    stand = Parameters().updated(settings)
    lengths_ns: list[set[int]] = []
    for name in ('together', 'alone'):
        ends_ns: list[int] = [0]
        update = Bench.update

        def noted(bench: Bench, until_ns: int, *rest: Any, update=update, ends_ns=ends_ns) -> Any:
            ends_ns.append(until_ns)
            return update(bench, until_ns, *rest)

        with monkeypatch.context() as patched:
            patched.setattr(Bench, 'update', noted)
            if name == 'alone':
                module = 'stickslip_ros.lab.runs.sawtooth_run'
                patched.setattr(f'{module}.is_steered_by_requests', lambda *_, **__: False)
            path = tmp_path / name
            simulate(stand, voltage_v=87.3, frequency_hz=frequency_hz, steps=steps, record=path)
        lengths_ns.append(set(np.diff(ends_ns).tolist()))
    assert max(lengths_ns[0]) == stand.trace_period_ns
    assert lengths_ns[1] == {stand.block_ns}
    assert rows_of(tmp_path / 'together') == rows_of(tmp_path / 'alone')


@pytest.mark.parametrize(
    'settings',
    [
        {'limits.soft_max': 1e-6, 'limits.soft_min': -1e-6},
        {'load_cell.range': 1e-3},
        {'interferometer.velocity_max': 1e-6},
        {'stand.preload_end': 0.7},
        {'sim.publish_truth': True},
        {'record.split_duration': 1.0},
        {'fault.command_delay': 3e-3},
        {'trace.period': 0.2},
    ],
)
def test_what_may_change_between_two_requests_is_recorded_block_by_block(settings: dict):
    assert is_steered_by_requests(Parameters(), is_recorded=True)
    assert not is_steered_by_requests(Parameters().updated(settings), is_recorded=True)


def test_a_command_that_comes_late_makes_its_steps_whether_recorded_or_not():
    late = Parameters().updated({'fault.command_delay': 3e-3})
    counted = [
        simulate(late, voltage_v=100.0, steps=30, record=recorded).result
        for recorded in (True, False)
    ]
    assert [each.steps for each in counted] == [30, 30]
    assert counted[0].force_mean_n == counted[1].force_mean_n


def test_the_recording_holds_what_the_bench_tells(recorded_run, stand):
    bench, request = Bench(stand), [Request('sawtooth', (300.0, 1000.0, 20.0))]
    blocks = []
    for _ in range(30):
        blocks.append(bench.update(bench.time_ns + stand.block_ns, request).readings.trace)
        request = []
    told = np.concatenate(blocks)
    trace = Recording(recorded_run[1]).trace()
    np.testing.assert_array_equal(trace['position'].time_s, told[:, 0])
    for column, name in enumerate(('voltage', 'foot', 'position', 'force'), start=1):
        np.testing.assert_array_equal(trace[name].value, told[:, column])


def test_the_recording_explains_itself(recorded_run):
    recording = Recording(recorded_run[1])
    _, text = recording.attachments['parameters.yaml']
    assert parse_yaml(text.decode(), 'attachment') == Parameters()
    run = recording.metadata['stickslip_run']
    assert (run['seed'], run['dt_s']) == ('1', '5e-06')
    (command,) = recording.messages(['command/sawtooth'])
    assert command[1] == 0
    assert isinstance(command[2], ArrayMessage)
    assert command[2].data.tolist() == [300.0, 1000.0, 20.0]


def as_the_amplifier_gives_it(amplitude_v: float, frequency_hz: float, stand: Parameters):
    """Return one cycle of a saw-tooth, from one top to the next, with its slewed fall."""
    slope_v_per_s = amplitude_v * frequency_hz
    fall_s = amplitude_v / (slope_v_per_s + stand.amplifier.slew_rate)
    bottom = (fall_s, slope_v_per_s * fall_s)
    return np.array(((0.0, amplitude_v), bottom, (1.0 / frequency_hz, amplitude_v)))


@pytest.mark.parametrize('stretch', [1.0, 0.37])
def test_a_waveform_of_the_same_shape_gives_the_force_of_a_saw_tooth(stretch, tmp_path):
    stand = Parameters()
    rows = as_the_amplifier_gives_it(300.0, 1000.0, stand) * np.array((stretch, 1.0))
    path = tmp_path / 'wave.mcap'
    played = simulate(stand, waveform=rows, frequency_hz=1000.0, record=path).result
    stepped = ran(stand, voltage_v=300.0)
    assert played.steps == stepped.steps
    assert played.force_mean_n == pytest.approx(stepped.force_mean_n, rel=1e-4)
    assert played.frequency_hz == 1000.0
    assert played.voltage_v == pytest.approx(300.0 - rows[1, 1])
    assert replay(path, tmp_path / 'again.mcap').identical


def test_the_net_force_of_a_waveform_is_0_while_its_runner_only_goes_along():
    rows = np.array(((0.0, 7.0), (1e-4, 37.0), (9e-4, 37.0), (1e-3, 7.0)))
    stand = Parameters().updated({'runner.damping': 80.0})
    run = ran(stand, waveform=rows, steps=300)
    following_n = STIFFNESS_N_PER_M * stand.actuator.gain * 0.9 * 30.0
    assert run.force_mean_n == pytest.approx(following_n, rel=0.02)
    assert abs(run.force_net_n) < 0.02 * following_n


def test_the_times_of_a_waveform_hold_where_no_frequency_is_given():
    rows = ((0.0, 10.0), (1.7e-3, 200.0), (2.113e-3, 10.0))
    run = ran(Parameters(), waveform=np.array(rows), steps=3)
    assert run.frequency_hz == pytest.approx(1.0 / 2.113e-3)
    assert run.steps == 3


@pytest.mark.parametrize('frequency_hz', [0.0, -3.0, np.inf, np.nan])
def test_a_waveform_has_a_frequency_above_0(frequency_hz: float):
    with pytest.raises(StickSlipError, match=r'not above 0; turn the wave|finite number'):
        ran(Parameters(), waveform=np.array(((0.0, 0.0), (1e-3, 0.0))), frequency_hz=frequency_hz)


@pytest.mark.parametrize(('record', 'is_synced'), [('run.mcap', True), (True, False)])
def test_only_a_file_that_outlives_the_run_is_synced_to_the_disk(
    record, is_synced, stand, tmp_path, monkeypatch
):
    synced = list[int]()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, 'fsync', synced.append)
    run = simulate(stand, amplitude_m=130e-9, steps=2, record=record)
    assert any(run.recording.messages())
    assert bool(synced) == is_synced
