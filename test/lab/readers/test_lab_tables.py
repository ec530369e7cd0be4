# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tables as laboratories have them: many layouts, the same numbers; and what is asked."""

import sys
from pathlib import Path

import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.extras import MissingExtra
from stickslip_ros.lab.measurements.measurement import TimeRun, of_table
from stickslip_ros.lab.measurements.numbers import sigma_name
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.tables import (
    parse_experiment,
    read_experiment,
    read_joined,
    write_experiment,
)
from stickslip_ros.lab.measurements.vocabulary import (
    BY_AMPLITUDE,
    OVER_TIME,
    POINT_COLUMNS,
    TIME_COLUMNS,
    USUAL,
)
from stickslip_ros.lab.readers.cells import CHUNK_CELLS
from stickslip_ros.lab.readers.units import factor_of
from stickslip_ros.parameters import SENSORS

ALIKE = {'fuß', 'fuss', 'frequenz'}
"""Names that the page has in another form."""
ROUNDING = 1e-12
"""Of 14 digits in the files."""
CHUNK_ROWS = CHUNK_CELLS // 2  # of a table with two columns


@pytest.mark.parametrize(
    'text',
    [
        'Time (s)   Force (mN)\n  0.0   1\n  1.0   2\n',
        'Time (s) Force (mN)\n0.0 1\n1.0 2\n',
        'Time (s), Force (mN)\n0, 1\n1, 2\n',
        'sep=;\nTime (s);Force (mN)\n0;1,0\n1;2,0\n',
        '"Time (s)","Force, raw (mN)","Force (mN)"\n"0","5","1"\n"1","5","2"\n',
        't [s];when;F / mN\n0;12:03:01;1\n1;12:03:02;2\n',
        'Time,Force\n[s],[mN]\n\n0,1\n\n1,2\n',
        '% t_s f_mN\r0 1\r1 2\r',
        'Prüfer: Müller;;\n\nKraft;Zeit;Spannung\nµN;ms;V\n1000,0;0;2,5\n2000;1000;2,5\n',
    ],
)
@pytest.mark.parametrize('encoding', ['utf-8-sig', 'utf-16', 'cp1252'])
def test_small_ways_of_writing_change_nothing(text: str, encoding: str):
    columns = parse_experiment(text.encode(encoding), 'a.csv').columns
    assert columns['time_s'].tolist() == [0.0, 1.0]
    assert columns['force_n'].tolist() == [1e-3, 2e-3]


@pytest.mark.parametrize('cell', ['', '#N/A', '#NV', 'NaN', 'n/a', '-', 'None'])
def test_a_point_without_a_number_is_left_out_and_counted(cell: str):
    lines = ['60;18,5;2', f'70;{cell};2', '80;20,5;2', f'90;21;{cell}', f'{cell};22;2']
    text = 'Hub (nm);Kraft (mN);Kraft err (mN)\n' + '\n'.join(lines)
    experiment = parse_experiment(text.encode(), 'a.csv', TableOptions(preloads_n=(0.5,)))
    assert experiment.columns['force_n'].tolist() == [18.5e-3, 20.5e-3]
    assert experiment.columns['force_sigma_n'].tolist() == [2e-3, 2e-3]
    assert experiment.gaps == (
        "1 of 5 rows without 'Hub (nm)' were left out, the first is line 6",
        "1 of 5 rows without 'Kraft (mN)' were left out, the first is line 3",
        "1 of 5 rows without 'Kraft err (mN)' were left out, the first is line 5",
    )
    assert set(experiment.gaps) <= set(experiment.notes)


def test_over_time_each_quantity_has_samples_of_its_own():
    text = b'time_s,force_n,position_m\n0,1,\n1,,1e-9\n2,,\n,5,5\n4,2,#N/A\n'
    experiment = parse_experiment(text, 'a.csv')
    run = of_table(experiment)
    assert isinstance(run, TimeRun)
    series = run.series
    assert series['force_n'].time_s.tolist() == [0.0, 4.0]
    assert series['force_n'].value.tolist() == [1.0, 2.0]
    assert series['position_m'].time_s.tolist() == [1.0]
    assert [each.split()[0] for each in experiment.gaps] == ['1', '2', '3']


def test_a_preload_in_a_header_is_no_guess():
    text = b'Hub (nm);Fp = 100 mN;Fp = 250 mN\n60;18;20\n'
    with pytest.raises(StickSlipError, match=r'no preload_n, .*--preload \.\.\.N'):
        parse_experiment(text, 'a.csv')
    said = TableOptions({'force_n': '#3 (mN)'}, preloads_n=(0.25,))
    columns = parse_experiment(text, 'a.csv', said).columns
    assert [columns[name].tolist() for name in ('preload_n', 'force_n')] == [[0.25], [20e-3]]


@pytest.mark.parametrize(
    ('text', 'row'),
    [
        (b'preload_n,amplitude_nm,force_mN\n0.1,60.1,0.817\n', '0.1,6.01e-08,0.000817'),
        (b'time_s,force_mN\n1620118800.1234567,0.817\n', '1620118800.1234567,0.000817'),
    ],
)
def test_numbers_are_written_shortest_and_times_to_the_bit(tmp_path: Path, text: bytes, row: str):
    write_experiment(parse_experiment(text, 'a.csv'), path := tmp_path / 'clean.csv')
    assert path.read_text().splitlines()[1] == row


@pytest.mark.parametrize(
    ('header', 'column', 'factor'),
    [
        ('Force (mN)', 'force_n', 1e-3),
        ('LOAD [µN]', 'force_n', 1e-6),
        ('F / N', 'force_n', 1.0),
        ('Kraft in der Zelle', None, 0.0),
        ('force_mN', 'force_n', 1e-3),
        ('Load cell (gf)', 'force_n', 9.80665e-3),
        ('standard deviation of force (mN)', 'force_sigma_n', 1e-3),
        ('Force error (mN)', 'force_sigma_n', 1e-3),
        ('F_std_mN', 'force_sigma_n', 1e-3),
        ('Standardabweichung der Kraft (mN)', 'force_sigma_n', 1e-3),
        ('std of mean force (mN)', 'force_sigma_n', 1e-3),
        ('F mean (mN)', 'force_n', 1e-3),
        ('Mittelwert der Kraft (mN)', 'force_n', 1e-3),
        ('f (kHz)', 'frequency_hz', 1e3),
        ('Frequenz [Hz]', 'frequency_hz', 1.0),
        ('step size (um)', 'step_length_m', 1e-6),
        ('Temp (degC)', None, 0.0),
    ],
)
def test_a_header_names_a_quantity_and_its_unit(header: str, column: str | None, factor: float):
    lines = ['Preload (N);Hub (nm);force_n' if column != 'force_n' else 'Preload (N);Hub (nm);x']
    text = f'{lines[0]};{header}\n0.5;60;2;3\n'
    [*_, last] = (experiment := parse_experiment(text.encode(), 'a.csv')).recognised
    assert experiment.columns['amplitude_m'].tolist() == [60e-9]
    if column is None:
        assert experiment.unread == (header,)
        assert f"column '{header}' was not read" in experiment.notes
    else:
        assert last.name == column
        assert last.factor == pytest.approx(factor, rel=ROUNDING)
        assert last.first == pytest.approx(3.0 * factor, rel=ROUNDING)


def test_units_beyond_those_of_the_stand_are_looked_up():
    assert factor_of('lbf', 'N') == pytest.approx(4.4482216152605, rel=ROUNDING)
    assert factor_of('2 min', 's') == 120.0
    assert factor_of('Volts', 'V') == 1.0
    assert factor_of('raw', 'V') is None
    assert factor_of('mN', 'm') is None
    for word in ('nan', 'NaN N', '½', 'inf', '1e400 N', 'lambda', 'delta_degC', 'ⁿ'):
        assert factor_of(word, 'N') is None


def test_what_the_user_says_counts_more_than_the_file():
    text = b'preload_n,amplitude_m,force_n,spare\n0.5,60,18,2\n'
    headers = {'amplitude_m': 'amplitude (nm)', 'force_n': 'SPARE (mN)'}
    columns = parse_experiment(text, 'a.csv', TableOptions(headers)).columns
    assert columns['amplitude_m'].tolist() == [60e-9]
    assert columns['force_n'].tolist() == [2e-3]
    with pytest.raises(
        StickSlipError, match=r"there is no column 'F'; columns of numbers: #1 'preload_n'"
    ):
        parse_experiment(text, 'a.csv', TableOptions({'force_n': 'F'}))
    with pytest.raises(StickSlipError, match="column of --map 'farce' is not known"):
        TableOptions({'farce': 'F'})
    with pytest.raises(StickSlipError, match='fill in how many N are 1 V, -'):
        parse_experiment(text, 'a.csv', TableOptions({'force_n': 'spare (V)'}))
    with pytest.raises(StickSlipError, match='--preload is without effect on an experiment over'):
        parse_experiment(b'time_s,force_n\n0,1\n', 'a.csv', TableOptions(preloads_n=(0.5,)))


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding='utf-8')
    return path


def test_one_file_per_preload_becomes_one_table(tmp_path: Path):
    paths = [
        written(tmp_path, 'a.csv', 'stroke_nm;f_mN\n60;1,5\n'),
        written(tmp_path, 'b.csv', 'Amplitude (um)\tForce (mN)\n0.06\t2.5\n0.08\t3\n'),
    ]
    points = read_joined(paths, TableOptions(preloads_n=(0.1, 0.5))).columns
    assert points['preload_n'].tolist() == [0.1, 0.5, 0.5]
    assert points['amplitude_m'].tolist() == [60e-9, 60e-9, 80e-9]
    assert points['force_n'].tolist() == [1.5e-3, 2.5e-3, 3e-3]
    clean = tmp_path / 'clean.csv'
    write_experiment(read_joined(paths, TableOptions(preloads_n=(0.1,))), clean)
    again = read_experiment(clean)
    assert again.columns['preload_n'].tolist() == [0.1] * 3
    assert again.columns['amplitude_m'].tolist() == points['amplitude_m'].tolist()
    with pytest.raises(StickSlipError, match=r'has a preload column and --preload 0\.1; leave'):
        read_experiment(clean, TableOptions(preloads_n=(0.1,)))
    other = written(tmp_path, 'c.csv', 'stroke_nm;step_nm\n60;1,5\n')
    with pytest.raises(StickSlipError, match=r'c\.csv: has no force_n, as another file has'):
        read_joined([paths[0], other], TableOptions(preloads_n=(0.1,)))


def test_a_fault_far_down_is_refused_by_its_line(tmp_path: Path):
    rows = [f'{row};{row % 7},5' for row in range(CHUNK_ROWS + 5)]
    rows[-2] = 'x;1'
    path = written(tmp_path, 'long.csv', 'Zeit (ms);Kraft (mN)\n' + '\n'.join(rows))
    with pytest.raises(StickSlipError, match=f"line {CHUNK_ROWS + 5}, column Zeit .ms.: 'x' is"):
        read_experiment(path)
    rows[-2] = f'{CHUNK_ROWS + 3};0,5'
    path = written(tmp_path, 'long.csv', 'Zeit (ms);Kraft (mN)\n' + '\n'.join(rows))
    columns = read_experiment(path).columns
    assert len(columns['time_s']) == CHUNK_ROWS + 5
    assert columns['force_n'][-1] == pytest.approx(((CHUNK_ROWS + 4) % 7 + 0.5) / 1e3)


def test_columns_that_are_missing_are_told_by_the_header_alone(tmp_path: Path):
    path = written(tmp_path, 'long.csv', 'time_s,position_m\n' + '0,0\n' * 30_000 + '1,2,3\n')
    with pytest.raises(StickSlipError, match='line 1: there is no voltage_v or foot_m'):
        read_experiment(path, kind=OVER_TIME, measured=('voltage_v', 'foot_m'))


def test_the_page_names_every_word_and_quotes_what_is_asked(tmp_path: Path, monkeypatch):
    page = (Path(__file__).parents[3] / 'docs/howto/bring_your_data.md').read_text('utf-8')
    plain = page.lower().replace('-', ' ').replace('_', ' ')
    optional = {each.quantity for each in SENSORS if each.switch}
    for column, names in USUAL.items():
        if column in optional:
            continue
        assert f'`{column}`' in page
        assert [name for name in names if name not in plain and name not in ALIKE] == []
    monkeypatch.chdir(tmp_path)
    written(tmp_path, 'force.csv', 'preload_n,amplitude,force\n1,60,2\n')
    with pytest.raises(StickSlipError) as refusal:
        read_experiment(Path('force.csv'))
    assert f'\n{refusal.value}\n' in page


@pytest.mark.parametrize(
    'head',
    ['time (s),"force (mN)\n', '"rig 3\ntime (s),force (mN)\n', '# 3", 4"\ntime (s),force (mN)\n'],
)
def test_a_quotation_above_the_rows_takes_none_of_them_away(head: str):
    columns = parse_experiment(f'{head}0,1\n1,2\n'.encode(), 'a.csv').columns
    assert columns['force_n'].tolist() == [1e-3, 2e-3]


POINTS = 'preload_n,amplitude_m,force_n\n'
TIMES = 'time_s,position_m\n'


def test_a_table_by_amplitude_is_read_with_its_notes():
    text = (
        b'# ruby on steel\n#  run 7\npreload_n, amplitude_m ,force_n,force_sigma_n\n'
        b'0.1,60e-9,0.03,0.001\n\n0.5,8e-8,0.05,0.002\n'
    )
    experiment = parse_experiment(text, 'a.csv')
    assert experiment.kind == BY_AMPLITUDE
    assert experiment.notes == ('ruby on steel', 'run 7')
    assert experiment.columns['amplitude_m'].tolist() == [60e-9, 80e-9]
    assert experiment.columns['force_sigma_n'].tolist() == [0.001, 0.002]


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
            "has 'step_length_sigma_m' without 'step_length_m'; add a column",
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
        parse_experiment(text.encode(), 'exp.csv')
    assert message in str(caught.value)
    assert str(caught.value).startswith('exp.csv: ')


def test_what_is_no_text_is_refused():
    with pytest.raises(StickSlipError, match=r'exp\.csv: is no text; save it as text: CSV'):
        parse_experiment(b'PK\x03\x04\x14\0\0\0\x08\0ab', 'exp.csv')


@pytest.mark.parametrize('above', ['# noise of 2 mN', "# column 'Nr.' was not read", 'a,b,c'])
def test_a_line_above_the_header_is_no_row_of_units_that_needs_pint(monkeypatch, above: str):
    monkeypatch.setitem(sys.modules, 'pint', None)
    factor_of.cache_clear()
    text = f'{above}\npreload_n,amplitude_m,force_n\n0.1,3e-8,0.0083\n'
    assert parse_experiment(text.encode(), 'a.csv').columns['amplitude_m'].tolist() == [3e-8]
    with pytest.raises(MissingExtra, match="unit gf needs the package 'pint'"):
        parse_experiment(b'preload_n,amplitude_m,force (gf)\n0.1,3e-8,2\n', 'a.csv')
