"""Tables on the screen, in the results file and in the README."""

import datetime as dt
import json
import math
import os
import platform
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy
from rich.console import Console
from rich.table import Table

import stickslip_ros
from benchmarks.outcome import Outcome, Row

FOLDER = Path(__file__).resolve().parent
RESULTS = FOLDER / 'results.json'
README = FOLDER / 'README.md'
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
            justify = 'left' if isinstance(value, str) else 'right'
            table.add_column(key.replace('_', ' '), justify=justify)
        for row in outcome.rows:
            table.add_row(*map(text_of, row.values()))
        console.print(table)
    else:
        console.print(outcome.title)
    for note in outcome.notes:
        console.print(f'  {note}', style='dim', highlight=False)
    for verdict in outcome.verdicts:
        console.print(f'  {_verdict_text(asdict(verdict) | {"met": verdict.met})}')


def results_of(outcomes: Mapping[str, Outcome], seconds: Mapping[str, float]) -> dict[str, Any]:
    """Return what the results file holds."""
    return {
        'date': dt.datetime.now(dt.timezone.utc).isoformat(timespec='seconds'),
        'machine': _machine(),
        'versions': {
            'stickslip_ros': stickslip_ros.__version__,
            'python': platform.python_version(),
            'numpy': np.__version__,
            'numba': numba.__version__,
            'scipy': scipy.__version__,
        },
        'benchmarks': {
            name: {
                'title': outcome.title,
                'seconds': seconds[name],
                'rows': [_without_nan(row) for row in outcome.rows],
                'verdicts': [asdict(v) | {'met': v.met} for v in outcome.verdicts],
                'notes': outcome.notes,
            }
            for name, outcome in outcomes.items()
        },
    }


def write_results(results: Mapping[str, Any], path: Path) -> None:
    """Write the results file."""
    path.write_text(json.dumps(results, indent=2) + '\n', encoding='utf-8')


def write_readme(results: Mapping[str, Any], path: Path = README) -> None:
    """Put the tables of a run into the README, between its two marks."""
    text = path.read_text(encoding='utf-8')
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    path.write_text(f'{before}{BEGIN}\n\n{markdown_of(results)}\n{END}{after}', encoding='utf-8')


def markdown_of(results: Mapping[str, Any]) -> str:
    """Return the results as Markdown."""
    machine, versions = results['machine'], results['versions']
    lines = [
        f'{results["date"]}, {machine["processor"]}, {machine["cores"]} shared cores (load '
        f'{machine["load"]:.2g} at the end), {machine["system"]}; '
        + ', '.join(f'{name} {version}' for name, version in versions.items()),
        '',
    ]
    for name, benchmark in results['benchmarks'].items():
        lines += [f'### {name}: {benchmark["title"]}', '', *_markdown_table(benchmark['rows'])]
        lines += [f'- {note}' for note in benchmark['notes']]
        lines += [f'- {_verdict_text(verdict)}' for verdict in benchmark['verdicts']]
        lines.append('')
    return '\n'.join(lines)


def _without_nan(row: Row) -> dict[str, str | float | None]:
    known = {key: isinstance(value, str) or not math.isnan(value) for key, value in row.items()}
    return {key: value if known[key] else None for key, value in row.items()}


def _markdown_table(rows: list[dict[str, Any]]) -> list[str]:
    if not rows:
        return []
    cells = [['-' if v is None else text_of(v) for v in row.values()] for row in rows]
    head = [key.replace('_', ' ') for key in rows[0]]
    marks = ['---' if isinstance(value, str) else '--:' for value in rows[0].values()]
    return [f'| {" | ".join(line)} |' for line in (head, marks, *cells)] + ['']


def _verdict_text(verdict: Mapping[str, Any]) -> str:
    sign = '<=' if verdict['at_most'] else '>='
    state = 'met' if verdict['met'] else 'MISSED'
    wanted, found = text_of(verdict['wanted']), text_of(verdict['found'])
    return f'{state}: {verdict["target"]}: {found} (wanted {sign} {wanted})'


def _machine() -> dict[str, str | float | None]:
    return {
        'processor': _processor(),
        'cores': os.cpu_count(),
        'system': f'{platform.system()} {platform.machine()}',
        'load': os.getloadavg()[0],
    }


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.split(':')[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.processor() or 'unknown processor'
