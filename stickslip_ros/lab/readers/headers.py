# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Headers of instruments: a table of formats with names, units and times."""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from stickslip_ros.errors import RecordingError
from stickslip_ros.units import parse_quantity

Cells = list[str]
COMMENT = re.compile(r'\s*[#%]+\s*')
_SAME = 0.01  # largest relative difference of a time step from the header's


class HeaderFormat(NamedTuple):
    """Names of settings in an instrument's header: first cells of the rows above the table."""

    instrument: str
    settings: str  # required settings, name or name=value
    names: str  # setting with column names; # is the number of a column, from 0
    units: str
    clock: str  # name of columns of times, or of row numbers
    unit: str  # unit of times, or the setting with the unit (several words)
    start: str
    step: str  # time between rows
    absent: str  # column that may have a name but no cells
    common: str  # settings that must be equal for all columns


_TABLE = """
PI          |sample_time, dim, name0         |name#       |            |      |s|    |sample_time||
LabVIEW     |x_columns=no, x_dimension=time  |            |y_unit_label|x_value|s|x0 |delta_x|x_value|date, time
LabVIEW     |y_unit_label, x_dimension=time  |            |y_unit_label|x_value|s|   |  ||date, time
LabVIEW     |y_unit_label                    |            |y_unit_label|      | |    |  ||
Rigol MSO   |t0, tinc                        |            |            |      |s|t0  |tinc||
Rigol DS    |sequence, increment             |            |sequence    |x     |s|start|increment||
Graphtec    |sampling interval, number       |            |            |number|s|    |sampling interval||
data logger |channel name, unit, interval    |channel name|unit        |channel name|s||interval||timestamp
Yokogawa    |tracename, hresolution, hunit=s |tracename   |vunit       |tracename|s|hoffset|hresolution||
Siglent     |source, second                  |source      |second      |source|s|    |  ||
Tektronix   |horizontal units, vertical units|            |vertical units|time|horizontal units||||
LeCroy      |segments, time                  |            |            |time  |s|    |  ||
PlotJuggler |__time                          |            |            |__time|s|    |  ||
rostopic    |%time                           |            |            |time  |ns|   |  ||
"""  # noqa: E501 - one row a format
FORMATS = [HeaderFormat(*map(str.strip, row.split('|'))) for row in _TABLE.strip().split('\n')]


def settings_in(lines: Sequence[str], rows: Sequence[Cells]) -> dict[str, Cells]:
    """Return settings by name, from rows, ``name = value`` and names above numbers."""
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


class _Settings(NamedTuple):
    """Settings of a header, as texts with a decimal point."""

    cells: Mapping[str, Cells]
    decimal: str

    def values(self, key: str) -> list[str]:
        """Return the distinct values of a setting."""
        cells = (cell.strip().replace(self.decimal, '.') for cell in self.cells.get(key, [])[1:])
        return [each for each in dict.fromkeys(cells) if each.lower() not in {'', key}]

    def first(self, key: str, default: str = '') -> str:
        return next(iter(self.values(key)), default)

    def seconds(self, key: str) -> float:
        """Return a setting in s; 0 without it."""
        return parse_quantity(self.first(key, '0'), 's') or 0.0

    def fit(self, form: HeaderFormat) -> bool:
        """Return whether all settings of a format are present."""
        pairs = (each.partition('=') for each in form.settings.split(', '))
        return all(
            key in self.cells and (not value or value in map(str.lower, self.values(key)))
            for key, _, value in pairs
        )


def read_header(
    cells: Mapping[str, Cells],
    header: tuple[Cells, Cells],
    rows: Sequence[Cells],
    decimal: str,
    where: str,
) -> tuple[Cells, Cells, float | None, float]:
    """
    Return names, units, first time and time step, s, by the format of the settings.

    The first time is None if the header has none; the step is 0 if there is a column of times.
    ``rows`` are the first two rows.

    """
    names, units = map(list, header)
    settings = _Settings(cells, decimal)
    form = next(filter(settings.fit, FORMATS), None)
    if form is None:
        return names, units, None, 0.0
    for key in (*form.common.split(', '), form.start, form.step):
        if len(several := settings.values(key)) > 1:
            problem = f'has columns of different {key}: {", ".join(several)}'
            raise RecordingError(where, problem, 'save each in its own file')
    if form.names.endswith('#'):
        names = [settings.first(f'{form.names[:-1]}{at}') for at in range(len(rows[0]))]
    names = list(cells.get(form.names, names))
    indent = next((at for at, name in enumerate(names) if name.strip()), 0)
    units = [''] * indent + cells[form.units] if form.units else units
    units += [''] * (len(names) - len(units))
    step_s = settings.seconds(form.step)
    clocks = [at for at, name in enumerate(names) if form.clock == name.strip().lower() != '']
    if not step_s or any(_have_step(rows, at, decimal, step_s) for at in clocks):
        for at in clocks:
            names[at] = 'Time' if form.names else names[at]
            units[at] = settings.first(form.unit, form.unit) if ' ' in form.unit else form.unit
        return names, units, None, 0.0
    for at in reversed(clocks):
        names[at] = ''
        if form.absent and rows[0][at].strip():
            del names[at], units[at]
    return names, units, settings.seconds(form.start), step_s


def _have_step(rows: Sequence[Cells], at: int, decimal: str, step_s: float) -> bool:
    """Return whether the times in the first two rows differ by a step."""
    one, two = (parse_quantity(row[at].replace(decimal, '.'), '') for row in rows)
    return one is not None and two is not None and abs(two - one - step_s) <= _SAME * step_s
