# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A sweep: what it goes through, what it refuses, and its table."""

import csv
import dataclasses
import json
import math
import sys

import pyarrow.parquet
import pytest

import stickslip_ros
from stickslip_ros.contact import power_sums, profile
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, UnknownName, WrongKind
from stickslip_ros.extras import MissingExtra
from stickslip_ros.lab.measurements.sweep_table import check_table_path, read_table, write_table
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.lab.runs.sweep import (
    Axis,
    Sweep,
    SweepCase,
    case_course,
    parse_axis,
    parse_varied,
    run_sweep,
)
from stickslip_ros.parameters import AMPLITUDE_SPEC, column_name, spec_of

PRELOAD = spec_of('stand.preload')
GROUPS, INDENTING, TABULATING = 2, 2, 1
"""Groups of equal contacts, and what is solved for each: depth and radius; the virgin curve."""
COLUMNS = [
    'preload_n', 'amplitude_m', 'frequency_hz', 'force_mean_n', 'force_net_n',
    'force_ramp_start_n', 'step_length_m', 'energy_loss_per_step_j', 'steady', 'steps',
    'energy_residual', 'stop_rule',
]  # fmt: skip


@pytest.fixture
def short(stand):
    """Give twelve short runs."""
    varied = (Axis('contact.friction', (0.2, 0.3)), Axis('stand.preload', (0.1, 0.5, 1.0)))
    return Sweep(stand, varied, (1000.0,), (60e-9, 160e-9), 20)


def test_a_list_is_taken_as_it_is_typed():
    assert parse_axis('preload', '0.1, 0.4,1', PRELOAD).values == (0.1, 0.4, 1.0)
    assert parse_axis('preload', '5e-1', PRELOAD).values == (0.5,)
    profile = spec_of('contact.profile')
    assert parse_axis('profile', 'rough,smooth', profile).values == ('rough', 'smooth')
    assert parse_axis('seed', '3,1', spec_of('sim.seed')).values == (3, 1)


def test_a_range_includes_both_ends():
    values = parse_axis('amplitude', '0:160e-9:33', AMPLITUDE_SPEC).values
    assert len(values) == 33
    assert (values[0], values[-1]) == (0.0, 160e-9)
    assert values[16] == pytest.approx(80e-9, rel=1e-12, abs=0.0)
    assert parse_axis('preload', '1:0.5:2', PRELOAD).values == (1.0, 0.5)
    whole = parse_axis('seed', '1:5:3', spec_of('sim.seed')).values
    assert whole == (1, 3, 5)
    assert all(isinstance(value, int) for value in whole)


@pytest.mark.parametrize(
    ('text', 'kind', 'message'),
    [
        ('0.1:1', WrongKind, "preload '0.1:1' is not start:stop:count; write values with commas"),
        ('0.1:1:2:3', WrongKind, 'is not start:stop:count'),
        ('0.1:x:3', WrongKind, "preload 'x' is not a number in uN, mN, N or kN; give"),
        ('nan:1:3', WrongKind, "preload 'nan' is not a number in uN"),
        ('0.1:1:2.5', WrongKind, "preload count '2.5' is not a whole number"),
        ('0.1:1:1', OutOfRange, 'preload count 1 is below the minimum 2; raise it'),
        ('0.1:1:-4', OutOfRange, 'preload count -4 is below the minimum 2'),
        ('0.1:1:100001', OutOfRange, 'count 100001 is above the maximum 100000; lower it'),
        ('0.5:0.5:3', OutOfRange, 'preload 0.5 N is both start and stop of a range of 3; move'),
        ('0:1:3', OutOfRange, 'preload 0 N is below the minimum 0.001 N; raise it'),
        ('0.1,200', OutOfRange, 'preload 200 N is above the maximum 100 N; lower it'),
        ('0.1,,1', WrongKind, "preload '' is not a number in uN"),
        ('', WrongKind, "preload '' is not a number in uN"),
    ],
)
def test_a_bad_list_or_range_is_refused(text, kind, message):
    with pytest.raises(kind) as caught:
        parse_axis('preload', text, PRELOAD)
    assert message in str(caught.value)


def test_a_range_of_whole_numbers_must_meet_them():
    with pytest.raises(OutOfRange, match=r'seed in 1:4:3 2\.5 is not a whole number; change the'):
        parse_axis('seed', '1:4:3', spec_of('sim.seed'))


@pytest.mark.parametrize(
    ('assignment', 'kind', 'message'),
    [
        ('contact.friction', WrongKind, 'is not a parameter with values; write --vary group.name'),
        ('contact.fricton=1', UnknownName, 'did you mean contact.friction'),
        ('contact.profile=rough,round', OutOfRange, "contact.profile 'round' is not one of"),
        ('contact.friction=0.2:0.3:1', OutOfRange, 'contact.friction count 1 is below'),
    ],
)
def test_a_bad_variation_is_refused(assignment, kind, message):
    with pytest.raises(kind) as caught:
        parse_varied([assignment])
    assert message in str(caught.value)


def test_a_sweep_is_the_full_product_with_amplitude_fastest(short):
    cases = short.cases()
    assert len(cases) == 12
    assert cases[0] == SweepCase(
        (('contact.friction', 0.2), ('stand.preload', 0.1)), 60e-9, 1000.0
    )
    assert cases[1].amplitude_m == 160e-9
    assert cases[2].values == (('contact.friction', 0.2), ('stand.preload', 0.5))
    assert cases[6].values == (('contact.friction', 0.3), ('stand.preload', 0.1))
    assert len(set(cases)) == 12


def test_a_case_solves_nothing_that_one_before_it_has_solved(stand, monkeypatch):
    solved = []
    solve = power_sums.solve_power_sum

    def noted_and_solved(*given):
        solved.append(given)
        return solve(*given)

    monkeypatch.setattr(profile, 'solve_power_sum', noted_and_solved)

    def solves_of(**changes):
        values = {'stand.preload': 0.4321, 'stand.preload_limit': 1.234} | {
            name.replace('_', '.', 1): changes[name] for name in changes
        }
        solved.clear()
        case = SweepCase(tuple(values.items()), 60e-9, 1000.0)
        run_course(case_course(Sweep(stand, (), (1000.0,), (60e-9,), 1), case))
        return len(solved)

    assert solves_of() >= GROUPS * (INDENTING + TABULATING)
    assert solves_of(runner_damping=1.0) == 0
    assert solves_of(contact_friction=0.29) == GROUPS * TABULATING
    assert solves_of(stand_preload=0.5321) == GROUPS * (INDENTING + TABULATING)


def test_a_sweep_without_variation_is_one_run(stand):
    assert Sweep(stand, (), (1000.0,), (60e-9,)).cases() == [SweepCase((), 60e-9, 1000.0)]


@pytest.mark.parametrize(
    ('change', 'message'),
    [
        ({'amplitudes_m': (60e-9, 161e-9)}, 'amplitude 1.61e-07 m is above the 1.6e-07 m'),
        ({'amplitudes_m': (-1e-9,)}, 'amplitude -1e-09 m is below the minimum 0 m; raise it'),
        ({'frequencies_hz': (1000.0, 0.0)}, 'frequency 0 Hz is not a frequency'),
        ({'frequencies_hz': (3e4,)}, "frequency 30000 Hz is above the amplifier's 20000 Hz"),
        ({'steps': -1}, 'steps -1 is below 0; give a number, or 0 for the steady state'),
        (
            {'varied': (Axis('stand.preload', (0.1,)), Axis('stand.preload', (0.2,)))},
            "parameter 'stand.preload' is varied twice; put all its values into one list",
        ),
        (
            {'varied': (Axis('sim.seed', (1,) * 100_000),), 'frequencies_hz': (1e3,) * 5001},
            'number of runs 1000200000 is above the maximum 1000000000; take fewer values',
        ),
        (
            {'varied': (Axis('contact.rms_height', (1e-6,)),)},
            'contact.rms_height 1e-06 m is without effect',
        ),
    ],
)
def test_what_the_stand_cannot_do_is_refused_before_the_first_run(short, change, message):
    with pytest.raises(StickSlipError) as caught:
        dataclasses.replace(short, **change)
    assert message in str(caught.value)


def test_the_table_is_the_same_to_the_bit_for_any_number_of_workers(short):
    one, two, three = (json.dumps(run_sweep(short, workers=workers)) for workers in (1, 2, 3))
    assert one == two == three


def test_a_row_names_what_was_varied_and_what_came_of_it(short, stand):
    rows = run_sweep(short)
    assert [list(row) for row in rows] == [['contact.friction', *COLUMNS]] * 12
    row = rows[9]
    there = stand.updated({'contact.friction': 0.3, 'stand.preload': 0.5})
    run = run_drive(there, 160e-9, 1000.0, 20)
    assert (row['contact.friction'], row['preload_n'], row['amplitude_m']) == (0.3, 0.5, 160e-9)
    assert row['force_mean_n'] == run.force_mean_n
    assert row['energy_loss_per_step_j'] == run.energy_loss_per_step_j > 0.0
    assert (row['steps'], row['stop_rule']) == (20, '20 steps')


def test_a_varied_parameter_is_named_with_its_unit(stand):
    assert column_name('load_cell.stiffness') == 'load_cell.stiffness [N/m]'
    assert column_name('contact.hurst') == 'contact.hurst'
    ramped = stand.updated({'stand.preload_end': 0.4})
    preload = (Axis('stand.preload', (0.1,)),)
    assert Sweep(ramped, preload, (1000.0,), (1e-9,)).columns() == ('stand.preload',)
    assert Sweep(stand, preload, (1000.0,), (1e-9,)).columns() == ()


def test_an_amplitude_of_zero_is_a_drive_at_rest(stand):
    (row,) = run_sweep(Sweep(stand, (), (1000.0,), (0.0,)))
    assert (row['force_mean_n'], row['step_length_m'], row['steps']) == (0.0, 0.0, 0)


def test_csv_keeps_every_bit_and_the_parameters(short, tmp_path):
    rows = [*run_sweep(short), {}]
    rows[-1] = {**rows[0], 'force_mean_n': math.nextafter(0.1, 1.0), 'step_length_m': -5e-324}
    path = tmp_path / 'table.csv'
    write_table(rows, path, short.parameters)
    with path.open(newline='', encoding='utf-8') as file:
        version, told, *lines = file
    back = list(csv.DictReader(lines))
    assert version == f'# stickslip_ros.version: {stickslip_ros.__version__}\n'
    name, _, parameters = told.removeprefix('# ').partition(': ')
    assert name == 'stickslip_ros.parameters'
    assert json.loads(parameters) == json.loads(json.dumps(short.parameters.flat()))
    assert list(back[0]) == ['contact.friction', *COLUMNS]
    for row, text in zip(rows, back, strict=True):
        for name, value in row.items():
            assert (float(text[name]) if type(value) is float else text[name]) == (
                value if type(value) is float else str(value)
            )
    assert [file.name for file in path.parent.iterdir()] == ['table.csv']


def test_parquet_keeps_every_bit_and_the_parameters(short, tmp_path):
    rows = run_sweep(short)
    path = tmp_path / 'table.parquet'
    check_table_path(path)
    write_table(rows, path, short.parameters)
    table = pyarrow.parquet.read_table(path)
    assert table.to_pylist() == rows
    parameters = json.loads(table.schema.metadata[b'stickslip_ros.parameters'])
    assert parameters == json.loads(json.dumps(short.parameters.flat()))


def test_a_table_that_could_not_be_written_is_refused_at_once(tmp_path, monkeypatch):
    with pytest.raises(WrongKind, match=r"output 'table\.txt' is not a \.csv or \.parquet file"):
        check_table_path((tmp_path / 'table.txt').relative_to(tmp_path))
    (tmp_path / 'a.csv').mkdir()
    with pytest.raises(RecordingError, match='is a folder; choose another name'):
        check_table_path(tmp_path / 'a.csv')
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    with pytest.raises(MissingExtra, match=r"a Parquet file needs the package 'pyarrow'.*pip in"):
        check_table_path(tmp_path / 'a.parquet')
    check_table_path(tmp_path / 'b.csv')


def test_both_ways_adds_the_step_backwards_of_a_mirrored_drive_which_a_table_keeps(
    stand, tmp_path
):
    free = stand.updated({'load_cell.contact': 'absent'})
    (row,) = run_sweep(Sweep(free, (), (1000.0,), (160e-9,), 20, both_ways=True))
    assert row['step_back_m'] == -run_drive(free, 160e-9, -1000.0, 20).step_length_m
    assert row['step_back_m'] == pytest.approx(row['step_length_m'], rel=1e-6, abs=0.0)
    write_table([row], tmp_path / 'a.csv', free)
    assert read_table(tmp_path / 'a.csv')[0][0]['step_back_m'] == row['step_back_m']
    with pytest.raises(OutOfRange, match='frequency -1000 Hz is below 0 with --both-ways'):
        Sweep(free, (), (-1000.0,), (160e-9,), both_ways=True)


def test_its_digest_knows_version_parameters_and_each_value(short, monkeypatch):
    others = [
        {'parameters': short.parameters.updated({'runner.damping': 1e-9})},
        {'varied': short.varied[:1]},
        {'frequencies_hz': (1000.0000000000001,)},
        {'amplitudes_m': (60e-9, 159e-9)},
        {'steps': 21},
        {'both_ways': True},
    ]
    digests = {dataclasses.replace(short, **other).digest() for other in [{}, {}, *others]}
    assert len(digests) == 1 + len(others)
    monkeypatch.setattr(stickslip_ros, '__version__', '99')
    assert short.digest() not in digests
