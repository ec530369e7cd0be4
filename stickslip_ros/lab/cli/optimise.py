# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip optimise``: search the best periodic wave for a stand."""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stickslip_ros.errors import RecordingError, WrongKind
from stickslip_ros.extras import require_lab
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.cli.chosen import asked_output, chosen_draws, chosen_for, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.design.objectives import COST_MAX, OBJECTIVES, WaveGoal, cell_of
from stickslip_ros.lab.design.search import SearchResult, SearchStopped, WaveSearch, optimise
from stickslip_ros.lab.design.waves import PeriodicWave, write_wave
from stickslip_ros.parameters import Parameters
from stickslip_ros.parameters.typed import to_si_list
from stickslip_ros.process.stopping import Stopped
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section
from stickslip_ros.units import display_unit, with_unit

JUDGES = 8  # draws of a fit over which a wave is averaged


def optimise_verb(arguments: argparse.Namespace) -> Answer:
    """Search the best wave, and write it."""
    require_lab('stickslip optimise')
    search, path = chosen_search(arguments), asked_output(arguments)
    if path.suffix != '.csv':
        raise RecordingError(path, 'is not a .csv file', 'end its name so')
    prepare_output(path)
    objective = OBJECTIVES[search.goal.objective]
    sign = -1.0 if objective.is_largest else 1.0

    def write(wave: PeriodicWave) -> None:
        write_wave(wave.rows(search.stand), path)

    with shown_progress('evaluations', quiet=arguments.json) as show:

        def progress(done: int, cost: float) -> None:
            note = f'best {with_unit(sign * cost, objective.unit)}' if cost < COST_MAX else ''
            show(done, search.total, note)

        try:
            given = chosen_for(optimise, arguments)
            result = optimise(search, **given, progress=progress)
        except SearchStopped as stop:
            write(stop.wave)
            raise Stopped(f'{stop}; best wave so far in {path}') from None
        write(result.shapes[result.best].wave)
    return Answer(_content(result, path), _parts(result, path))


def chosen_search(arguments: argparse.Namespace) -> WaveSearch:
    """Return the search that a command line describes."""
    stand = chosen_parameters(arguments)
    return WaveSearch(
        goal=WaveGoal(**chosen_for(WaveGoal, arguments)),
        stand=stand,
        frequencies_hz=_limits('--frequency', arguments.frequency, 'Hz'),
        preloads_n=_limits('--preload', arguments.preload or str(stand.stand.preload), 'N'),
        judges=tuple(chosen_draws(arguments, JUDGES)),
        **chosen_for(WaveSearch, arguments),
    )


def _limits(name: str, text: str, unit: str) -> tuple[float, float]:
    """Return the two limits in a text, or its single number twice."""
    texts = text.split(':')
    if len(texts) > 2:
        raise WrongKind(name, text, 'one quantity or two', 'write LOW:HIGH')
    numbers = to_si_list(name, texts, unit, ':')
    return numbers[0], numbers[-1]


def _content(result: SearchResult, path: Path) -> dict[str, Any]:
    objective = OBJECTIVES[result.search.goal.objective]
    shapes = {
        name: {
            'value': one.value,
            'error': one.error,
            'gain': result.gain_of(name),
            'meets_constraint': one.meets,
            **vars(one.wave),
        }
        for name, one in result.shapes.items()
    }
    return {
        'file': str(path),
        'objective': result.search.goal.objective,
        'unit': objective.unit,
        'formula': objective.formula,
        'best': result.best,
        'gain': result.gain_of(result.best),
        'gain_in_errors': result.errors,
        'counts': result.counts,
        'shapes': shapes,
    }


def _parts(result: SearchResult, path: Path) -> Iterator[Any]:
    search, best = result.search, result.best
    objective = OBJECTIVES[search.goal.objective]
    factor, unit = display_unit(objective.unit)

    def shown(value: float, form: str) -> str:
        return format(value, form) if math.isfinite(value) else '-'

    rows = [
        (
            name if one.meets else f'{name} (misses the constraint)',
            *(shown(factor * one.value, '.4g'), shown(factor * one.error, '.1g')),
            shown(result.gain_of(name), '+.1%'),
            *(f'{one.wave.voltage_v:.4g}', f'{one.wave.frequency_hz:.5g}'),
            f'{one.wave.preload_n:.4g}',
        )
        for name, one in result.shapes.items()
    ]
    header = ('wave', unit or 'value', 'error', 'gain', 'V', 'Hz', 'N')
    yield Section(f'{search.goal.objective}: {objective.formula}', rows, header)
    verdict = 'counts' if result.counts else 'does not count'
    yield (
        f'gain    {best}: {result.gain_of(best):+.1%} over the best saw-tooth, '
        f'{result.errors:.3g} errors of the integration: {verdict}'
    )
    if search.judges:
        yield f'judged  by the mean of {len(search.judges)} draws of the stand'
    wave = result.shapes[best].wave
    yield f'wave    {path}'
    yield f'play    {play_command(search.goal, search.stand, wave, path)}'
    yield f'        {wave.frequency_hz:g} Hz; in the node: command/waveform'


def play_command(goal: WaveGoal, stand: Parameters, wave: PeriodicWave, path: Path) -> str:
    """Return the command that plays a wave as it was judged, without options of the stand."""
    values = stand.flat()
    changes = {name: v for name, v in cell_of(goal, stand).items() if values[name] != v}
    sets = ''.join(f' --set {name}={value}' for name, value in changes.items())
    return f'stickslip simulate --waveform {path} --preload {wave.preload_n:g}{sets}'
