"""Experiment files: what is read, and what is refused with line, column, value and hint."""

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.study.experiment import (
    BY_AMPLITUDE,
    OVER_TIME,
    POINT_COLUMNS,
    TIME_COLUMNS,
    parse_experiment,
    read_experiment,
    sigma_name,
)

POINTS = 'preload_n,amplitude_m,force_n\n'
TIMES = 'time_s,position_m\n'


def parse(text: str):
    return parse_experiment(text.encode(), 'exp.csv')


def test_a_table_by_amplitude_is_read_with_its_notes():
    experiment = parse(
        '# ruby on steel\n#  run 7\npreload_n, amplitude_m ,force_n,force_sigma_n\n'
        '0.1,60e-9,0.03,0.001\n\n0.5,8e-8,0.05,0.002\n'
    )
    assert experiment.kind == BY_AMPLITUDE
    assert experiment.notes == ('ruby on steel', 'run 7')
    np.testing.assert_array_equal(experiment.columns['amplitude_m'], [60e-9, 80e-9])
    np.testing.assert_array_equal(experiment.columns['force_sigma_n'], [0.001, 0.002])


def test_a_table_over_time_is_read():
    experiment = parse('time_s,force_n,voltage_v\n-1,0.03,0\n0,0.04,300\n')
    assert experiment.kind == OVER_TIME
    np.testing.assert_array_equal(experiment.columns['time_s'], [-1.0, 0.0])


def test_what_a_spreadsheet_writes_is_read():
    text = '\ufeffpreload_n,amplitude_m,force_n\r\n"0.1","6e-8",0.03\r\n'
    assert parse_experiment(text.encode(), 'exp.csv').columns['force_n'][0] == 0.03


def test_every_uncertainty_belongs_to_a_column():
    for columns in (POINT_COLUMNS, TIME_COLUMNS):
        sigmas = [name for name in columns if '_sigma_' in name]
        assert sigmas
        assert all(any(sigma_name(name) == each for name in columns) for each in sigmas)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('', "exp.csv: line 1: column 'preload_n' is missing; add it, in N"),
        ('# note\n', "exp.csv: line 1: column 'preload_n' is missing"),
        (POINTS, 'exp.csv: has no values below its header; give at least one row'),
        ('preload_n,force_n\n1,2\n', "line 1: column 'amplitude_m' is missing; add it, in m"),
        ('preload_n,amplitude_m\n1,2\n', 'nothing was measured; add at least one of force_n'),
        ('time_s\n1\n', 'nothing was measured; add at least one of position_m, force_n'),
        (
            'preload_n,amplitude_nm,force_n\n1,60,2\n',
            "line 1: column 'amplitude_nm' is not known; give it in m under the name 'amplitude_m",
        ),
        (
            'preload_n,amplitude_m,Force [mN]\n1,6e-8,2\n',
            "column 'Force [mN]' is not known; give it in N under the name 'force_n'",
        ),
        ('time_ms,force_n\n1,2\n', "column 'time_ms' is not known; take it away; known are"),
        ('time_s,amplitude_m\n1,2\n', "column 'amplitude_m' is not known; take it away"),
        ('preload_n;amplitude_m;force_n\n', 'separate columns with commas, and write decimals'),
        ('preload_n,,force_n\n1,2,3\n', "column '' is not known; take it away"),
        (
            'preload_n,amplitude_m,force_n,force_n\n1,6e-8,2,2\n',
            "line 1: column 'force_n' comes twice; take one of them away",
        ),
        (
            'preload_n,amplitude_m,force_n,step_length_sigma_m\n1,6e-8,2,2\n',
            "'step_length_sigma_m' is there without 'step_length_m'; add that one",
        ),
        (f'# a\n{POINTS}1,6e-8,2\n1,6e-8\n', 'exp.csv: line 4 has 2 values, the header 3 columns'),
        (f'{POINTS}1,6e-8,0,05\n', 'line 2 has 4 values, the header 3 columns; give one value'),
        (f'{POINTS}1,6e-8,"0,05"\n', "line 2, column force_n: '0,05' is not a finite number"),
        (f'{POINTS}1,6e-8,\n', "line 2, column force_n: '' is not a finite number; give a number"),
        (f'{POINTS}1,6e-8,nan\n', "line 2, column force_n: 'nan' is not a finite number"),
        (f'{POINTS}1,60,2\n', 'column amplitude_m: 60 m is above the maximum 1 m; lower it'),
        (f'{POINTS}1,-6e-8,2\n', 'column amplitude_m: -6e-08 m is below the minimum 0 m'),
        (f'{POINTS}0,6e-8,2\n', 'column preload_n: 0 N is below the minimum 0.001 N; raise it'),
        (f'{POINTS}1,6e-8,2e3\n', 'column force_n: 2000 N is above the maximum 1000 N; lower it'),
        (
            'preload_n,amplitude_m,force_n,force_sigma_n\n1,6e-8,2,0\n',
            'line 2, column force_sigma_n: 0 N is not above 0; give the standard deviation',
        ),
        (
            'preload_n,amplitude_m,force_n,force_sigma_n\n1,6e-8,2,-1\n',
            'line 2, column force_sigma_n: -1 N is below the minimum 0 N; raise it',
        ),
        (
            f'{TIMES}0,1e-9\n0.2,1e-9\n0.1,1e-9\n',
            'exp.csv: line 4, column time_s: 0.1 s is not after the 0.2 s of the row before; sort',
        ),
        (f'{TIMES}0,1e-9\n0,1e-9\n', 'line 3, column time_s: 0 s is not after the 0 s'),
        (f'{POINTS}1,6e-8,"2\n', 'is not CSV'),
    ],
)
def test_a_bad_file_is_refused_by_line_column_value_and_mend(text, message):
    with pytest.raises(StickSlipError) as caught:
        parse(text)
    assert message in str(caught.value)
    assert str(caught.value).startswith('exp.csv: ')


def test_what_is_no_text_is_refused():
    with pytest.raises(StickSlipError, match='byte 2 is not UTF-8; save it as CSV'):
        parse_experiment(b'ab\xff\xfe', 'exp.csv')


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(StickSlipError, match='cannot be read'):
        read_experiment(tmp_path / 'missing.csv')
    with pytest.raises(StickSlipError, match='cannot be read'):
        read_experiment(tmp_path)
