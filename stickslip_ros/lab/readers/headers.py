# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Headers of instruments: a table of formats with their names, units and times."""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from stickslip_ros.errors import RecordingError
from stickslip_ros.units import parse_quantity

Cells = list[str]
COMMENT = re.compile(r'\s*[#%]+\s*')


class HeaderFormat(NamedTuple):
    """Names of settings in the header of an instrument: the first cells of rows above."""

    instrument: str
    told_by: str  # settings that are there, also with a value
    names: str  # of columns; its own name stands above times; # is the number of a column, from 0
    units: str
    clock: str  # name of columns of times; with a step they are empty
    unit: str  # of times, or the setting with it
    start: str
    step: str  # time between rows
    counter: str  # name of the column that numbers the rows
    alike: str  # settings that must be the same for all columns


_TABLE = """
PI          |sample_time, dim, name0         |name#       |            |      |s|    |sample_time||
LabVIEW     |x_columns=no, x_dimension=time  |            |y_unit_label|x_value|s|x0 |delta_x||date, time
LabVIEW     |y_unit_label, x_dimension=time  |            |y_unit_label|x_value|s|   |  ||date, time
LabVIEW     |y_unit_label                    |            |y_unit_label|      | |    |  ||
Rigol MSO   |t0, tinc                        |            |            |      |s|t0  |tinc||
Rigol DS    |sequence, increment             |            |sequence    |      |s|start|increment|x|
Graphtec    |sampling interval, number       |            |            |      |s|    |sampling interval|number|
data logger |channel name, unit, interval    |channel name|unit        |channel name|s||||timestamp, interval
Yokogawa    |tracename, hresolution, hunit=s |tracename   |vunit       |tracename|s|hoffset|hresolution||
Siglent     |source, second                  |source      |second      |source|s|    |  ||
Tektronix   |horizontal units, vertical units|            |vertical units|time|horizontal units||||
LeCroy      |segments, time                  |            |            |time  |s|    |  ||
PlotJuggler |__time                          |            |            |__time|s|    |  ||
rostopic    |%time                           |            |            |time  |ns|   |  ||
"""  # noqa: E501 - one row a format
FORMATS = [HeaderFormat(*map(str.strip, row.split('|'))) for row in _TABLE.strip().split('\n')]


def settings_in(lines: Sequence[str], rows: Sequence[Cells]) -> dict[str, Cells]:
    """Return the settings in lines, by name: rows, ``name = value``, names above numbers."""
    found: dict[str, Cells] = {}
    for line, row in zip(lines, rows, strict=True):
        for cell in [COMMENT.sub('', line, count=1)] if COMMENT.match(line) else row:
            name, _, value = map(str.strip, cell.partition('='))
            if name and value:
                found[name.lower()] = [name, value]
        found[row[0].strip(' :').lower()] = row
    for above, below in pairwise(rows):
        for name, cell in zip(above, below, strict=False):
            if parse_quantity(cell, '') is not None:
                found.setdefault(name.strip().lower(), [name, cell])
    found.pop('', None)
    return found


def read_header(
    settings: Mapping[str, Cells],
    header: tuple[Cells, Cells],
    rows: Sequence[Cells],
    decimal: str,
    where: str,
) -> tuple[Cells, Cells, float | None, float]:
    """
    Return names, units, first time and time between rows, s, by the format of the settings.

    The first time is None if the header has none, the other 0 if there is a column of times.
    ``rows`` are the first two.

    """
    names, units = map(list, header)
    form = next((each for each in FORMATS if _tells(settings, each.told_by)), None)
    if form is None:
        return names, units, None, 0.0

    def values(key: str) -> list[str]:
        cells = (cell.strip().replace(decimal, '.') for cell in settings.get(key, [])[1:])
        return [each for each in dict.fromkeys(cells) if each.lower() not in {'', key}]

    for key in filter(None, (*form.alike.split(', '), form.start, form.step)):
        if len(values(key)) > 1:
            problem = f'has columns of different {key}: {", ".join(values(key))}'
            raise RecordingError(where, problem, 'save them in a file each')
    [step_s, start_s, spacing_s] = (
        parse_quantity(next(iter(values(key)), '0'), 's') or 0.0
        for key in (form.step, form.start, 'interval')
    )
    if form.names.endswith('#'):
        keys = (f'{form.names[:-1]}{at}' for at in range(len(rows[0])))
        names = [next(iter(values(key)), '') for key in keys]
    elif form.start == 't0':  # settings and units stand in the row of names
        names = ['' if '=' in name else name for name in names]
        units = [name.strip()[-1:] if name.startswith('CH') else '' for name in names]
    names = list(settings.get(form.names, names))
    indent = next((at for at, name in enumerate(names) if name.strip()), 0)
    units = [''] * indent + settings[form.units] if form.units else units
    units += [''] * (len(names) - len(units))
    firsts = [parse_quantity(row[0].replace(decimal, '.'), '') or 0.0 for row in rows]
    unit = next(iter(values(form.unit)), form.unit)
    if form.names and spacing_s and abs(firsts[-1] - firsts[0] - spacing_s) > 0.01 * spacing_s:
        form, step_s = form._replace(counter=form.names, step='interval'), spacing_s
    if form.counter:
        unit, start_s = f'{step_s!r} s', start_s - step_s * (firsts[0] == 1.0)
    for at in reversed(range(len(names))):
        name, clock = names[at].strip().lower(), form.clock or form.counter
        if form.counter and parse_quantity(units[at], '') is not None:
            names[at] = ''  # a setting below its name
        elif clock and name == clock and form.step and not form.counter:
            names[at] = ''
            if rows[0][at].strip():
                del names[at], units[at]
        elif clock and name == clock:
            names[at], units[at] = 'Time' if form.names or form.counter else names[at], unit
    return names, units, start_s if form.step else None, 0.0 if form.counter else step_s


def _tells(settings: Mapping[str, Cells], told_by: str) -> bool:
    pairs = (each.partition('=') for each in told_by.split(', '))
    return all(
        key in settings and (not value or value in map(str.lower, map(str.strip, settings[key])))
        for key, _, value in pairs
    )
