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
from rich.console import Console
from rich.table import Table

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


def show(outcome: Outcome, console: Console) -> None:
    """Print the tables of one benchmark."""
    console.print()
    if outcome.rows:
        table = Table(title=outcome.title, title_justify='left')
        for key, value in outcome.rows[0].items():
            table.add_column(
                key.replace('_', ' '), justify='left' if isinstance(value, str) else 'right'
            )
        for row in outcome.rows:
            table.add_row(*map(text_of, row.values()))
        console.print(table)
    else:
        console.print(outcome.title)
    for note in outcome.notes:
        console.print(f'  {note}', style='dim', highlight=False)


def circumstances() -> dict[str, Any]:
    """Return when, where and with what a run was made."""
    return {
        'date': dt.datetime.now(dt.timezone.utc).isoformat(timespec='seconds'),
        'machine': _machine(),
        'commit': _commit(),
        'versions': {
            'stickslip_ros': stickslip_ros.__version__,
            'python': platform.python_version(),
            'numpy': np.__version__,
            'numba': numba.__version__,
            'scipy': scipy.__version__,
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
    known = {key: isinstance(value, str) or not math.isnan(value) for key, value in row.items()}
    return {key: value if known[key] else None for key, value in row.items()}


def _machine() -> dict[str, str | float | None]:
    return {
        'processor': _processor(),
        'cores': os.cpu_count(),
        'system': f'{platform.system()} {platform.machine()}',
        'load': os.getloadavg()[0],
    }


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
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.split(':')[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.processor() or 'unknown processor'
