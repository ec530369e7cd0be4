# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip import``: tables of laboratories, and the options of verbs that read them."""

import argparse
import sys
from collections.abc import Callable, Iterator
from typing import Any

from stickslip_ros.errors import WrongKind, printable
from stickslip_ros.files import prepare_output, read_bytes
from stickslip_ros.lab.cli.chosen import chosen_for
from stickslip_ros.lab.cli.options import to_path
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.readers.experiment import read_experiment, read_joined, write_experiment
from stickslip_ros.lab.readers.instructions import Reading
from stickslip_ros.lab.readers.measured import EXPERIMENT_COLUMNS, MeasuredTable
from stickslip_ros.parameters import read_yaml

_CSV = '.csv'


def import_verb(arguments: argparse.Namespace) -> Answer:
    """Read tables, and write them as CSV if asked."""
    output = arguments.output
    if output is not None:
        if output.suffix.lower() != _CSV:
            raise WrongKind('output', str(output), 'a .csv file', 'end its name so')
        prepare_output(output)
    read: list[MeasuredTable] = []
    reading = Reading(**chosen_for(Reading, arguments), report=read.append)
    reading = reading.for_sources(arguments.files)
    if len(arguments.files) == 1:
        whole = read_experiment(arguments.files[0], reading)
    else:
        whole = read_joined(arguments.files, reading)
    if output is not None:
        write_experiment(whole, output)
    files = [
        {
            'file': each.origin,
            'kind': each.kind,
            'columns': each.recognised,
            'unused': each.unread,
            'notes': each.notes,
        }
        for each in read
    ]
    lines = [line for each in read for line in _lines(each)]
    content = {'files': files, 'output': str(output or '')}
    return Answer(content, [*lines, f'table   {output}'] if output else lines)


def shown_tables(arguments: argparse.Namespace) -> Callable[[MeasuredTable], None] | None:
    """Return a function that shows how a table was read; None for JSON."""

    def show(experiment: MeasuredTable) -> None:
        print(*map(printable, _lines(experiment)), sep='\n', file=sys.stderr)

    return None if arguments.json else show


def read_headers(path: str) -> dict[str, str]:
    """Return the names and headers of a YAML file."""
    hint = 'write lines such as position_m: /rig/encoder.point.x'
    content = read_bytes(to_path(path), 'check --map-file').decode('utf-8', 'replace')
    headers: Any = read_yaml(content, path, hint)
    if not isinstance(headers, dict) or not all(
        isinstance(each, str) for pair in headers.items() for each in pair
    ):
        raise WrongKind(path, content[:80], 'names with headers', hint)
    return headers


def _lines(experiment: MeasuredTable) -> Iterator[str]:
    """Yield the columns of a table as read, with unit, factor and first row."""
    rows = len(next(iter(experiment.columns.values())))
    yield f'read    {experiment.origin}: {experiment.kind}, {rows} rows'
    for each in experiment.recognised:
        first = f'{each.first:.6g} {EXPERIMENT_COLUMNS[experiment.kind][each.name].unit}'
        unit = f'in {each.unit}, times {each.factor:g}; first row {first}'
        yield f'        {each.name} is {each.header!r} {unit}'
    yield from (f'unused  {header!r}' for header in experiment.unread)
    yield from (f'note    {text}' for text in experiment.gaps)
