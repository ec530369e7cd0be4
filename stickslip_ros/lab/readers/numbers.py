# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Numbers of a drive that owners have: one row each, with its column and its prediction."""

import csv
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n, slew_of
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.readers.layout import BLANKS, HEAD_BYTES, TextForm, header_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import unit_of

if TYPE_CHECKING:
    from pandas import DataFrame

SHEET_SHARE = 0.2
"""Standard error of a number of a data sheet without a tolerance, as a share of it."""
SIGMA = '_sigma_'
BACK = {'step_length_m': 'step_back_m', 'speed_m_per_s': 'speed_back_m_per_s'}
"""Numbers with a way, and the same backwards."""
_SETTINGS = ('amplitude_m', 'amplitude_sigma_m', 'voltage_v', 'frequency_hz', 'load_n')
_NAMED = {'quantity', 'parameter', 'property', 'specification', 'größe'}
_VALUE = {'value', 'typical', 'typ', 'wert'}
_UNIT = {'unit', 'units', 'einheit'}
"""Headers of a sheet with a number in each row."""


def sigma_name(name: str) -> str:
    """Return the column of the uncertainty: ``force_sigma_n`` for ``force_n``."""
    return re.sub('_((?:[mv]_per_)?[^_]+)$', rf'{SIGMA}\1', name)


class MeasuredNumber(NamedTuple):
    """A measured number: its usual headers, and the prediction of a stand."""

    words: str  # in lower case, with commas; empty: not in tables of laboratories
    drive: str  # steps, zero, ring, or rest
    # of the result of the drive and its stand; None: the field of its name
    shown: Callable[[Any, Parameters], float] | None = None
    runner: str = 'free'  # free, held by a load cell; empty: held if forces were measured
    is_of_sheet: bool = False  # above 0, with an error of SHEET_SHARE unless one is stated

    @property
    def settings(self) -> tuple[str, ...]:
        """Columns that it needs; a blocking force without a stroke has that of the full range."""
        is_full = self.drive in {'zero', 'rest'} or self.runner == 'held'
        strokes = () if is_full else ('amplitude_m', 'amplitude_sigma_m', 'voltage_v', 'direction')
        return ('preload_n', *strokes, *([] if self.drive == 'rest' else ['frequency_hz']))


def _speed_m_per_s(run: Any, _: Parameters) -> float:
    return float(run.step_length_m * abs(run.frequency_hz))


def stage_hz(stand: Parameters) -> float:
    """Return the frequency of a free runner on its sticking contacts, Hz."""
    if stand.contact.law != 'mdr':
        limit, hint = 'a law without one stiffness for all small motions', "set it to 'mdr'"
        raise OutOfRange('contact.law', stand.contact.law, '', limit, hint)
    stiffness = sum(each.stick_stiffness_n_per_m for each in contacts_of(stand))
    return math.sqrt(stiffness / stand.runner.mass) / (2.0 * math.pi)


# fmt: off
_ROWS: Mapping[str, tuple[Any, ...]] = {
    'force_n': ('force, f, load, load cell, generated force, kraft', 'steps',
                lambda run, _: run.force_mean_n, ''),
    'step_length_m': ('step length, step size, step, schrittlänge, schrittweite', 'steps'),
    'zero_amplitude_m': ('zero amplitude, 0 amplitude, nullamplitude', 'zero'),
    'ringing_hz': ('ringing, ringing frequency, ring down frequency, ausschwingfrequenz', 'ring',
                   None, ''),
    'decay_s': ('decay, decay time, ring down time, abklingzeit', 'ring', None, ''),
    'step_back_m': ('step length back', 'steps', lambda run, _: -run.step_length_m),
    'speed_m_per_s': ('speed, velocity, geschwindigkeit', 'steps', _speed_m_per_s),
    'speed_back_m_per_s': ('speed back', 'steps', lambda *run: -_speed_m_per_s(*run)),
    'onset_v': ('onset, onset voltage, threshold voltage', 'zero',
                lambda found, on: found.zero_amplitude_m / on.actuator.gain, 'free', True),
    'blocking_force_n': ('blocking force, blocked force, stall force, push force', 'steps',
                         lambda run, _: run.force_ramp_start_n, 'held', True),
    'holding_force_n': ('holding force, haltekraft', 'rest',
                        lambda _, on: friction_limit_n(on), 'free', True),
    'moving_mass_kg': ('moving mass, mass, runner mass', 'rest',
                       lambda _, on: on.runner.mass, 'free', True),
    'stage_frequency_hz': ('stage frequency, resonance frequency, resonant frequency', 'rest',
                           lambda _, on: stage_hz(on), 'free', True),
    'capacitance_f': ('capacitance, kapazität', 'rest',
                      lambda _, on: on.actuator.capacitance, 'free', True),
    'slew_v_per_s': ('slew, slew rate', 'rest', lambda _, on: slew_of(on), 'free', True),
    'energy_loss_per_step_j': ('', 'steps', None, ''),
}
# fmt: on
NUMBERS = {name: MeasuredNumber(*row) for name, row in _ROWS.items()}
"""Measured numbers, by column."""


def columns_of_sheet(
    source: Path | bytes, layout: TextForm, origin: str
) -> 'tuple[DataFrame, TextForm] | None':
    """Return a sheet of a number in each row as a table with columns; None if it is no sheet."""
    texts = [each.text for each in layout.columns]
    named, value, unit = (
        next((text for text in texts if text.lower() in known), '')
        for known in (_NAMED, _VALUE, _UNIT)
    )
    if not (named and value) or layout.delimiter == BLANKS:
        return None
    content = source if isinstance(source, bytes) else read_bytes(source, '', HEAD_BYTES + 1)
    if len(content) > HEAD_BYTES:
        problem = f'is a sheet with a number in each row, longer than {HEAD_BYTES} bytes'
        raise RecordingError(origin, problem, 'leave rows out, or give each quantity a column')
    lines, rows = content.decode(layout.encoding).splitlines()[layout.header :], []
    reader = csv.reader(lines, delimiter=layout.delimiter, skipinitialspace=True)
    for line, cells in enumerate(reader, layout.header + 1):
        row = dict(zip(texts, cells + [''] * len(texts), strict=False))
        if len(cells) > len(texts):
            problem = f'has {len(cells)} values, the header {len(texts)} names'
            hint = 'with decimal commas separate columns by semicolons'
            raise RecordingError(f'{origin}: line {line}', problem, hint)
        header = f'{row.pop(named)} ({row.pop(unit).strip()})' if unit else row.pop(named)
        rows.append({header: row.pop(value), **row} if any(cells) else {})
    import pandas as pd  # noqa: PLC0415 - slow import

    table = pd.DataFrame(rows).drop(columns='', errors='ignore')
    columns = tuple(header_of(at, str(text)) for at, text in enumerate(table))
    form = replace(layout, columns=columns, first=layout.header + 1)
    return table.set_axis(range(len(columns)), axis=1), form


def completed(given: Mapping[str, Array], origin: str) -> tuple[dict[str, Array], list[str]]:
    """
    Return columns by amplitude with a column for each way and standard errors, and notes.

    Empty cells of settings, which only numbers without a drive may have, become 0.

    """
    columns, notes, assumed = dict(given), list[str](), list[str]()
    way, hertz = columns.pop('direction', None), columns.get('frequency_hz', np.ones(1))
    both = {name: back for name, back in BACK.items() if name in columns}
    if way is not None:
        if not both or {*both.values()} & columns.keys() or np.any(hertz < 0.0):
            problem = 'has a direction, but no step or speed, or another column with its direction'
            raise RecordingError(origin, problem, 'state the direction of steps or speeds once')
        both |= {sigma_name(name): sigma_name(back) for name, back in both.items()}
        for each in both.keys() & columns.keys():
            columns[both[each]] = np.where(way < 0.0, columns[each], np.nan)
            columns[each] = np.where(way > 0.0, columns[each], np.nan)
    for each in both.keys() & columns.keys():
        is_size = (hertz < 0.0) & (columns[each] > 0.0) & (columns.get('load_n', 0.0) == 0.0)
        if np.any(is_size):
            columns[each] = np.where(is_size, -columns[each], columns[each])
            notes.append(f'{each} above 0 at a frequency below 0 is taken as a motion backwards')
    columns |= {name: np.nan_to_num(columns[name]) for name in _SETTINGS if name in columns}
    numbers = [name for name in NUMBERS if name in columns and sigma_name(name) not in columns]
    stated = columns.pop('tolerance', np.full(len(columns['preload_n']), np.nan))
    is_sheet = np.any(stated > 0.0) or any(NUMBERS[name].is_of_sheet for name in numbers)
    for name in numbers:
        value = columns[name]
        if not is_sheet and (len(value) > 1 or name not in {*BACK, *BACK.values()}):
            continue
        if np.any(value == 0.0):
            hint = f'add a column {sigma_name(name)}, or leave the cell empty'
            raise OutOfRange(f'{origin}: {name}', 0.0, unit_of(name), 'without a tolerance', hint)
        columns[sigma_name(name)] = np.where(stated > 0.0, 0.01 * stated, SHEET_SHARE) * abs(value)
        if np.any(np.isfinite(value) & ~(stated > 0.0)):
            assumed.append(name)
    if assumed:
        text = (
            f'no tolerance is given for {", ".join(assumed)}: {100.0 * SHEET_SHARE:g} % is taken'
        )
        notes.append(f'{text}; state others in a column tolerance (%)')
    return columns, notes
