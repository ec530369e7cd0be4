"""``stickslip optimise --second``: the waves of which none is better in two objectives."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from stickslip_ros.cli.printing import Answer, table
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import shown_progress
from stickslip_ros.study.design.front import FrontOrder, Point, find_fronts
from stickslip_ros.study.design.objectives import OBJECTIVES, Goal, cell_of
from stickslip_ros.study.design.picture import draw_fronts
from stickslip_ros.study.design.steady_cycle import write_wave
from stickslip_ros.study.design.waves import PeriodicWave
from stickslip_ros.study.journal import Journal, Row
from stickslip_ros.study.plotting import save_figure
from stickslip_ros.study.sweep_table import write_table
from stickslip_ros.units import with_unit


def find_and_write(order: FrontOrder, arguments: argparse.Namespace, journal_path: Path) -> Answer:
    """Search, write the table and every wave of it, draw."""
    path: Path = arguments.output
    with (
        Journal(journal_path, order.identity(), fresh=arguments.fresh) as journal,
        shown_progress('evaluations', quiet=arguments.json, resumes=True) as show,
    ):
        fronts = find_fronts(
            order,
            journal=journal,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            tell=lambda done: show(done, order.evaluations),
        )
        points = [point for front in fronts.values() for point in front]
        rows = [
            _row(order, path, number, point)
            for front in fronts.values()
            for number, point in enumerate(front, 1)
        ]
        stand, backwards = order.first.stand, order.first.goal.backwards
        for row, point in zip(rows, points, strict=True):
            wave_rows = point.wave.rows(stand, backwards=backwards)
            write_wave(wave_rows, path.with_name(str(row['file'])))
        write_table(rows, path, stand)
        journal.remove()
    if arguments.figure:
        save_figure(draw_fronts(order, fronts), arguments.figure)
    return Answer({'file': str(path), 'points': rows}, _parts(order, rows, points, path))


def _row(order: FrontOrder, path: Path, number: int, point: Point) -> Row:
    """Return the row of a wave; its file is beside the table."""
    row: Row = {'shape': point.wave.shape}
    for goal, value, error in zip(order.goals, point.values, point.errors, strict=True):
        name, unit = goal.objective, OBJECTIVES[goal.objective].unit
        end = f'_{unit.lower().replace("/", "_per_")}' if unit else ''
        row |= {f'{name}{end}': value, f'{name}_error{end}': error}
    return {
        **row,
        'voltage_v': point.wave.voltage_v,
        'frequency_hz': point.wave.frequency_hz,
        'preload_n': point.wave.preload_n,
        'file': f'{path.stem}_{point.wave.shape}_{number}.csv',
    }


def _parts(
    order: FrontOrder, rows: Sequence[Row], points: Sequence[Point], path: Path
) -> Iterator[Any]:
    """Return the fronts as people read them."""
    first, second = (goal.objective for goal in order.goals)
    cells = [
        (
            row['file'],
            *(
                with_unit(value, OBJECTIVES[goal.objective].unit)
                for goal, value in zip(order.goals, point.values, strict=True)
            ),
            *(f'{point.wave.voltage_v:.4g}', f'{point.wave.frequency_hz:.5g}'),
            f'{point.wave.preload_n:.4g}',
        )
        for row, point in zip(rows, points, strict=True)
    ]
    header = ('', first, second, 'V', 'Hz', 'N')
    yield table(f'no wave of its shape is better in {first} and {second}', cells, header)
    yield f'table   {path}; the waves are beside it'
    file = path.with_name(str(rows[-1]['file']))
    yield f'play    {play_command(order.goals[0], order.first.stand, points[-1].wave, file)}'


def play_command(goal: Goal, stand: Parameters, wave: PeriodicWave, path: Path) -> str:
    """Return the command that plays a wave as its goal was judged, beside the stand's options."""
    values = stand.flat()
    changes = {name: v for name, v in cell_of(goal, stand).items() if values[name] != v}
    sets = ''.join(f' --set {name}={value}' for name, value in changes.items())
    return f'stickslip simulate --waveform {path} --preload {wave.preload_n:g}{sets}'
