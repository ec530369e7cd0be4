"""``stickslip optimise``: the periodic wave that does best on a stand."""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.fronts import find_and_write, play_command
from stickslip_ros.cli.printing import Answer as Printed
from stickslip_ros.cli.printing import table
from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.parameters.typed import to_si_list
from stickslip_ros.progress import shown_progress
from stickslip_ros.stopping import Stopped
from stickslip_ros.study.design.answer import Answer, Order, optimise
from stickslip_ros.study.design.front import POINTS, FrontOrder
from stickslip_ros.study.design.objectives import OBJECTIVES, WORTHLESS, Goal
from stickslip_ros.study.design.picture import draw_answer
from stickslip_ros.study.design.search import Budget
from stickslip_ros.study.design.steady_cycle import write_wave
from stickslip_ros.study.journal import Journal
from stickslip_ros.study.plotting import check_picture, save_figure
from stickslip_ros.units import with_unit


def optimise_verb(arguments: argparse.Namespace) -> Printed:
    """Search, write the wave, draw."""
    order, path = chosen_order(arguments), arguments.output
    if path.suffix != '.csv':
        raise RecordingError(path, 'is no table of a wave', 'let its name end in .csv')
    make_room(path)
    if arguments.figure:
        check_picture(arguments.figure)
        make_room(arguments.figure)
    journal_path = path.with_name(f'{path.name}.journal')
    if arguments.second:
        second = _goal(arguments, arguments.second)
        front = FrontOrder(order, second, arguments.points or POINTS)
        return find_and_write(front, arguments, journal_path)
    if arguments.points:
        limit, hint = 'of no use to one objective', 'name the other one: --second'
        raise OutOfRange('number of points', arguments.points, '', limit, hint)
    with (
        Journal(journal_path, order.identity(), fresh=arguments.fresh) as journal,
        shown_progress('evaluations', quiet=arguments.json, resumes=True) as show,
    ):
        answer = optimise(
            order,
            journal=journal,
            workers=arguments.workers,
            scheduler=arguments.scheduler,
            tell=lambda done, cost: show(done, order.evaluations, _note(order, cost)),
        )
        best = answer.entries[answer.best].wave
        write_wave(best.rows(order.stand, backwards=order.goal.backwards), path)
        if answer.stopped:
            kept = f'best wave so far in {path}; the same command goes on'
            raise Stopped(f'stopped after {len(journal.rows)} evaluations; {kept}')
        journal.remove()
    if arguments.figure:
        save_figure(draw_answer(answer), arguments.figure)
    return Printed(_content(answer, path), _parts(answer, path))


def chosen_order(arguments: argparse.Namespace) -> Order:
    """
    Return what a command line asks for.

    Raises
    ------
    StickSlipError
        If a name or a number is refused.

    """
    stand = chosen_parameters(arguments)
    preload = arguments.preload or str(stand.stand.preload)
    return Order(
        goal=_goal(arguments, arguments.objective),
        stand=stand,
        frequencies_hz=_limits('--frequency', arguments.frequency, 'Hz'),
        preloads_n=_limits('--preload', preload, 'N'),
        knots=arguments.knots,
        budget=Budget(arguments.evaluations, arguments.seconds),
        seed=arguments.seed,
        seeds=arguments.seeds,
        stands=arguments.stands,
        spread=arguments.spread,
        rule=arguments.rule,
    )


def _goal(arguments: argparse.Namespace, objective: str) -> Goal:
    """Return one of the objectives; of two, only vibration is asked for a speed."""
    is_other = objective != 'vibration' and 'vibration' in (arguments.objective, arguments.second)
    speed_m_per_s = 0.0 if is_other else arguments.speed
    return Goal(objective, arguments.load, speed_m_per_s, arguments.backwards)


def _limits(name: str, text: str, unit: str) -> tuple[float, float]:
    """Return the two limits that a text gives, or twice its one number."""
    texts = text.split(':')
    if len(texts) > 2:
        raise WrongKind(name, text, 'one quantity or two', 'write LOW:HIGH')
    numbers = to_si_list(name, texts, unit)
    return numbers[0], numbers[-1]


def _note(order: Order, cost: float) -> str:
    if cost >= WORTHLESS:
        return ''
    objective = OBJECTIVES[order.goal.objective]
    return f'best {with_unit(-cost if objective.is_largest else cost, objective.unit)}'


def _content(answer: Answer, path: Path) -> dict[str, Any]:
    """Return the answer as JSON knows it."""
    entries = {
        name: {
            'value': _or_none(entry.value),
            'error': _or_none(entry.error),
            'gain': _or_none(answer.gain_of(name)),
            'meets_constraint': entry.meets,
            'costs_of_seeds': entry.costs,
            **vars(entry.wave),
        }
        for name, entry in answer.entries.items()
    }
    return {
        'file': str(path),
        'objective': answer.order.goal.objective,
        'unit': OBJECTIVES[answer.order.goal.objective].unit,
        'formula': OBJECTIVES[answer.order.goal.objective].formula,
        'best': answer.best,
        'gain': _or_none(answer.gain),
        'gain_in_errors': _or_none(answer.errors),
        'counts': answer.counts,
        'unseen': {name: _or_none(gain) for name, gain in answer.unseen.items()},
        'shapes': entries,
    }


def _or_none(value: float) -> float | None:
    """Return a number, or None, which JSON knows, of what is none."""
    return value if math.isfinite(value) else None


def _shown(value: float, text: str) -> str:
    return text if math.isfinite(value) else '-'


def _parts(answer: Answer, path: Path) -> Iterator[Any]:
    """Return the answer as people read it."""
    order, objective = answer.order, OBJECTIVES[answer.order.goal.objective]
    title = f'{order.goal.objective}: {objective.formula}'
    header = ('wave', 'value', 'error', 'gain', 'seeds differ by', 'V', 'Hz', 'N')
    yield table(title, _rows(answer), header)
    said = 'counts' if answer.counts else 'does not count'
    yield (
        f'gain    {answer.best}: {answer.gain:+.1%} over the best saw-tooth, '
        f'{answer.errors:.3g} errors of the integration: {said}'
    )
    if answer.unseen:
        rows = [(name, _shown(gain, f'{gain:+.1%}')) for name, gain in answer.unseen.items()]
        yield table('gain on stands that no search has seen', rows)
    wave = answer.entries[answer.best].wave
    yield f'wave    {path}'
    yield f'play    {play_command(order.goal, order.stand, wave, path)}'
    yield f'        {wave.frequency_hz:g} Hz; in the node: command/waveform, docs/design.md'


def _rows(answer: Answer) -> Iterator[tuple[str, ...]]:
    unit = OBJECTIVES[answer.order.goal.objective].unit
    for name, entry in answer.entries.items():
        costs = entry.costs
        spread = (max(costs) - min(costs)) / abs(min(costs)) if min(costs) else 0.0
        yield (
            name if entry.meets else f'{name} (misses the constraint)',
            _shown(entry.value, with_unit(entry.value, unit)),
            _shown(entry.error, with_unit(entry.error, unit)),
            _shown(answer.gain_of(name), f'{answer.gain_of(name):+.1%}'),
            f'{spread:.1%}' if len(costs) > 1 else '',
            f'{entry.wave.voltage_v:.4g}',
            f'{entry.wave.frequency_hz:.5g}',
            f'{entry.wave.preload_n:.4g}',
        )
