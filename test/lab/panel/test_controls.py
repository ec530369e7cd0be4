# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A file of the page is read as the tables of a laboratory are: with its units, or not at all."""

import io
import time

import pandas as pd
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.interface.requests import typed_numbers
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.lab.panel.controls import read_number, read_numbers, read_waveform
from stickslip_ros.lab.panel.settings import in_shown_units, read_setting

ROWS = [[0.0, 0.0], [0.01, 100.0], [0.02, 70.0]]
LONG, QUICK_S = 60_000, 5.0
"""Characters of a header, and processor time for it: 0.1 s; what is quadratic takes a minute."""


@pytest.mark.parametrize(
    'text',
    [
        'time (s),voltage (V)\n0,0\n0.01,100\n0.02,70\n',
        '# made by hand\ntime_us\tvoltage_kv\n0\t0\n10000\t0.1\n20000\t0.07\n',
        'Zeit (ms);Spannung (V)\n-5,0;0\n5,0;100\n15,0;70\n',
        'voltage (mV),time (ms)\n0,0\n100000,10\n70000,20\n',
    ],
)
def test_a_waveform_is_read_in_its_units_from_its_first_row_on(text: str):
    rows = read_waveform(text.encode(), 'wave.csv')
    assert rows == [pytest.approx(row, rel=1e-12) for row in ROWS]


def test_a_waveform_comes_from_a_spreadsheet_too():
    file = io.BytesIO()
    pd.DataFrame(ROWS, columns=['time (s)', 'voltage (V)']).to_excel(file, index=False)
    assert read_waveform(file.getvalue(), 'Wave.XLSX') == ROWS


@pytest.mark.parametrize('filling', [' ', '/', 'a/', '1', '()', 'a '])
def test_a_header_of_any_length_is_judged_at_once(filling: str):
    name = f'a{filling * (LONG // len(filling))}b'
    begun_s = time.thread_time()
    for text in (f'{name},voltage (V)\n0,0\n1,1\n', f'time (s) {name}\n0 0\n1 1\n'):
        with pytest.raises(StickSlipError):
            read_waveform(text.encode(), 'wave.csv')
    assert time.thread_time() - begun_s < QUICK_S


@pytest.mark.parametrize(
    ('text', 'problem'),
    [
        ('0,0\n10,100\n', "there is no time_s, and no voltage_v; columns of numbers: #1 '1'"),
        ('time,voltage\n0,0\n10,100\n', "has no unit for 'time', 'voltage'"),
        ('time (ms),voltage (V)\n0,0\n1,lots\n2,3\n3,4\n', "line 3, column voltage (V): 'lots'"),
        ('\0\1\2', 'is no text; save it'),
    ],
)
def test_what_leaves_something_to_guess_is_refused_without_options_that_a_page_has_not(
    text: str, problem: str
):
    with pytest.raises(StickSlipError) as refusal:
        read_waveform(text.encode(), '../../wave\0.csv')
    words = str(refusal.value)
    assert problem in words
    assert '--map' not in words
    assert '/tmp' not in words
    assert '; ' in words


@pytest.mark.parametrize(
    ('name', 'values', 'problem'),
    [
        ('voltage', ['abc'], "'abc' is not a number; give a number in V, such as 120.5"),
        ('position', ['1V'], "'1V' is not a number; give a number in nm, such as 120.5"),
        ('steps', [''], "'' is not a number; give a whole number, such as 10"),
        ('sawtooth', [300, 'x', 0], "frequency 'x' is not a number; give a number in Hz, "),
    ],
)
def test_text_in_the_place_of_a_number_is_refused_in_the_unit_of_its_field(
    name: str, values: list[object], problem: str
):
    [topic] = [each for each in COMMAND_TOPICS if each.request == name]
    with pytest.raises(StickSlipError, match=f'^{problem}'):
        read_numbers(topic, values)


@pytest.mark.parametrize(
    ('told', 'shown'),
    [
        (
            'x 0.009 m is outside -0.005 to 0.005 m;',
            'x 9000000 nm is outside -5000000 to 5000000 nm;',
        ),
        ('closed loop: point.x, m; coarse', 'closed loop: point.x, nm; coarse'),
        ('2e-3 N, 0.02 m/s, 25 N s/m, 300 V, 3 um', '2 mN, 20000 um/s, 25 N s/m, 300 V, 3 um'),
        ('mass m; in mN, N or kN', 'mass m; in mN, N or kN'),
    ],
)
def test_texts_of_the_drive_are_told_in_the_units_of_the_fields(told: str, shown: str):
    assert in_shown_units(told) == shown


@pytest.mark.parametrize(
    ('text', 'voltage_v'),
    [
        (',5', 0.5),
        ('0,3 kV', 300.0),
        ('+1,5e2', 150.0),
        ('0,300', 0.3),
        ('1234,567V', 1234.567),
        ('1,000', "'1,000' is not clear: .* write 1000 or 1.000"),
        ('12,500 V', "'12,500 V' is not clear: .* write 12500 V or 12.500 V"),
        ('1.000,5', r"'1\.000,5' is not a number"),
        ('1,000.5', r"'1,000\.5' is not a number"),
        ('1,2,3', "'1,2,3' is not a number"),
    ],
)
def test_a_decimal_comma_means_the_same_on_every_door(text: str, voltage_v: float | str):
    [voltage] = [each for each in COMMAND_TOPICS if each.request == 'voltage']
    doors = [
        lambda: typed_numbers(COMMANDS['voltage'], [text]),
        lambda: typed_numbers(COMMANDS['sawtooth'], [f'amplitude={text}', '1', '1'])[:1],
        lambda: read_numbers(voltage, [text]),
        lambda: [read_number(text.encode(), 'waveform amplitude V')],
        lambda: [read_setting('step.amplitude', text)],
    ]
    for read in doors:
        if isinstance(voltage_v, str):
            with pytest.raises(StickSlipError, match=voltage_v):
                read()
        else:
            assert read() == [pytest.approx(voltage_v, rel=1e-12)]
