# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kinds of files that laboratories have, and the numbers that come out of each."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.tables import read_experiment, read_joined
from stickslip_ros.lab.measurements.vocabulary import BY_AMPLITUDE, OVER_TIME, MeasuredTable

STEP_S = 8e-5
TIME_S = STEP_S * np.arange(50)
VOLTS = 2.0 + 8.0 * (np.arange(50) % 25)
NANOMETRES = np.round(0.3 + 5.8 * np.arange(50), 1)
LATE_S = 0.003
ROUNDING = 1e-12
TOLD = {'voltage_v': 'CH1 (V)', 'position_m': 'CH2 (nm)'}


def known(table: MeasuredTable, name: str) -> tuple[np.ndarray, np.ndarray]:
    rows = ~np.isnan(table.columns[name])
    return table.columns['time_s'][rows], table.columns[name][rows]


def check(table: MeasuredTable, late_s: float = 0.0, every: int = 1, volts: bool = True) -> None:
    """Check position and voltage, each at its times."""
    assert table.kind == OVER_TIME
    time_s, position_m = known(table, 'position_m')
    np.testing.assert_allclose(time_s, (TIME_S + late_s)[::every], rtol=ROUNDING, atol=1e-15)
    np.testing.assert_allclose(position_m, 1e-9 * NANOMETRES[::every], rtol=ROUNDING)
    if volts:
        time_s, voltage_v = known(table, 'voltage_v')
        np.testing.assert_allclose(time_s, TIME_S, rtol=ROUNDING, atol=1e-15)
        np.testing.assert_array_equal(voltage_v, VOLTS)


def scope(path: Path, channel: str, values: np.ndarray, delay_s: float = 0.0) -> Path:
    settings = ['Record Length,2.5e3', 'Sample Interval,8e-5', f'Source,{channel}']
    settings += ['Vertical Units,V', 'Horizontal Units,s', *[','] * (len(values) - 5)]
    rows = zip(settings, TIME_S + delay_s, values, strict=True)
    path.write_text(
        ''.join(f'{left},,{time_s:.9f}, {value:.5f},\n' for left, time_s, value in rows)
    )
    return path


def test_one_file_per_channel_is_joined_by_time(tmp_path: Path):
    files = [
        scope(tmp_path / 'CH1.CSV', 'CH1', VOLTS),
        scope(tmp_path / 'CH2.CSV', 'CH2', NANOMETRES, LATE_S),
    ]
    check(read_joined(files, TableOptions(TOLD)), LATE_S)
    named = TableOptions({'voltage_v': 'CH1 (V)', 'position_m': 'CH2.CSV:CH2 (nm)'})
    check(read_experiment(files[0], named), LATE_S)
    measured = read_experiment(files[0], named, measured=('voltage_v',)).columns
    assert np.isfinite(measured['position_m']).sum() == 50
    both = TableOptions({name: f'{files[at]}:{TOLD[name]}' for at, name in enumerate(TOLD)})
    check(read_experiment(files[1], both), LATE_S)


def test_files_of_one_channel_each_may_name_their_quantities(tmp_path: Path):
    for name, values in (('voltage (V)', VOLTS), ('position (nm)', NANOMETRES)):
        frame = pd.DataFrame({'time (s)': TIME_S, name: values})
        frame.to_csv(tmp_path / f'{name[:8]}.csv', index=False)
    check(read_joined(sorted(tmp_path.glob('*.csv'))))


def test_files_without_a_common_time_are_joined_by_a_rate(tmp_path: Path):
    files = [
        scope(tmp_path / 'CH1.CSV', 'CH1', VOLTS),
        scope(tmp_path / 'CH2.CSV', 'CH2', NANOMETRES, 1e3),
    ]
    with pytest.raises(StickSlipError, match=r'no time in common .* 1000 .*--rate \.\.\.kHz'):
        read_joined(files, TableOptions(TOLD))
    check(read_joined(files, TableOptions(TOLD, rate_hz=12.5e3)))


def tdms(path: Path, every: int = 1, **told: Any) -> Path:
    start = np.datetime64('2026-10-01T10:00:00')
    of = {'wf_increment': STEP_S, 'wf_start_offset': 0.0, 'wf_start_time': start}
    with TdmsWriter(path) as writer:
        for name, unit, values, own in (
            ('voltage', 'V', VOLTS, {}),
            ('position', 'nm', NANOMETRES[::every], told),
        ):
            properties = {**of, 'unit_string': unit, **own}
            writer.write_segment([ChannelObject('rig', name, values, properties=properties)])
    return path


@pytest.mark.parametrize(
    ('told', 'late_s', 'every'),
    [
        ({}, 0.0, 1),
        ({'wf_start_offset': LATE_S}, LATE_S, 1),
        ({'wf_start_time': np.datetime64('2026-10-01T10:00:00.003')}, LATE_S, 1),
        ({'wf_increment': 2.0 * STEP_S}, 0.0, 2),
        ({'wf_increment': 2.0 * STEP_S, 'wf_start_offset': LATE_S}, LATE_S, 2),
    ],
)
def test_each_channel_of_tdms_has_its_own_clock(tmp_path, told, late_s, every):
    table = read_experiment(tdms(tmp_path / 'run.tdms', every, **told))
    check(table, late_s, every)
    assert not [note for note in table.notes if 'left out' in note]


FRAME = {'voltage (V)': VOLTS, 'position (nm)': NANOMETRES}
DATES = pd.Timestamp('2023-11-14 22:13:20') + pd.to_timedelta(80 * np.arange(50), unit='us')


@pytest.mark.parametrize('zone', [None, 'UTC', 'Europe/Berlin'])
@pytest.mark.parametrize('suffix', ['.parquet', '.csv', '.xlsx'])
def test_dates_are_times_from_the_first_row(tmp_path: Path, zone: str | None, suffix: str):
    dates = pd.DatetimeIndex(DATES).tz_localize(zone)
    frame = pd.DataFrame({'time': dates, **FRAME})
    path = tmp_path / f'run{suffix}'
    if suffix == '.parquet':
        frame.to_parquet(path)
    elif suffix == '.csv':
        frame.to_csv(path, index=False)
    else:
        frame.assign(time=dates.astype(str)).to_excel(path, index=False)
    table = read_experiment(path)
    check(table)
    assert any("'time' counts from 1" in note for note in table.notes)


def grouped(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for group, unit, values in (('CH1', 'V', VOLTS), ('CH2', 'nm', NANOMETRES)):
            for name, told, each in (('data', unit, values), ('time', 's', TIME_S)):
                file.create_dataset(f'{group}/{name}', data=each).attrs['Unit'] = told


def test_names_of_groups_are_paths_and_each_group_has_its_clock(tmp_path: Path):
    grouped(tmp_path / 'run.h5')
    with pytest.raises(RecordingError) as refusal:
        read_experiment(tmp_path / 'run.h5')
    assert [row[1:4] for row in refusal.value.table[1:]] == [
        ('CH1/time', 's', 'number'),
        ('CH1/data', 'V', 'number'),
        ('CH2/time', 's', 'number'),
        ('CH2/data', 'nm', 'number'),
    ]
    options = TableOptions({'voltage_v': 'CH1/data', 'position_m': 'CH2/data'})
    check(read_experiment(tmp_path / 'run.h5', options))


RECORD = pd.DataFrame({'t': TIME_S, 'u': VOLTS, 'x': NANOMETRES}).to_records(index=False)
UNITS = {'time_s': 't (s)', 'voltage_v': 'u (V)', 'position_m': 'x (nm)'}
STRUCTS: dict[str, Callable[[Path], Any]] = {
    'fields.npy': lambda path: np.save(path, np.array(RECORD)),
    'fields.npz': lambda path: np.savez(path, run=np.array(RECORD)),
    'struct.mat': lambda path: savemat(path, {'run': {'t': TIME_S, 'u': VOLTS, 'x': NANOMETRES}}),
}


@pytest.mark.parametrize('name', STRUCTS)
def test_fields_of_an_array_or_a_struct_are_columns(tmp_path: Path, name: str):
    STRUCTS[name](tmp_path / name)
    with pytest.raises(StickSlipError, match="no unit for 't', 'u', 'x'"):
        read_experiment(tmp_path / name)
    check(read_experiment(tmp_path / name, TableOptions(UNITS)))


def keysight(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name, values in (('A', VOLTS), ('B', NANOMETRES)):
            group = file.create_group(f'Waveforms/{name}')
            group.attrs.update({'XOrg': LATE_S, 'XInc': STEP_S, 'YUnits': 'Volt'})
            group.create_dataset(name, data=values)


def pico(path: Path) -> None:
    told = {'Tstart': LATE_S, 'Tinterval': STEP_S, 'Length': 50, 'Version': '6.1'}
    savemat(path, {'A': VOLTS[:, np.newaxis], 'B': NANOMETRES[:, np.newaxis], **told})


def national(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name, values in (('A', VOLTS), ('B', NANOMETRES)):
            told = {'wf_increment': STEP_S, 'wf_start_offset': LATE_S}
            file.create_dataset(name, data=values).attrs.update(told)


INCREMENTS: dict[str, Callable[[Path], Any]] = {
    'keysight.h5': keysight,
    'national.h5': national,
    'pico.mat': pico,
    'own.npz': lambda path: np.savez(path, A=VOLTS, B=NANOMETRES, dt_s=STEP_S, t0_s=LATE_S),
}


@pytest.mark.parametrize('name', INCREMENTS)
def test_an_increment_beside_vectors_gives_their_times(tmp_path: Path, name: str):
    INCREMENTS[name](tmp_path / name)
    options = TableOptions({'voltage_v': 'A (V)', 'position_m': 'B (nm)'})
    table = read_experiment(tmp_path / name, options)
    time_s, position_m = known(table, 'position_m')
    np.testing.assert_allclose(time_s, LATE_S + TIME_S, rtol=ROUNDING)
    np.testing.assert_allclose(position_m, 1e-9 * NANOMETRES, rtol=ROUNDING)


def test_an_increment_without_a_unit_is_no_time_and_a_rate_is_asked_for(tmp_path: Path):
    np.savez(tmp_path / 'run.npz', voltage_v=VOLTS, position_nm=NANOMETRES, dt=80.0)
    with pytest.raises(RecordingError, match=r'--rate \.\.\.kHz'):
        read_experiment(tmp_path / 'run.npz')
    check(read_experiment(tmp_path / 'run.npz', TableOptions(rate_hz=12.5e3)))


@pytest.mark.parametrize(
    'index',
    [DATES, DATES.tz_localize('Europe/Berlin'), DATES - DATES[0]],
    ids=lambda i: str(i.dtype),
)
@pytest.mark.parametrize('name', [None, 'time'])
def test_an_index_of_dates_or_durations_is_the_time(tmp_path: Path, index: Any, name: str | None):
    frame = pd.DataFrame(FRAME, index=index.rename(name))
    frame.to_parquet(tmp_path / 'run.parquet')
    check(read_experiment(tmp_path / 'run.parquet'))
    check(read_experiment(frame))


def test_text_packed_by_gzip_is_read_within_limits(tmp_path: Path):
    pd.DataFrame({'time (s)': TIME_S, **FRAME}).to_csv(
        path := tmp_path / 'run.csv.gz', index=False
    )
    check(read_experiment(path))
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(RecordingError, match=r'cannot be read as \.gz'):
        read_experiment(path)


@pytest.mark.parametrize('head', ['', 'position\n', '# rig 7\n\n'])
def test_one_column_of_numbers_is_read(tmp_path: Path, head: str):
    path = tmp_path / 'one.txt'
    path.write_text(head + ''.join(f'{round(1e3 * each)}\n' for each in NANOMETRES))
    options = TableOptions({'position_m': '#1 (pm)'}, rate_hz=12.5e3)
    check(read_experiment(path, options), volts=False)
    np.save(tmp_path / 'one.npy', NANOMETRES)
    options = TableOptions({'position_m': '#1 (nm)'}, rate_hz=12.5e3)
    check(read_experiment(tmp_path / 'one.npy', options), volts=False)


@pytest.mark.parametrize('units', ['[ s ]\t[ V ]\t[ nm ]', '(s)\t(V)\t(nm)', '[s]\t[V]\t[nm]'])
def test_units_in_brackets_stand_below_their_names(tmp_path: Path, units: str):
    path = tmp_path / 'scan.txt'
    rows = ''.join(
        f'{t!r}\t{u!r}\t{x!r}\n'
        for t, u, x in zip(*(e.tolist() for e in (TIME_S, VOLTS, NANOMETRES)), strict=True)
    )
    path.write_text(
        f'Source File Name: scan.pvd\nUnit: m/s\n\nTime\tVoltage\tPosition\n{units}\n{rows}'
    )
    check(read_experiment(path))
    path.write_text('Unit: m/s\n\nTime\tVelocity\n[ s ]\t[ m/s ]\n0\t3e-6\n1\t4e-6\n')
    with pytest.raises(RecordingError) as refusal:
        read_experiment(path)
    assert refusal.value.table[2] == ('#2', 'Velocity', 'm/s', 'number', '3e-6', '4e-6')


def by_amplitude(folder: Path, text: str, preload_n: float = 0.5) -> MeasuredTable:
    path = folder / 'points.csv'
    path.write_text(text)
    table = read_experiment(path, TableOptions(preloads_n=(preload_n,)))
    assert table.kind == BY_AMPLITUDE
    return table


def test_a_sheet_has_typical_values_and_limits(tmp_path: Path):
    head = 'Parameter,Min,Typ,Max,Unit,Voltage (V)\n'
    rows = 'Step size,40,50,60,nm,300\nHolding force,0.3,0.4,,N,\nMoving mass,,3,,g,\n'
    table = by_amplitude(tmp_path, f'{head}{rows}Slew rate,100,,,V/us,\nCapacitance,1,,3,uF,\n')
    columns, nan = table.columns, np.nan
    np.testing.assert_allclose(columns['step_length_m'][0], 50e-9)
    np.testing.assert_allclose(columns['step_length_sigma_m'][0], 5e-9)
    np.testing.assert_allclose(columns['holding_force_n'][1], 0.4)
    np.testing.assert_allclose(columns['holding_force_sigma_n'][1], 0.05)
    np.testing.assert_allclose(columns['moving_mass_sigma_kg'][2], 0.2 * 3e-3)
    np.testing.assert_allclose(columns['capacitance_f'], [nan, nan, nan, 2e-6])
    np.testing.assert_allclose(columns['capacitance_sigma_f'][3], 0.5e-6)
    assert any('Slew rate (V/us): it has only one limit' in note for note in table.notes)


@pytest.mark.parametrize('sign', [1, -1])
def test_a_displacement_in_a_number_of_steps_is_a_step_length(tmp_path: Path, sign: int):
    rows = f'forward,1000,300,94.1\nbackward,1000,300,{sign * 88.0}\nforward,500,250,35.1\n'
    columns = by_amplitude(
        tmp_path, f'direction,steps,voltage (V),displacement (um)\n{rows}'
    ).columns
    np.testing.assert_allclose(columns['step_length_m'], [94.1e-9, np.nan, 70.2e-9])
    np.testing.assert_allclose(columns['step_back_m'], [np.nan, 88e-9, np.nan])
    assert not {'travel_m', 'steps', 'direction'} & columns.keys()


def test_rows_that_differ_in_a_column_that_is_left_out_are_asked_about(tmp_path: Path):
    head, warm, cold = 'voltage (V),step up (nm)\n', ('200,49', '250,70'), ('200,9', '250,14')
    rows = ''.join(f'300,{row}\n' for row in warm) + ''.join(f'4,{row}\n' for row in cold)
    with pytest.raises(StickSlipError) as refusal:
        by_amplitude(tmp_path, f'temperature (K),{head}{rows}')
    told = str(refusal.value)
    assert 'step_length_m differs, 9e-09 and 4.9e-08' in told
    assert "'temperature (K)'" in told
    for part in (warm, cold):  # as the remedy says, the rows of each condition in a file
        columns = by_amplitude(tmp_path, head + '\n'.join(part)).columns
        wanted = [1e-9 * float(each.split(',')[1]) for each in part]
        np.testing.assert_allclose(columns['step_length_m'], wanted, rtol=ROUNDING)
    same = ''.join(f'{number},200,{49 + number}\n' for number in range(5))
    assert len(by_amplitude(tmp_path, f'run,{head}{same}').columns['step_length_m']) == 5


def test_the_command_line_shows_the_columns_below_its_line(tmp_path: Path, capsys):
    path = tmp_path / 'scope.csv'
    path.write_text('comment,time (s),CH1 (V)\nfirst,0,2\nsecond,1,3\n')
    assert main(['import', str(path)]) == 2
    line, title, *rows = capsys.readouterr().err.splitlines()
    assert line.startswith('stickslip: ')
    assert title.split() == ['#', 'name', 'unit', 'kind', 'first', 'last']
    assert [row.split() for row in rows] == [
        ['#1', 'comment', '-', 'text', 'first', 'second'],
        ['#2', 'time', 's', 'number', '0', '1'],
        ['#3', 'CH1', 'V', 'number', '2', '3'],
    ]
    assert '#1' not in line
    assert main(['import', str(path), '--json']) == 2
    assert json.loads(capsys.readouterr().out)['columns'][2]['name'] == 'CH1'
