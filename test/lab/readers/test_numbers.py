# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Step curves and data sheets as owners keep them, in the columns of the package."""

import re
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.measurements.numbers import NUMBERS
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.tables import read_experiment, read_joined
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable

READING = TableOptions(preloads_n=(0.5,))
CURVE = 'voltage (V),step size up (nm),step size down (nm)\n20,21,18\n60,196,179\n'
SHEET = (
    'Quantity;Value;Unit;Tolerance (%);Voltage (V)\n'
    'step length;98,5;nm;10;300\n'
    'step length;30;nm;;150\n'
    'holding force;0,42;N;;\n'
    'moving mass;3;g;5;\n'
    'slew rate;150;V/us;;\n'
)


def read(folder: Path, text: str, reading: TableOptions = READING) -> MeasuredTable:
    path = folder / 'owner.csv'
    path.write_text(text, encoding='utf-8')
    return read_experiment(path, reading)


def close(values: np.ndarray, wanted: float | list[float]) -> None:
    np.testing.assert_allclose(values, wanted, rtol=1e-12)


def test_a_step_curve_over_voltage_keeps_up_and_down(tmp_path: Path):
    columns = read(tmp_path, CURVE).columns
    assert [*columns] == ['preload_n', 'voltage_v', 'step_length_m', 'step_back_m']
    close(columns['voltage_v'], [20.0, 60.0])
    close(columns['step_length_m'], [21e-9, 196e-9])
    close(columns['step_back_m'], [18e-9, 179e-9])


@pytest.mark.parametrize(
    ('header', 'row', 'wanted'),
    [
        ('voltage (V),up (nm),down (nm)', '60,196,179', {'step_back_m': 179e-9}),
        ('voltage (V),direction,step (nm)', '60,down,179', {'step_back_m': 179e-9}),
        ('voltage (V),direction,step (nm)', '60,-1,179', {'step_back_m': 179e-9}),
        ('voltage (V),direction,step (nm)', '60,forward,196', {'step_length_m': 196e-9}),
        ('voltage (V),frequency (Hz),step (nm)', '60,-500,179', {'step_length_m': -179e-9}),
        ('voltage (V),frequency (Hz),step (nm)', '60,-500,-179', {'step_length_m': -179e-9}),
        ('voltage_v,load_n,step_length_m', '60,0.1,9e-9', {'load_n': 0.1, 'step_length_m': 9e-9}),
        ('voltage (V),load (mN),step (nm)', '60,100,9', {'load_n': 0.1, 'step_length_m': 9e-9}),
        ('stroke (nm),speed (um/s),frequency (Hz)', '60,50,1000', {'speed_m_per_s': 50e-6}),
        ('stroke (nm),speed down (mm/s)', '60,0.05', {'speed_back_m_per_s': 50e-6}),
        ('stroke (nm),speed_m_per_s', '60,5e-5', {'speed_m_per_s': 50e-6}),
        ('capacitance (uF),moving_mass_kg', '1.5,0.1', {'capacitance_f': 1.5e-6}),
    ],
)  # fmt: skip
def test_a_row_of_an_owner_is_read(tmp_path: Path, header: str, row: str, wanted: dict):
    columns = read(tmp_path, f'{header}\n{row}\n').columns
    for name, value in wanted.items():
        close(columns[name], [value])
    assert 'direction' not in columns


@pytest.mark.parametrize('other', ['displacement (um)', 'steps'])
def test_a_column_that_says_nothing_alone_is_left_out(tmp_path: Path, other: str):
    table = read(tmp_path, f'voltage (V),{other},step (nm)\n60,7,196\n70,7,197\n')
    assert [*table.columns] == ['preload_n', 'voltage_v', 'step_length_m']
    assert table.unread == (other,)


def test_a_sheet_with_a_row_for_each_number_has_its_tolerances_or_20_percent(tmp_path: Path):
    table = read(tmp_path, SHEET)
    columns, nan = table.columns, np.nan
    close(columns['step_length_m'], [98.5e-9, 30e-9, nan, nan, nan])
    close(columns['step_length_sigma_m'], [9.85e-9, 6e-9, nan, nan, nan])
    close(columns['voltage_v'], [300.0, 150.0, 0.0, 0.0, 0.0])
    close(columns['holding_force_n'], [nan, nan, 0.42, nan, nan])
    close(columns['holding_force_sigma_n'][2], 0.084)
    close(columns['moving_mass_sigma_kg'][3], 0.15e-3)
    close(columns['slew_v_per_s'][4], 150e6)
    [gap] = table.gaps
    assert 'step_length_m, holding_force_n, slew_v_per_s: 20 % is taken; state others' in gap


def test_a_curve_that_was_reported_stays_as_it_was_when_it_is_joined_to_a_sheet(tmp_path: Path):
    for name, text in (('curve', CURVE), ('sheet', SHEET)):
        (tmp_path / f'{name}.csv').write_text(text, encoding='utf-8')
    reported = list[tuple[MeasuredTable, set[str]]]()
    reading = TableOptions(
        preloads_n=(0.5,), report=lambda each: reported.append((each, {*each.columns}))
    )
    joined = read_joined([tmp_path / 'curve.csv', tmp_path / 'sheet.csv'], reading)
    assert len(joined.columns['holding_force_n']) == 7
    assert all(names == {*table.columns} for table, names in reported)


def test_tolerances_with_a_sign_of_percent_are_read(tmp_path: Path):
    table = read(tmp_path, SHEET.replace(';10;', ';10 %;'))
    close(table.columns['step_length_sigma_m'][0], 9.85e-9)


def test_a_sheet_beyond_the_first_bytes_is_refused(tmp_path: Path):
    with pytest.raises(StickSlipError, match='longer than 65536 bytes; leave out rows'):
        read(tmp_path, SHEET + 'moving mass;3;g;5;\n' * 5000)


@pytest.mark.parametrize(
    ('row', 'told'),
    [
        ('holding force,0,42,N,5', 'line 4: has 5 values, the header 4 names; with decimal'),
        ('holding force,x,N,5', "line 4, column holding force (N): 'x' is not a finite number"),
    ],
)
def test_a_wrong_row_of_a_sheet_is_refused_by_its_line(tmp_path: Path, row: str, told: str):
    rows = f'moving mass,3,g,5\n\n{row}\nslew rate,1,V/us,5\nonset voltage,9,V,5\n'
    with pytest.raises(StickSlipError, match=re.escape(told)):
        read(tmp_path, f'quantity,value,unit,tolerance (%)\n{rows}')


def test_a_signal_named_value_is_no_sheet(tmp_path: Path):
    reading = TableOptions({'position_m': 'value (um)', 'time_s': 'time (s)'})
    table = read(tmp_path, 'time,value\n0,1\n0.1,2\n', reading)
    close(table.columns['position_m'], [1e-6, 2e-6])


def test_a_row_without_its_voltage_is_left_out_and_counted(tmp_path: Path):
    table = read(tmp_path, 'voltage (V),step (nm),mass (g)\n60,196,\n,150,\n,,3\n')
    close(table.columns['moving_mass_kg'], [np.nan, 3e-3])
    assert "1 of 3 rows without 'voltage (V)' were left out, the first is line 3" in table.gaps


def test_the_preload_of_a_stand_holds_for_a_table_without_one(tmp_path: Path):
    columns = read(tmp_path, CURVE, TableOptions(stand_n=0.7)).columns
    close(columns['preload_n'], [0.7, 0.7])


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            'voltage (V),direction,step (nm)\n60,sideways,179\n',
            "line 2, column direction: 'sideways' is not up or down; correct the row",
        ),
        ('voltage (V),direction,step (nm)\n60,0,9\n', "column direction: '0' is not up or down"),
        (
            'voltage (V),direction,frequency (Hz),step (nm)\n60,up,-500,179\n',
            'or two columns with a direction; state the direction of steps or speeds once',
        ),
        ('stroke (nm),direction,force (mN)\n6,up,1\n', 'has a direction, but no step or speed'),
        ('voltage (V),stroke (nm),step (nm)\n60,9,9\n', 'has both amplitude_m and voltage_v;'),
        ('preload (N),step (nm)\n1,9\n', 'there is no amplitude_m or voltage_v'),
        ('mass (g),holding force (N)\n0,1\n', 'moving_mass_kg 0 kg is without a tolerance; add a'),
        ('mass (g),holding force (N)\n-3,1\n', 'mass (g): -0.003 kg is below the minimum 0 kg'),
        ('voltage (V),step (nm),tolerance\n60,9,5\n', '--map tolerance="tolerance (...%)"'),
        ('voltage (V),step (nm),tolerance (%)\n60,9,0\n', '0 % is below the minimum 0.001 %'),
    ],
)  # fmt: skip
def test_a_row_that_means_nothing_is_refused(tmp_path: Path, text: str, message: str):
    with pytest.raises(StickSlipError) as refusal:
        read(tmp_path, text, TableOptions() if 'preload' in text else READING)
    assert message in str(refusal.value)


def test_the_sheet_and_the_curve_of_the_page_are_read(tmp_path: Path):
    page = (Path(__file__).parents[3] / 'docs/howto/data_sheet.md').read_text('utf-8')
    table = read(tmp_path, page.partition('```csv\n')[2].partition('```')[0])
    numbers = [table.columns[name] for name in NUMBERS if name in table.columns]
    assert np.count_nonzero(np.isfinite(numbers)) == len(numbers) == 6
    assert '20 % is taken' in table.gaps[0]
    assert '`voltage (V),step up (nm),step down (nm)`' in page
