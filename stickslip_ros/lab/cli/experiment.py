# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip import``: write tables in SI units; and the options of verbs that read them."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from stickslip_ros.errors import WrongKind, printable
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import chosen_for
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.measurements.measurement import as_table, measured
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.tables import write_experiment
from stickslip_ros.lab.measurements.vocabulary import EXPERIMENT_COLUMNS, MeasuredTable

_CSV = '.csv'


def import_verb(arguments: argparse.Namespace) -> Answer:
    """Read tables or a recording, and write them as CSV if asked."""
    output = arguments.output
    if output is not None:
        if output.suffix.lower() != _CSV:
            raise WrongKind('output', str(output), 'a .csv file', 'end its name so')
        prepare_output(output)
    read: list[MeasuredTable] = []
    reading = chosen_reading(arguments, arguments.files)
    run = measured(arguments.files, replace(reading, report=read.append))
    if output is not None:
        write_experiment(as_table(run), output)
    files = [
        {
            'file': each.origin,
            'kind': each.kind,
            'columns': each.recognised,
            'unused': each.unread,
            'notes': each.notes,
        }
        for each in read or [as_table(run)]
    ]
    lines = [line for each in read or [as_table(run)] for line in _lines(each)]
    content = {'files': files, 'output': str(output or '')}
    return Answer(content, [*lines, f'table   {output}'] if output else lines)


def chosen_reading(arguments: argparse.Namespace, sources: Sequence[Path]) -> TableOptions:
    """Return how sources are read by a command line, which shows how each table was read."""
    given = chosen_for(TableOptions, arguments)
    return TableOptions(**given, report=shown_tables(arguments)).for_sources(sources)


def shown_tables(arguments: argparse.Namespace) -> Callable[[MeasuredTable], None] | None:
    """Return a function that shows how a table was read; None for JSON."""

    def show(experiment: MeasuredTable) -> None:
        print(*map(printable, _lines(experiment)), sep='\n', file=sys.stderr)

    return None if arguments.json else show


def _lines(table: MeasuredTable) -> Iterator[str]:
    """Yield the columns of a table as read, with unit, factor and first row."""
    rows = len(next(iter(table.columns.values()), ()))
    yield f'read    {table.origin}: {table.kind}, {rows} rows'
    for each in table.recognised:
        first = f'{each.first:.6g} {EXPERIMENT_COLUMNS[table.kind][each.name].unit}'
        unit = f'in {each.unit}, times {each.factor:g}; first row {first}'
        yield f'        {each.name} is {each.header!r} {unit}'
    yield from (f'unused  {header!r}' for header in table.unread)
    yield from (f'note    {text}' for text in table.gaps)
