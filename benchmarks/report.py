# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tables on the screen, in the results file and in the README."""

import datetime as dt
import json
import math
import os
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy

import stickslip_ros
from benchmarks.outcome import Outcome, Row
from benchmarks.wishes import wishes_of

FOLDER = Path(__file__).resolve().parent
RESULTS, README = FOLDER / 'results.json', FOLDER / 'README.md'
BEGIN, END = '<!-- results: written by `make bench` -->', '<!-- end of the results -->'


def text_of(value: str | float) -> str:
    """Return a value as a table shows it: three digits, small numbers as powers of ten."""
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return str(value)
    if math.isnan(value):
        return '-'
    if value and abs(value) < 1e-2:
        return f'{value:.1e}'
    return f'{value:.0f}' if abs(value) >= 100.0 else f'{value:.3g}'


def show(outcome: Outcome) -> None:
    """Print the table of one benchmark, with aligned columns, and its notes."""
    rows = [*map(list, outcome.rows[:1])]
    rows += [[*map(text_of, row.values())] for row in outcome.rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ['  '.join(map(str.ljust, row, widths)) for row in rows]
    print('', outcome.title, *lines, *outcome.notes, sep='\n')


def circumstances() -> dict[str, Any]:
    """Return when, where and with what a run was made."""
    return {
        'date': dt.datetime.now(dt.timezone.utc).isoformat(timespec='seconds'),
        'machine': {
            'processor': _processor(),
            'cores': os.cpu_count(),
            'system': f'{platform.system()} {platform.machine()}',
            'load': os.getloadavg()[0],
        },
        'commit': _commit(),
        'versions': {
            'stickslip_ros': stickslip_ros.__version__,
            'python': platform.python_version(),
            **{each.__name__: each.__version__ for each in (np, numba, scipy)},
        },
    }


def entry_of(outcome: Outcome, seconds: float) -> dict[str, Any]:
    """Return what the results hold of one benchmark."""
    return {
        'title': outcome.title,
        'seconds': seconds,
        'rows': [_without_nan(row) for row in outcome.rows],
        'notes': outcome.notes,
    }


def write_results(results: Mapping[str, Any], path: Path) -> None:
    """Write the results file."""
    path.write_text(json.dumps(results, indent=2) + '\n', encoding='utf-8')


def write_readme(results: Mapping[str, Any], path: Path = README) -> None:
    """Put the table of a run into the README, between its two marks."""
    text = path.read_text(encoding='utf-8')
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    path.write_text(f'{before}{BEGIN}\n\n{markdown_of(results)}\n{END}{after}', encoding='utf-8')


def markdown_of(results: Mapping[str, Any]) -> str:
    """Return a table of what users want, and when and where it was measured, as Markdown."""
    rows = [*wishes_of(results)]
    cells = [map(text_of, row.values()) for row in rows]
    head = [key.replace('_', ' ') for key in rows[0]]
    marks = ['---' if isinstance(value, str) else '--:' for value in rows[0].values()]
    table = [f'| {" | ".join(line)} |' for line in (head, marks, *cells)]
    return '\n'.join([*table, '', _heading(results), ''])


def _heading(results: Mapping[str, Any]) -> str:
    machine = results['machine']
    return (
        f'{results["date"]}, {machine["processor"]}, {machine["cores"]} shared cores (load '
        f'{machine["load"]:.2g} at the end), {machine["system"]}; commit {results["commit"]}; '
    ) + ', '.join(f'{name} {version}' for name, version in results['versions'].items())


def _without_nan(row: Row) -> dict[str, str | float | None]:
    return {key: None if value != value else value for key, value in row.items()}  # noqa: PLR0124


def _commit() -> str:
    """Return the commit that was run; a tree with changes is marked."""
    try:
        head, changes = (
            subprocess.check_output(['git', *words], cwd=FOLDER, text=True).strip()
            for words in (['rev-parse', '--short=12', 'HEAD'], ['status', '--porcelain'])
        )
    except (OSError, subprocess.CalledProcessError):
        return 'unknown'
    return head + (' with changes' if changes else '')


def _processor() -> str:
    lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    names = (line.split(':')[1].strip() for line in lines if line.startswith('model name'))
    return next(names, 'unknown processor')
