# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Experiment files: what is read, and what is refused with line, column, value and hint."""

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.measurements.numbers import sigma_name
from stickslip_ros.lab.measurements.tables import parse_experiment
from stickslip_ros.lab.measurements.vocabulary import BY_AMPLITUDE, POINT_COLUMNS, TIME_COLUMNS

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


def test_every_uncertainty_belongs_to_a_column():
    for columns in (POINT_COLUMNS, TIME_COLUMNS):
        sigmas = [name for name in columns if '_sigma_' in name]
        assert sigmas
        assert all(any(sigma_name(name) == each for name in columns) for each in sigmas)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('\n', 'exp.csv: is empty; save it as text'),
        (POINTS, 'exp.csv: line 1: has no rows of numbers in its first 2 lines'),
        ('time_s,force_n,a,b\n,,1,2\n', 'line 1: has no values below its header; give at'),
        (
            'preload_n,force_n\n1,2\n',
            'line 1: there is no amplitude_m or voltage_v; columns of numbers',
        ),
        ('preload_n,amplitude_m\n1,2\n', 'or decay_s or step_back_m or another number'),
        ('time_s,temp\n1,2\n', 'or voltage_v or foot_m; columns of numbers: #1 '),
        (
            'Stroke (nm),F (mN)\n60,2\n',
            'add a column preload_n (N), or fill in the preload of the file, --preload ...N',
        ),
        ('Time (s),Force (V)\n0,1\n', '#2 \'Force (V)\'; fill in --map voltage_v="... (V)"'),
        ('Time (s),CH1 (V)\n0,1\n', 'fill in --map voltage_v="... (V)"'),
        ('t,load\n0,1\n', 'fill in --map time_s="t (...s)" --map force_n="load (...N)"'),
        (
            '0 1\n1 2\n',
            "line 1: has neither a time nor an amplitude; columns of numbers: #1 '1', #2 '2'",
        ),
        (
            'preload_n,amplitude_m,force_n,Force (mN)\n1,6e-8,2,2\n',
            "columns 'force_n' and 'Force (mN)' may both be force_n; columns of numbers: #1 ",
        ),
        (
            'preload_n,amplitude_m,force_n,step_length_sigma_m\n1,6e-8,2,2\n',
            "'step_length_sigma_m' is there without 'step_length_m'; add that one",
        ),
        (
            f'{POINTS}1,6e-8,0,05\n',
            'line 2: has 4 values, the header in line 1 3 names; name every column; with decimal',
        ),
        (
            f'{POINTS}1,6e-8,2\n1,6e-8,0,05\n',
            'line 3: has 4 values, the lines above 3; give one value per column; with decimal',
        ),
        (
            'preload_n,amplitude_m,force_n,\n1,6e-8,2,\n1,6e-8,0,05\n',
            'line 3: has more values than the 3 columns with names; give one value per column',
        ),
        (f'{POINTS}1,6e-8,"0,05"\n', "line 2, column force_n: '0,05' is not a finite number"),
        (f'{POINTS}1,6e-8,x\n1,7e-8,2\n', "line 2, column force_n: 'x' is not a finite number"),
        (f'{POINTS}1,6e-8,inf\n', "line 2, column force_n: 'inf' is not a finite number"),
        (f'{POINTS}1,6e-8,nan\n', 'line 1: has no values below its header; give at least a row'),
        (
            f'{POINTS}1,30,2\n',
            '30 m is above the largest amplitude_m, 0.001 m; correct the row, or fill in',
        ),
        (f'{POINTS}1,-6e-8,2\n', 'column amplitude_m: -6e-08 m is below the minimum 0 m; correct'),
        (f'{POINTS}0,6e-8,2\n', 'column preload_n: 0 N is below the minimum 0.001 N; correct'),
        (f'{POINTS}1,6e-8,2e3\n', 'column force_n: 2000 N is above the largest force_n, 1000 N'),
        (
            'preload_n,amplitude_m,force_n,force_sigma_n\n1,6e-8,2,0\n',
            'line 2, column force_sigma_n: 0 N is not above 0; give the standard deviation',
        ),
        (f'{TIMES}0,1e-9\n0,1e-9\n', 'column time_s: 0 s is not after the 0 s of the row before'),
        (
            f'{POINTS}1,6e-8,2\n1,6e-8,"2\n',
            'C error: EOF inside string starting at row 1); save it again as CSV',
        ),
    ],
)
def test_a_bad_file_is_refused_by_line_column_value_and_hint(text, message):
    with pytest.raises(StickSlipError) as caught:
        parse(text)
    assert message in str(caught.value)
    assert str(caught.value).startswith('exp.csv: ')


def test_what_is_no_text_is_refused():
    with pytest.raises(StickSlipError, match=r'exp\.csv: is no text; save it as text: CSV'):
        parse_experiment(b'PK\x03\x04\x14\0\0\0\x08\0ab', 'exp.csv')
