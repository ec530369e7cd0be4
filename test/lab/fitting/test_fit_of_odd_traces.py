# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings that cannot be fitted, or say too little, end in a line that says why."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from spring_rig import Rig, voltage

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.experiments.experiment import Experiment, Voltage
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.experiments.sensor import noise_of
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.lab.fitting.free import choose_free
from stickslip_ros.lab.fitting.problem import pose
from stickslip_ros.lab.fitting.report import Fit, warnings_of
from stickslip_ros.parameters import Parameters

ROWS = voltage((-60.0, 250.0, 1), (280.0, 300.0, 3), (300.0, 600.0, 4))
RATE_HZ = 50e3
RIG = Rig(preload_n=0.35, friction=0.26)
TRUTH = {
    'contact.friction': RIG.friction,
    'runner.mass': RIG.mass_kg,
    'actuator.gain': RIG.gain_m_per_v,
}
STAND = Parameters().updated({'runner.damping': RIG.damping_n_s_per_m})
PRELOADED = CompareOptions(preloads_n=(0.35,))
ROUNDED_M = 1e-9
GAIN_SHARE = 1e-3  # that readings of the feet without noise leave


def frame(rig: Rig = RIG, rows: np.ndarray = ROWS) -> pd.DataFrame:
    time_s, position_m = rig.positions(rows, RATE_HZ, 1)
    volts = np.interp(time_s, *rows.T)
    return pd.DataFrame({'time_s': time_s, 'voltage_v': volts, 'position_m': position_m})


def moved(change: Callable[[Any], Any], **others: Any) -> pd.DataFrame:
    """Give a table with other positions."""
    return frame(**others).assign(position_m=lambda each: change(each['position_m']))


def read(table: pd.DataFrame, on: Parameters = STAND, **options: Any) -> Experiment:
    [one] = read_experiments(table, on, ReadingOptions(**options))
    return one


def fitted(table: pd.DataFrame, **options: Any) -> Fit:
    asked = FitOptions(preloads_n=(0.35,), starts=1, workers=1, **options)
    return fit(table, [*TRUTH], parameters=STAND, options=asked)


def holding(found: Fit) -> list[bool]:
    """Give whether each interval holds the truth."""
    return [one.low < TRUTH[one.name] < one.high for one in found.estimates]


def test_a_table_over_time_is_compared_at_the_preload_that_is_said():
    said, unsaid = (compare(frame(), STAND, options=PRELOADED), compare(frame(), STAND))
    set_by_name = compare(frame(), STAND.updated({'stand.preload': '0.5'}))
    for each in (said, set_by_name):
        assert not any('preload' in note for note in each.b.notes)
    assert any('the 0.5 N of the stand are used' in note for note in unsaid.b.notes)
    [a], [b] = said.quantities, unsaid.quantities
    assert a.agreement.rms < b.agreement.rms


def test_a_model_is_compared_with_the_bands_of_its_draws():
    chance = np.random.default_rng(2)
    draws = [
        STAND.updated({'contact.friction': RIG.friction * (1.0 + 0.02 * each)})
        for each in chance.normal(size=40)
    ]
    middle = STAND.updated({'contact.friction': RIG.friction})
    found = compare(frame(), middle, draws=draws, progress=False, options=PRELOADED)
    [position] = found.quantities
    assert position.agreement.within_95 is not None
    assert position.agreement.within_68 is not None
    assert 0.9 < position.agreement.within_95 <= 1.0
    assert 0.6 < position.agreement.within_68 < position.agreement.within_95
    [part] = position.parts
    assert part.band is not None
    lows = [part.band[name] for name in ('low_95', 'low_68', 'middle', 'high_68', 'high_95')]
    assert np.all(np.diff(lows, axis=0) > 0.0)
    wrong = compare(frame(), STAND, draws=[STAND, STAND], options=PRELOADED)
    assert wrong.quantities[0].agreement.within_95 < 0.7
    assert found.to_json()['quantities'][0]['agreement']['width_95'] > 4.0 * RIG.noise_m
    assert len(found.plot().axes) == 4  # the course and a cycle of it, over their differences


def test_draws_of_files_are_refused():
    with pytest.raises(StickSlipError, match='draws need the model as B'):
        compare(frame(), frame(), draws=[STAND])


@pytest.fixture(scope='module')
def learned() -> Fit:
    return fitted(frame())


def test_an_encoder_that_counts_the_other_way_is_told(learned: Fit):
    [one] = learned.experiments
    turned = (replace(seen, values=-seen.values) for seen in one.observed)
    problem = replace(learned.problem, experiments=(replace(one, observed=tuple(turned)),))
    wrong = replace(learned, problem=problem, refined=(replace(learned.found, converged=False),))
    text = 'position_m has the opposite sign of the model (correlation -'
    assert any(text in warning for warning in warnings_of(wrong))
    assert not any(text in warning for warning in warnings_of(learned))


def test_a_piezo_against_its_voltage_is_fitted_with_feet_of_negative_gain():
    with pytest.raises(StickSlipError, match=r'below the minimum .* set feet\.gain below 0'):
        STAND.updated({'actuator.gain': -RIG.gain_m_per_v})
    against = STAND.updated({'feet.gain': -1.0, 'contact.friction': RIG.friction})
    options = FitOptions(preloads_n=(0.35,), starts=1)
    found = fit(moved(np.negative), 'actuator.gain', parameters=against, options=options)
    assert found.holds
    [gain] = found.estimates
    assert gain.low < RIG.gain_m_per_v < gain.high


def test_a_voltage_below_the_range_by_rounding_is_played():
    def shown(lowest_v: float) -> np.ndarray:
        rows = np.where(ROWS == 0.0, [[0.0, lowest_v]], ROWS)
        one = replace(read(frame()), drive=Voltage(rows))
        return predict(STAND, [one])[0][0].values

    assert np.array_equal(shown(-2.5e-13), shown(0.0))
    with pytest.raises(StickSlipError, match="-1e-06 V is below the amplifier's 0 V"):
        shown(-1e-6)


def test_a_bipolar_recording_is_read_as_its_amplifier_is_set():
    table, range_v = frame(), {'amplifier.voltage_min': -150.0, 'amplifier.voltage_max': 150.0}
    table['voltage_v'] -= 150.0
    with pytest.raises(StickSlipError, match=r'set amplifier\.voltage_min and voltage_max'):
        read(table)
    one = read(table, STAND.updated(range_v))
    [bipolar] = predict(STAND.updated({**range_v, 'stand.preload': 0.35}), [one])
    [usual] = predict(STAND.updated({'stand.preload': 0.35}), [read(frame())])
    away_m = np.abs(bipolar[0].values - usual[0].values)
    assert np.median(away_m) < RIG.noise_m


def test_a_constant_load_reaches_each_experiment():
    points = pd.DataFrame({'preload_n': [0.5], 'voltage_v': [200.0], 'step_length_m': [5e-8]})
    for table in (frame(), points, points.assign(load_n=0.01)):
        one, bare = read(table, load_n=0.02), read(table)
        assert one.load_n == bare.load_n + 0.02
        [[with_load]], [[by_stand]], [[without]] = (
            predict(STAND.updated({'stand.load': load_n}), [each])
            for each, load_n in ((one, 0.0), (bare, 0.02), (bare, 0.0))
        )
        assert np.allclose(with_load.values, by_stand.values, rtol=1e-9, atol=0.0)
        assert not np.allclose(with_load.values, without.values, rtol=1e-3, atol=0.0)


def test_a_drift_beyond_that_of_a_sensor_is_named_and_a_larger_one_can_be_stated(learned: Fit):
    drifting = frame(replace(RIG, drift_m_per_s=2e-4))
    found = fitted(drifting)
    moved = 'values move beyond their errors with a drift of the sensor: '
    assert any(reason.startswith(moved) for reason in found.reasons)
    assert found.missing[0].name == 'a drift of the sensor'
    stated = fitted(drifting, drift_m_per_s=3e-4)
    [(_, _, sensor)] = stated.sensors
    assert sensor['drift_per_s'] == pytest.approx(2e-4, rel=0.01)
    assert stated.holds
    assert learned.holds


def test_steps_of_one_voltage_give_a_gain_as_sure_as_the_drift_of_the_sensor():
    hertz, volts = 500.0, 200.0
    rows = voltage((volts, hertz, 30))
    found = fitted(frame(rows=rows), window_s=(0.02, 0.06))
    gain = found.estimates[2]
    assert gain.value == pytest.approx(RIG.gain_m_per_v, rel=0.01)
    assert gain.low < RIG.gain_m_per_v < gain.high
    told = found.problem.experiments[0].observed[0].sensor.drift_per_s / (hertz * volts)
    assert 0.5 * told < gain.standard_error < 2.0 * told


def test_a_hum_is_within_the_stated_errors_or_makes_a_fit_that_does_not_hold():
    hum = np.sin(2.0 * np.pi * 100.0 * frame()['time_s'])
    assert all(holding(fitted(moved(lambda each: each + 3e-9 * hum))))
    assert not fitted(moved(lambda each: each + 1e-8 * hum)).holds


@pytest.mark.parametrize('noise_m', [0.0, 1e-9])
def test_a_sensor_that_shows_noise_alone_is_refused(noise_m: float):
    noise = np.random.default_rng(1).normal(0.0, noise_m, len(frame()))
    with pytest.raises(StickSlipError, match='only noise in its position_m'):
        fitted(moved(lambda _: 1e-6 + noise))


@pytest.mark.parametrize('sign', [1.0, -1.0])
@pytest.mark.parametrize('digit_m', [1e-15, 1e-8])
def test_a_position_at_a_limit_of_its_sensor_is_refused_unless_a_window_leaves_it_out(
    sign: float, digit_m: float
):
    table = frame()
    limit_m = float(table['position_m'].iloc[int(0.65 * len(table))])
    clipped_m = digit_m * np.round(table['position_m'].clip(upper=limit_m) / digit_m)
    table = table.assign(position_m=sign * clipped_m)
    with pytest.raises(StickSlipError, match=r'exactly .* m over [345] falls of the voltage, 0\.'):
        read(table)
    assert len(read(table, window_s=(0.0, 0.015)).observed[0].values) > 0


@pytest.mark.parametrize('stopped', [slice(0, 1000), slice(700, None)])
def test_a_sensor_that_stopped_is_refused(stopped: slice):
    table = frame()
    table.loc[table.index[stopped], 'position_m'] = 1e-6
    with pytest.raises(StickSlipError, match='its sensor is at a limit, or has stopped'):
        read(table)


def test_a_sensor_that_counts_around_makes_a_fit_that_does_not_hold():
    assert not fitted(moved(lambda each: np.mod(each, 2.56e-7))).holds


@pytest.mark.parametrize(
    'rig', [RIG, Rig(noise_m=0.0, drift_m_per_s=0.0), Rig(noise_m=0.0, late_s=4e-3, preload_n=0.8)]
)
@pytest.mark.parametrize('digit_m', [1e-9, 1e-8, 1e-7])
def test_a_position_in_coarse_digits_is_read(rig: Rig, digit_m: float):
    assert read(moved(lambda each: digit_m * np.round(each / digit_m), rig=rig)).observed


def test_readings_that_drop_out_for_a_while_are_no_counter():
    table = frame()
    for at in (300, 700, 1100):
        table.loc[table.index[at : at + 9], 'position_m'] = 0.0
    assert read(table).observed


def test_a_force_of_nothing_beside_a_motion_is_left_out_and_told():
    one = read(frame().assign(force_n=0.0))
    assert [each.quantity for each in one.observed] == ['position_m']
    assert 'force_n is only noise and is left out' in one.notes[0]


def test_readings_without_noise_are_fitted_at_the_preload_that_is_said():
    table = frame()
    table['foot_position_m'] = RIG.gain_m_per_v * table['voltage_v']
    found = fitted(table)
    gain = found.estimates[2]
    assert holding(found)[:2] == [True, True]
    assert gain.value == pytest.approx(RIG.gain_m_per_v, rel=GAIN_SHARE, abs=0.0)
    assert not any('preload' in text for text in warnings_of(found))


def test_rounding_is_noise_whatever_the_last_digits_are():
    time_s = np.linspace(0.0, 1.0, 2000)
    counts = np.asarray(np.round(300.0 * time_s), np.float64)
    rounding_m = ROUNDED_M / np.sqrt(12.0)
    for values in (counts * ROUNDED_M, 1e-3 + counts * ROUNDED_M, counts / 1e9):
        assert noise_of(values) == pytest.approx(rounding_m, rel=1e-3, abs=0.0)


def with_monitor(rows: np.ndarray, rate_hz: float) -> pd.DataFrame:
    """Give a table of a rig whose voltage is sampled more slowly than its position."""
    time_s, position_m = RIG.positions(rows, RATE_HZ, 1)
    at_s = np.arange(0.0, rows[-1, 0], 1.0 / rate_hz) + 2.5e-4
    monitor = pd.DataFrame({'time_s': at_s, 'voltage_v': np.interp(at_s, *rows.T)})
    table = pd.DataFrame({'time_s': time_s, 'position_m': position_m})
    return table.merge(monitor, on='time_s', how='outer')


def test_the_commands_help_where_a_monitor_is_too_slow(tmp_path: Path):
    table, commands = with_monitor(ROWS, 2000.0), tmp_path / 'commands.csv'
    pd.DataFrame(ROWS, columns=['time_s', 'voltage_v']).to_csv(commands, index=False)
    too_slow = (
        r'a monitor of 2000 Hz takes 3\.33 samples in a cycle of \S+ Hz, below the 10 '
        r'\(\S+ Hz\) that show it; give the commands with --commands \(Python: commands\)$'
    )
    with pytest.raises(StickSlipError, match=too_slow):
        fitted(table)
    found = fitted(table, commands=commands)
    assert found.holds
    assert all(holding(found))
    words = ['compare', str(tmp_path / 'rig.csv'), 'model', '--preload', '0.35N']
    table.to_csv(words[1], index=False)
    assert main(words) == 2
    assert main([*words, '--commands', str(commands)]) == 0


@pytest.mark.slow  # the searches of a fit that finds no minimum
def test_a_wave_that_its_monitor_shows_as_a_hold_makes_a_fit_that_does_not_hold():
    table = with_monitor(voltage((280.0, 60.0, 3), (280.0, 1000.0, 40), rest_s=8e-3), 1000.0)
    found = fitted(table)
    [one] = found.experiments
    assert isinstance(one.drive, Voltage)
    assert any('waves above 100 Hz would be mistaken' in note for note in one.drive.notes)
    assert not found.holds


def test_a_window_of_a_long_recording_is_run_from_shortly_before_it():
    rows = voltage(*((280.0, 600.0, 8), (300.0, 600.0, 8)) * 8)
    table, window_s = frame(rows=rows), (0.2, 0.23)
    one = read(table, window_s=window_s)
    [seen] = one.observed
    assert isinstance(one.drive, Voltage)
    assert one.drive.begins_s == pytest.approx(0.2 - LEAD_S, rel=0.0, abs=1.0 / RATE_HZ)
    assert (seen.time_s[[0, -1]] + one.drive.begins_s).tolist() == pytest.approx(
        window_s, rel=0.0, abs=1.5 / RATE_HZ
    )
    stand = STAND.updated({'contact.friction': RIG.friction})
    found = compare(table, stand, options=CompareOptions(preloads_n=(0.35,), window_s=window_s))
    assert found.quantities[0].agreement.rms < 3.0 * RIG.noise_m


def test_a_recording_that_is_too_long_or_has_nothing_in_the_window_is_refused():
    time_s = np.linspace(0.0, 10.0, 5000)
    table = pd.DataFrame({'time_s': time_s, 'voltage_v': time_s, 'position_m': 1e-6 * time_s})
    with pytest.raises(StickSlipError, match=r'10 s is above 2 s, .* --window 0.3s@2s'):
        read(table)
    with pytest.raises(StickSlipError, match=r'0 samples of the position_m of .* from 0 to 10 s'):
        read(table, window_s=(11.0, 12.0))


@pytest.mark.parametrize('multiple', [1.0, 2.0])
def test_a_saw_tooth_at_a_multiple_of_the_rate_of_its_monitor_is_no_hold(multiple: float):
    rate_hz = 1000.0
    table = with_monitor(voltage((280.0, multiple * rate_hz, 40), rest_s=8e-3), rate_hz)
    with pytest.raises(StickSlipError, match='give the commands'):
        read(table)


@pytest.mark.parametrize('factor', [1e3, 1e-3])
def test_a_motion_in_another_unit_is_refused_by_what_a_volt_moves(factor: float):
    scaled = moved(lambda each: factor * each)
    with pytest.raises(StickSlipError, match=r'm per volt, .* check the units of position and'):
        fitted(scaled)
    lever = STAND.updated({'actuator.gain': factor * RIG.gain_m_per_v})
    stand, free, _ = choose_free(lever, ['contact.friction'])
    assert pose(stand, free, [read(scaled, lever)]).has_traces
