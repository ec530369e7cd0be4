"""A saw-tooth run without ROS: what it reports, when it is steady, what it refuses."""

import dataclasses
import math
import pickle

import pytest

from stickslip_ros.drive.ledger import EnergyLedger
from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import AmplifierParameters, Parameters, dump_yaml, parse_yaml
from stickslip_ros.study.ramps import STEADY_STEPS_MAX, STEADY_STEPS_MIN
from stickslip_ros.study.sawtooth_run import (
    SawtoothRun,
    relative_residual,
    run_sawtooth,
    start_on_wave,
    voltage_for,
)

ROUNDING = 1e-12
MIRROR = 1e-9
"""A voltage from the upper end has fewer digits than one from zero."""
FORCE_ERROR = 0.01
"""Of a reference force that is given to the millinewton."""
MEASURED = ('wall_s', 'real_time_factor')


def _computed(result: SawtoothRun) -> dict:
    """Return what does not depend on the machine or on the file."""
    return {
        name: value
        for name, value in dataclasses.asdict(result).items()
        if name not in {*MEASURED, 'recording'}
    }


def test_a_run_reports_what_was_asked_for_and_what_came_of_it(recorded_run):
    result, path = recorded_run
    assert set(dataclasses.asdict(result)) == {
        'preload_n', 'voltage_v', 'amplitude_m', 'frequency_hz', 'force_mean_n',
        'force_ramp_start_n', 'step_length_m', 'steady', 'steps', 'simulated_s', 'wall_s',
        'real_time_factor', 'energy_residual', 'recording',
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
    silent = _computed(run_sawtooth(stand, 300.0, 1000.0, 20))
    recorded = _computed(recorded_run[0])
    assert silent.pop('simulated_s') == pytest.approx(0.021, rel=ROUNDING, abs=0.0)
    # The energy balance is that of the end, which a recording puts off.
    for result in (silent, recorded):
        result.pop('energy_residual')
    recorded.pop('simulated_s')
    assert silent == recorded


def test_two_runs_report_the_same(stand):
    one, other = (_computed(run_sawtooth(stand, 240.0, 333.0, 7)) for _ in range(2))
    assert one == other


@pytest.mark.parametrize('contact', ['attached', 'absent'])
def test_a_run_backwards_is_the_mirror_image(contact, stand):
    stand = stand.updated({'load_cell.contact': contact})
    forwards, backwards = (run_sawtooth(stand, 300.0, sign * 1000.0, 15) for sign in (1.0, -1.0))
    assert forwards.step_length_m > 0.0
    for name in ('force_mean_n', 'force_ramp_start_n', 'step_length_m', 'frequency_hz'):
        there, back = getattr(forwards, name), getattr(backwards, name)
        assert back == pytest.approx(-there, rel=MIRROR, abs=0.0)
    assert backwards.steps == forwards.steps


@pytest.mark.parametrize(('preload_n', 'mean_n'), [(0.1, 0.061), (0.5, 0.172), (1.0, 0.224)])
def test_a_run_without_a_number_of_steps_goes_on_until_it_is_steady(preload_n, mean_n, stand):
    result = run_sawtooth(stand.updated({'stand.preload': preload_n}), 300.0, 1000.0)
    assert result.steady
    assert STEADY_STEPS_MIN <= result.steps <= STEADY_STEPS_MAX
    assert result.force_mean_n == pytest.approx(mean_n, rel=FORCE_ERROR, abs=0.0)
    assert result.force_ramp_start_n > result.force_mean_n


def test_a_free_runner_has_no_force_but_steps(stand):
    result = run_sawtooth(stand.updated({'load_cell.contact': 'absent'}), 300.0, 200.0)
    assert result.steady
    assert result.force_mean_n == result.force_ramp_start_n == 0.0
    zero_amplitude_m, within_m = 66e-9, 2e-9  # both to the nanometre, and ringing
    assert result.step_length_m == pytest.approx(160e-9 - zero_amplitude_m, rel=0.0, abs=within_m)


def test_progress_is_told_up_to_the_number_of_steps(stand):
    told = []
    run_sawtooth(
        stand, 300.0, 1000.0, 12, progress=lambda done, wanted: told.append((done, wanted))
    )
    assert told == [(steps, 12) for steps in range(1, 13)]
    told.clear()
    run_sawtooth(stand, 300.0, 1000.0, progress=lambda done, wanted: told.append(wanted))
    assert set(told) == {0}


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
        run_sawtooth(stand, voltage_v, frequency_hz, steps, path=path)
    assert message in str(caught.value)
    assert not path.exists()


def test_a_drive_rests_where_its_wave_starts_unless_told_otherwise(stand):
    backwards = Request('sawtooth', (240.0, -100.0, 5.0))
    assert start_on_wave(stand, backwards).amplifier.voltage_initial == 240.0
    chosen = stand.updated({'amplifier.voltage_initial': 100.0})
    assert start_on_wave(chosen, backwards) == chosen
    assert start_on_wave(stand, Request('stop')) == stand


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
    backwards = Request('sawtooth', (240.0, -100.0, 5.0))
    chosen = pickle.loads(pickle.dumps(chosen.updated({'amplifier.slew_rate': 1e7})))
    assert start_on_wave(chosen, backwards) is chosen
    assert chosen == Parameters().updated({'amplifier.slew_rate': 1e7})
    unchosen = pickle.loads(pickle.dumps(Parameters().updated({'amplifier.slew_rate': 1e7})))
    assert start_on_wave(unchosen, backwards).amplifier.voltage_initial == 240.0


def test_the_residual_is_relative_to_the_work_of_the_feet():
    ledger = EnergyLedger(10.0, 1.0, 2.0, 3.0, 1.0, 3.0, 1.0)
    assert ledger.residual_j == 1.0
    assert relative_residual(ledger) == 0.1
    assert relative_residual(dataclasses.replace(ledger, feet_work_j=0.0)) == 0.0


def test_a_stroke_is_turned_into_volts(stand):
    assert voltage_for(stand, 80e-9) == pytest.approx(150.0, rel=ROUNDING, abs=0.0)
    bipolar = stand.updated({'amplifier.voltage_min': -300.0})
    assert voltage_for(bipolar, 320e-9) == pytest.approx(600.0, rel=ROUNDING, abs=0.0)


def test_a_stroke_that_exceeds_the_largest_by_rounding_is_the_largest(stand):
    largest_m = 300.0 * stand.actuator.gain
    for stroke_m in (160e-9, 160 * 1e-9, largest_m * (1.0 + 1e-10)):
        assert voltage_for(stand, stroke_m) <= 300.0 * (1.0 + ROUNDING)
        assert run_sawtooth(stand, voltage_for(stand, stroke_m), 1000.0, 1).steps == 1


@pytest.mark.parametrize('stroke_m', [161e-9, 160.0])
def test_a_stroke_beyond_the_amplifier_is_refused(stroke_m, stand):
    with pytest.raises(OutOfRange) as caught:
        voltage_for(stand, stroke_m)
    assert str(caught.value) == (
        f'amplitude {stroke_m:.6g} m is above the 1.6e-07 m that the amplifier reaches; '
        'lower it, or give it in metres'
    )


def test_a_run_whose_recording_is_deleted_ends_and_says_so(stand, tmp_path):
    path = tmp_path / 'run.mcap'

    def delete(done: int, wanted: int) -> None:
        path.unlink(missing_ok=True)

    with pytest.raises(RecordingError, match='it was deleted, moved or replaced'):
        run_sawtooth(stand, 300.0, 1000.0, 20, path=path, progress=delete)
