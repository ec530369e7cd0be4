# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One measurement in ten layouts that instruments and spreadsheets write."""

from collections.abc import Sequence

import numpy as np

TIME_S = np.linspace(-1e-3, 3e-3, 41)
VOLTAGE_V = 150.0 + 149.0 * np.sin(2e3 * TIME_S)
FORCE_N = 0.05 + 0.02 * np.cos(3e3 * TIME_S)
N_PER_V = 0.05
"""Of a force that a scope has measured."""
SCOPE = {'voltage_v': 'CH1 (100 V)', 'force_n': 'CH2 (50 mN)'}


def rows(*columns: np.ndarray, delimiter: str, decimal: str = '.', digits: int = 13) -> list[str]:
    return [
        delimiter.join(f'{value:.{digits}e}' for value in row).replace('.', decimal)
        for row in zip(*columns, strict=True)
    ]


def of_lines(lines: Sequence[str], encoding: str = 'ascii', end: str = '\r\n') -> bytes:
    return (end.join(lines) + end).encode(encoding)


def own() -> bytes:
    lines = rows(TIME_S, VOLTAGE_V, FORCE_N, delimiter=',', digits=16)
    return of_lines(['# stand 7', 'time_s,voltage_v,force_n', *lines], end='\n')


def german_spreadsheet() -> bytes:
    head = [
        'Messung 7;;;',
        'Prüfer: Müller;;;',
        '',
        'Zeit (ms);Spannung [V];Kraft (mN);Temperatur (°C)',
    ]
    lines = rows(1e3 * TIME_S, VOLTAGE_V, 1e3 * FORCE_N, 21 + TIME_S, delimiter=';', decimal=',')
    return of_lines([*head, *lines], 'utf-8-sig')


def unicode_text() -> bytes:
    lines = rows(1e6 * TIME_S, VOLTAGE_V / 1e3, 1e3 * FORCE_N, delimiter='\t')
    return of_lines(['Time [µs]\tPiezo voltage [kV]\tLoad [mN]', *lines], 'utf-16')


def blanks() -> bytes:
    lines = rows(1e3 * TIME_S, VOLTAGE_V, 1e3 * FORCE_N, delimiter='   ')
    return of_lines(
        ['# ruby on steel', '# t_ms voltage_v force_mN', *(f'  {line}' for line in lines)]
    )


def row_of_units() -> bytes:
    lines = rows(1e6 * FORCE_N, 1e6 * TIME_S, VOLTAGE_V, delimiter=';', decimal=',')
    return of_lines(['Kraft;Zeit;Spannung', 'µN;µs;V', *lines], 'cp1252')


def labview() -> bytes:
    head = [
        'LabVIEW Measurement\t',
        'Writer_Version\t2',
        'Separator\tTab',
        'Decimal_Separator\t,',
        'X_Columns\tOne',
        'Time_Pref\tAbsolute',
        'Date\t2024/05/17',
        'Time\t11:42:07,1234567',
        '***End_of_Header***\t',
        '\t',
        'Channels\t2\t\t',
        f'Samples\t{len(TIME_S)}\t{len(TIME_S)}\t',
        'Date\t2024/05/17\t2024/05/17\t',
        'Y_Unit_Label\tVolts\tNewton\t',
        'X_Dimension\tTime\tTime\t',
        'X0\t0,0000000000000000E+0\t0,0000000000000000E+0\t',
        'Delta_X\t1,000000E-4\t1,000000E-4\t',
        '***End_of_Header***\t\t\t',
        'X_Value\tVoltage\tForce\tComment',
    ]
    lines = rows(TIME_S, VOLTAGE_V, FORCE_N, delimiter='\t', decimal=',')
    return of_lines([*head, *(f'{line}\t' for line in lines)])


def tektronix_old() -> bytes:
    settings = [
        'Record Length,2.500000e+03,',
        'Sample Interval,1.000000e-04,',
        'Trigger Point,1.000000000000e+01,',
        *[',,'] * 3,
        'Source,CH1,',
        'Vertical Units,V,',
        'Vertical Scale,1.000000e+00,',
        'Vertical Offset,0.000000e+00,',
        'Horizontal Units,s,',
        'Horizontal Scale,4.000000e-04,',
        'Pt Fmt,Y,',
        'Yzero,0.000000e+00,',
        'Probe Atten,1.000000e+00,',
        'Model Number,TDS2014B,',
        'Serial Number,C051234,',
        'Firmware Version,FV:v22.01,',
    ]
    settings += [',,'] * (len(TIME_S) - len(settings))
    lines = rows(TIME_S, VOLTAGE_V / 100.0, delimiter=',')
    return of_lines([f'{left},{right},' for left, right in zip(settings, lines, strict=True)])


def tektronix() -> bytes:
    head = [
        'Model,DPO3014',
        'Firmware Version,2.31',
        ',',
        'Waveform Type,ANALOG',
        'Point Format,Y',
        'Horizontal Units,s',
        'Horizontal Scale,0.0004',
        'Sample Interval,1e-04',
        'Record Length,41',
        'Probe Attenuation,1,1',
        'Vertical Units,V,V',
        'Vertical Offset,0,0',
        'Vertical Scale,1,0.5',
        ',',
        'Label,piezo,cell',
        'TIME,CH1,CH2',
    ]
    return of_lines([*head, *rows(TIME_S, VOLTAGE_V / 100.0, FORCE_N / N_PER_V, delimiter=',')])


def keysight() -> bytes:
    lines = rows(TIME_S, VOLTAGE_V / 100.0, FORCE_N / N_PER_V, delimiter=',')
    return of_lines(['x-axis,1,2', 'second,Volt,Volt', *lines])


def rigol() -> bytes:
    lines = rows(VOLTAGE_V / 100.0, FORCE_N / N_PER_V, delimiter=',')
    head = ['X,CH1,CH2,Start,Increment,', 'Sequence,Volt,Volt,-1.000000e-03,1.000000e-04']
    return of_lines([*head, *(f'{number},{line},,' for number, line in enumerate(lines))])


LAYOUTS = {
    'own.csv': (own, {}),
    'spreadsheet.csv': (german_spreadsheet, {}),
    'unicode.txt': (unicode_text, {}),
    'blanks.dat': (blanks, {}),
    'units.csv': (row_of_units, {}),
    'labview.lvm': (labview, {}),
    'F0000CH1.CSV': (tektronix_old, {'voltage_v': 'CH1 (100 V)'}),
    'tek0001.csv': (tektronix, SCOPE),
    'rigol.csv': (rigol, SCOPE),
    'keysight.csv': (keysight, {'voltage_v': '1 (100 V)', 'force_n': '2 (50 mN)'}),
}
"""Files, how each is made, and what the user must say of it."""
