# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Headers of instruments, times of rows, and remedies that are carried out."""

import itertools
import re
from dataclasses import replace
from typing import Any

import header_files
import numpy as np
import pytest
from header_files import COUNT, FILES, MICRONS, TIMES_S, VOLTS, columns, of

from stickslip_ros import StickSlipError
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.measurements.table_options import TABLE_DEFAULTS, TableOptions
from stickslip_ros.lab.measurements.tables import parse_experiment
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable
from stickslip_ros.units import parse_quantity

ROUNDING = 1e-12
DEEPEST = 3
"""Refusals behind each other whose remedies are carried out."""


def read(text: str, reading: TableOptions = TABLE_DEFAULTS) -> MeasuredTable:
    return parse_experiment(text.encode(), 'a.csv', reading)


def known(table: MeasuredTable, name: str) -> tuple[np.ndarray, np.ndarray]:
    rows = ~np.isnan(table.columns[name])
    return table.columns['time_s'][rows], table.columns[name][rows]


@pytest.mark.parametrize('name', FILES)
def test_an_instrument_says_names_units_and_times(name: str):
    text, headers, first_s = FILES[name]
    table = read(text, TableOptions(headers))
    late_s = {'two clocks': 5e-5, 'LabVIEW with two clocks': 5e-5, 'PlotJuggler': 2e-5}
    for column, truth, delay_s in (
        ('voltage_v', np.array(VOLTS), 0.0),
        ('position_m', 1e-6 * np.array(MICRONS), late_s.get(name, 0.0)),
    ):
        time_s, values = known(table, column)
        np.testing.assert_allclose(values, truth, rtol=ROUNDING, atol=1e-18)
        np.testing.assert_allclose(time_s, first_s + delay_s + np.array(TIMES_S), atol=ROUNDING)


def test_settings_of_an_instrument_may_have_a_decimal_comma():
    text = FILES['LabVIEW without times'][0].replace('1e-4', '0.0001').replace('.', ',')
    time_s, values = known(read(text), 'voltage_v')
    np.testing.assert_allclose(time_s, 0.5 + np.array(TIMES_S), rtol=ROUNDING)
    np.testing.assert_allclose(values, VOLTS, rtol=ROUNDING)


def test_a_rate_counts_rows_and_sets_the_columns_of_times_aside():
    text = FILES['coarse times'][0]
    table = read(text, TableOptions(header_files.SCOPE, rate_hz=10e3))
    assert table.columns['time_s'].tolist() == TIMES_S
    assert table.unread == ('Time(s)',)
    points = of('preload_n,amplitude_m,force_n', [(0.5, 6e-8, 0.01)])
    with pytest.raises(StickSlipError, match='--rate is without effect on an experiment by amp'):
        read(points, TableOptions(rate_hz=1e3))
    with pytest.raises(StickSlipError, match='--rate with --map time_s= is without effect'):
        read(text, TableOptions({'time_s': 'Time (s)'}, rate_hz=1e3))
    with pytest.raises(StickSlipError, match=r'line 3: is empty, so the times of the rows'):
        read('voltage (V),a\n1,2\n\n3,4\n', TableOptions(rate_hz=1e3))
    for wrong in (0.0, -1.0, float('nan')):
        with pytest.raises(StickSlipError, match='--rate'):
            TableOptions(rate_hz=wrong)


def test_only_named_quantities_are_read_and_need_units():
    text = of('t,q,v,F,sigma F', columns(TIMES_S, MICRONS, 0.1, 0.2, 0.3))
    table = read(
        text, TableOptions({'time_s': 't (s)', 'force_n': 'F (N)', 'force_sigma_n': '#5 (N)'})
    )
    assert list(table.columns) == ['time_s', 'force_n', 'force_sigma_n']
    assert table.unread == ('q', 'v')


def test_columns_of_one_name_are_named_by_number():
    text = of('time (s),CH,CH', columns(TIMES_S, 1, 2))
    with pytest.raises(StickSlipError, match=r'--map voltage_v="#\.\.\. \(V\)"'):
        read(text, TableOptions({'voltage_v': 'CH (V)'}))
    assert read(text, TableOptions({'voltage_v': '#3 (V)'})).columns['voltage_v'][0] == 2.0
    with pytest.raises(StickSlipError, match="there is no column '#4"):
        read(text, TableOptions({'voltage_v': '#4 (V)'}))


@pytest.mark.parametrize(
    ('header', 'told'),
    [
        ('time (s),t (ms),voltage (V)', "columns 'time (s)' and 't (ms)' may both be time_s"),
        ('voltage (V),time (s),force (N),time (s)', 'may both be time_s'),
    ],
)
def test_clocks_that_do_not_alternate_with_values_are_ambiguous(header: str, told: str):
    with pytest.raises(StickSlipError, match=re.escape(told)):
        read(
            of(header, [range(4), range(1, 5)]) if header.count(',') == 3 else f'{header}\n1,2,3\n'
        )


@pytest.mark.parametrize('name', ['delta_x', 'timestamp'])
def test_columns_that_began_apart_or_have_other_rates_are_not_joined(name: str):
    if name == 'timestamp':
        text = FILES['logger'][0].replace('09:00:00\nInt', '09:00:01\nInt')
    else:
        text = FILES['LabVIEW without times'][0].replace('\t1e-4\t1e-4', '\t1e-4\t2e-4')
    with pytest.raises(StickSlipError, match=f'has columns of different {name}: .*; save each in'):
        read(text)


@pytest.mark.parametrize(
    'mark', ['∞', '-∞', 'OVER', 'OVERFLOW', '+OVR', 'OL', 'O.L', '+++++', 'Burnout', '9.9E+37']
)
def test_marks_of_over_range_are_gaps_and_counted(mark: str):
    table = read(
        f'Time,CH\n(us),(V)\n\n0,{mark}\n1,2\n2,\n3,4\n', TableOptions({'voltage_v': 'CH'})
    )
    assert table.columns['voltage_v'].tolist() == [2.0, 4.0]
    told = "2 of 4 rows without 'CH' were left out, the first is line 4"
    assert table.gaps == (told,)


def test_signs_apart_from_digits_are_read():
    text = 'time (s),voltage (V)\n+ 0,-   2.5\n+ 1,+ 0.5\n'
    assert read(text).columns['voltage_v'].tolist() == [-2.5, 0.5]


UNEVEN = '0 1 3 2 4; 3 2 1 0; 0 1 2 0 1 2; 0 0; 0 1 1 2 3; 0 0 1 1 1 1 2 2 3; 0 0 0 1 1 1 3 3 3 4'


@pytest.mark.parametrize('times', UNEVEN.split('; '))
def test_times_that_do_not_rise_are_refused_unless_even_rows_share_them(times: str):
    rows = ((each, row) for row, each in enumerate(times.split()))
    with pytest.raises(StickSlipError, match=r'line \d+.* is not after .*; sort the rows by time'):
        read(of('time (s),voltage (V)', rows))


@pytest.mark.parametrize('rows_per_tick', [2.5, 3.3, 7.0, 10.0])
@pytest.mark.parametrize('rounding', [np.floor, np.rint])
def test_coarse_times_are_spread_within_their_resolution(rows_per_tick: float, rounding):
    truth = np.arange(200) / rows_per_tick
    table = read(of('time (ms),voltage (V)', ((int(each), 1) for each in rounding(truth))))
    assert np.max(np.abs(1e3 * table.columns['time_s'] - truth)) < 1.0
    [note] = table.gaps
    assert 'times repeat, in steps of 0.001 s; rows are spread evenly' in note


def test_topics_are_no_columns_unless_recordings_are_among_the_sources():
    text, reading = (
        of('time (s),voltage (V)', columns(TIMES_S, VOLTS)),
        TableOptions({'voltage_v': '/u'}),
    )
    with pytest.raises(StickSlipError, match="there is no column '/u'"):
        read(text, reading)
    assert read(text, replace(reading, only_tables=False)).columns['voltage_v'].tolist() == VOLTS


OTHERS = {
    'steps': 'voltage (V),up (nm),down (nm)\n20,21,18\n30,63,55\n',
    'names alone': of('t,q,v,F', columns(TIMES_S, MICRONS, 0.1, 0.2)),
    'numbers alone': of('0,5,6', columns(TIMES_S, VOLTS, MICRONS)),
    'unknown names': of('A,B,C', columns(TIMES_S, VOLTS, MICRONS)),
    'known names without time': of('Voltage,Position', columns(VOLTS, MICRONS)),
    'ticks': of('chunk;timestamp;value', columns(0, list(range(9, 49)), VOLTS), ';'),
    'epoch without unit': of('time,position (m)', columns([10**18 + i for i in range(COUNT)], 0)),
    'pair without times': of('Time,x,Time,u', columns(TIMES_S, MICRONS, TIMES_S, VOLTS)),
    'two of a name': of('time (s),x (um),x (um)', columns(TIMES_S, 1, 2)),
    'two forces': of('time (s),force (N),F (mN)', columns(TIMES_S, 1, 2)),
    'two clocks side by side': of('time (s),t (ms),x (um)', columns(TIMES_S, TIMES_S, 1)),
    'wrong unit': of('time (s),position (V)', columns(TIMES_S, VOLTS)),
    'large': of('time (s),position (m)', columns(TIMES_S, 30)),
    'far': of('time (s),position (m)', columns([10**15 + i for i in range(COUNT)], 0)),
    'restart': of('time (us),u (V)', (((70 + row) % 100, 1) for row in range(COUNT * 2))),
    'repeats': of('time (s),u (V)', columns(0, 1)),
    'points': 'Stroke,force\n60,2\n',
    'points with preload': 'preload_n,Stroke,force\n1,60,2\n',
    'point without stroke': 'preload_n,force\n1,2\n',
    'per preload': 'Hub (nm);Fp = 100 mN;Fp = 250 mN\n60;18;20\n',
    'long': of(f'time (s),{"x" * 70} (um),"a ""b"" $c"', columns(TIMES_S, 1, 2)),
    'speed alone': of('time (s),speed (m/s)', columns(TIMES_S, 1)),
}
GIVEN = {
    'nothing': TableOptions(),
    'preload': TableOptions(preloads_n=(0.5,)),
    'rate': TableOptions(rate_hz=1e3),
    'column that is not there': TableOptions({'voltage_v': 'nothing (V)'}),
    'topic': TableOptions({'position_m': '/rig/x'}),
    'no unit': TableOptions({'force_n': '#2', 'time_s': '#1'}),
}
TEXTS = {**{name: text for name, (text, *_) in FILES.items()}, **OTHERS}


FILLED = {'--rate ...kHz': '--rate 10kHz', '--preload ...N': '--preload 0.5N'}
"""What a user fills into an option that is no column."""
PREFIX = re.compile(r'\(\.\.\.(?=[smNVHFg])')
"""Before a unit whose prefix is to be filled in."""
NUMBER = re.compile(r'[-+]?[\d.]+(e[-+]?\d+)?', re.IGNORECASE)


def remedies(options: TableOptions, refusal: StickSlipError) -> list[TableOptions]:
    """Return the options that a user makes of a refusal, filled in with each column of numbers."""
    message = str(refusal)
    if away := re.search(r'(--\w+)(?: with --map time_s=| (\w+)=)? is without', message):
        headers = {each: text for each, text in options.headers.items() if each != away[2]}
        without: dict[str | None, dict[str, Any]] = {
            '--preload': {'preloads_n': ()},
            '--rate': {'rate_hz': None},
        }
        return [replace(options, headers=headers, **without.get(away[1], {}))]
    if 'leave out --preload' in message:
        return [replace(options, preloads_n=())]
    found = list[TableOptions]()
    for dots, filled in FILLED.items():
        message = message.replace(dots, filled)
    numbers = [row[0] for row in getattr(refusal, 'table', ())[1:] if row[3] == 'number']
    prefix = '(p' if 'above the largest' in message else '(n'
    for part in message.split(', or '):
        maps = dict(re.findall(r'--map (\w+)="([^"]*)"', part))
        open_names = [name for name, text in maps.items() if text.startswith(('...', '#...'))]
        for chosen in [*itertools.permutations(numbers, len(open_names))] if maps else []:
            headers = dict(maps)
            for name, column in zip(open_names, chosen, strict=True):
                headers[name] = column + headers[name].partition('...')[2]
            for name, text in headers.items():
                headers[name] = PREFIX.sub(prefix, text.replace('(... ', '(2 ')).replace('...', '')
            found.append(replace(options, headers={**options.headers, **headers}))
        if rate := re.search(r'--rate (\S+)', part):
            found.append(replace(options, rate_hz=parse_quantity(rate[1], 'Hz')))
        if preload := re.search(r'--preload (\S+)N', part):
            found.append(replace(options, preloads_n=(float(preload[1]),)))
    return found


def check_numbers(text: str, table: MeasuredTable) -> None:
    """Check that each number but a time is one of its column, in the unit that is told."""
    lines = [re.split(r'[,;\t]', line) for line in text.splitlines()]
    for column in table.recognised:
        if column.name == 'time_s' or column.name not in table.columns:
            continue
        cells = [row[column.index].replace(' ', '') for row in lines if len(row) > column.index]
        numbers = [column.factor * float(each) for each in cells if NUMBER.fullmatch(each)]
        values = table.columns[column.name]
        values = values[~np.isnan(values)]
        assert len(values)
        for value in values:
            assert min(abs(each - value) for each in numbers) <= 1e-9 * abs(value), column


@pytest.mark.parametrize('name', TEXTS)
@pytest.mark.parametrize('given', GIVEN)
def test_each_remedy_that_a_refusal_names_leads_to_its_numbers(name: str, given: str):
    waiting: list[tuple[TableOptions, tuple[str, ...]]] = [(GIVEN[given], ())]
    seen = set[str]()
    while waiting:
        options, earlier = waiting.pop()
        if repr(options) in seen:
            continue
        seen.add(repr(options))
        try:
            check_numbers(TEXTS[name], read(TEXTS[name], options))
        except StickSlipError as refusal:
            message = str(refusal)
            assert message not in earlier, f'{options} leads to the same refusal'
            ways = remedies(options, refusal)
            assert ways or '--' not in message, message
            if len(earlier) < DEEPEST:
                waiting += [(each, (*earlier, message)) for each in ways]


@pytest.mark.parametrize('name', TEXTS)
def test_a_refusal_shows_the_columns_of_a_file_and_offers_no_text_as_a_number(name: str):
    with pytest.raises(RecordingError) as refusal:
        read(TEXTS[name], TableOptions({'force_n': 'no such column'}))
    title, *rows = refusal.value.table
    assert title == ('#', 'name', 'unit', 'kind', 'first', 'last')
    offered = re.findall(r'(#\d+) ', str(refusal.value).partition('columns of numbers: ')[2])
    assert offered == [row[0] for row in rows if row[3] == 'number'][: len(offered)]
    for number, _, _, kind, first, last in rows:
        assert number[1:].isdecimal()
        if kind == 'number':
            assert re.fullmatch(r'[-+ ]*[\d.,e+-]+', first or last), (first, last)
