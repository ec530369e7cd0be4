# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Courses: generators of drive runs, advanced together in lanes with the bits of single runs."""

from collections import deque
from collections.abc import Generator, Iterable
from functools import lru_cache
from itertools import chain
from typing import TypeAlias, TypeVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import LANES_MIN, observe_all, takes_only_long_steps
from stickslip_ros.drive.build import plant_of, state_at_rest
from stickslip_ros.drive.ledger import take_ledger
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.drive.records import FORCE, Wave
from stickslip_ros.drive.waveform import level
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import Parameters

_Result = TypeVar('_Result')
Advance: TypeAlias = tuple[Record, Record, Wave, float, float, Array, Array]
"""Arguments of ``observe_samples``."""
Course: TypeAlias = Generator[Advance, None, _Result]

BUNDLE = 4 * LANES  # courses per worker; only the last ones leave lanes empty
ROUNDING_S = 1e-12  # rounding error of the time of the last corner
_kept_plant = lru_cache(maxsize=LANES)(plant_of)
_ended = deque[Record](maxlen=LANES)  # states whose memory the next drives take


def run_in_lanes(courses: Iterable[Course[_Result]]) -> list[_Result]:
    """Run courses to their ends, LANES at a time; return the results in order."""
    results: dict[int, _Result] = {}
    coming, going = enumerate(courses), list[tuple[int, Course[_Result]]]()
    while True:
        asked, still = list[Advance](), list[tuple[int, Course[_Result]]]()
        for number, course in chain(going, coming):
            try:
                asked.append(next(course))
                still.append((number, course))
            except StopIteration as ended:
                results[number] = ended.value
            if len(asked) == LANES:
                break
        if not asked:
            return [results[number] for number in range(len(results))]
        going = still
        observe_all(asked)


def run_course(course: Course[_Result]) -> _Result:
    """Run a course to its end."""
    return run_in_lanes([course])[0]


def shared_plant(parameters: Parameters) -> Record:
    """Return the constants of a drive, which may be shared by drives of the same stand."""
    # Travelling roughness and a change of the preload are stored in them.
    own = parameters.contact.travel or parameters.stand.preload_end
    return (plant_of if own else _kept_plant)(parameters)


def drive_at_rest(parameters: Parameters) -> tuple[Record, Record]:
    """Return plant and state of a drive at rest; the state may take that of an ended one."""
    plants = shared_plant(parameters)
    try:  # another thread may take the last one
        ended = _ended.pop()
    except IndexError:
        ended = None
    return plants, state_at_rest(plants, parameters.stand.preload, ended)


def give_back(plants: Record, states: Record, parameters: Parameters) -> None:
    """Keep an unused state for the next drive: to make one anew takes 0.1 ms."""
    if takes_only_long_steps(plants, states) and not parameters.stand.preload_end:
        _ended.append(states)


def bundle_for(parameters: Parameters) -> int:
    """Return the courses per worker; 1 if the stand cannot run in lanes."""
    in_lanes = not parameters.stand.preload_end and shared_plant(parameters)[0].only_long_steps
    return BUNDLE if in_lanes else 1


def compile_for_runs() -> None:
    """Compile the kernels that only runs need: lanes and ledger."""
    plants = plant_of(Parameters())
    states = state_at_rest(plants, Parameters().stand.preload)
    log, truth = np.zeros((1, 3)), np.zeros((1, FORCE + 1))
    for plain in (True, False):
        plants['plain'] = plain
        observe_all([(plants, states, level(0.0), 0.0, 0.0, truth, log)] * LANES_MIN)
    take_ledger(plants, states)


def cycles_of(
    plants: Record, states: Record, wave: Wave, cycles: int, load_n: float = 0.0
) -> Course[Array]:
    """Advance a drive by cycles; return per cycle the position after the fall, mean and end, m."""
    log, truth = np.zeros((cycles, 3)), np.zeros((1, FORCE + 1))
    first = int(states['clock']['cycle'].item())
    time_s = cycles * wave.period_s - float(states['clock']['ramp_s'].item())
    while int(states['clock']['cycle'].item()) < first + cycles:
        yield plants, states, wave, load_n, time_s, truth, log
        time_s = ROUNDING_S
    oldest = first % cycles
    return np.concatenate((log[oldest:], log[:oldest])) if oldest else log
