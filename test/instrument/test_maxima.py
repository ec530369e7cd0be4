# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""No allowed command ends a drive: the documented maxima, in pairs, on each stage."""

from collections.abc import Iterator
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_runs import load as push
from bench_runs import sawtooth, steps

from stickslip_ros.drive.amplifier import corners_within
from stickslip_ros.drive.build import slew_of, tread_s
from stickslip_ros.drive.records import CORNERS, PLAYS_MAX, VOLTAGE
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.checks import FALL_SHARE_MAX, STEPS_MAX, fastest_steps_m_per_s
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.lab.panel.controls import NUMBER_FIELDS
from stickslip_ros.parameters import Parameters, load_yaml, spec_of
from stickslip_ros.parameters.stages import stage_file, stage_files

ROOT = Path(__file__).resolve().parents[2]
STANDS = {
    'paper': Parameters(),
    'realistic': load_yaml(ROOT / 'config/realistic.yaml'),
    **{name: load_yaml(stage_file(name)) for name in stage_files()},
}
WALKER = STANDS['walker']
LONGEST = WALKER.updated({'feet.delay': (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)})
"""The walker with the longest delay."""
DEALT = 'heavy', 'walker', 'clamp', 'longest', 'rod', 'realistic', 'three_balls'
"""Stands for which a pair takes longest: each pair runs on one of them, and on each of the others;
of each command four or five."""
BLOCK_S = 2e-4
"""Time for each command of a pair: 200 rows of the densest waveform."""
CONVERTER = {'amplifier.resolution': 0.05, 'amplifier.bandwidth': 2e4}
DENSE_S = 1e-8
"""Time between rows that all lie within one delay."""
SLACK = 3
"""Pieces before and after a wave: the voltage held so far, a slew to its start, its end."""


def zigzag(parameters: Parameters, rows: int, step_s: float, cycles: int = 1) -> Request:
    """Return a closed waveform over the whole range."""
    amplifier = parameters.amplifier
    voltages_v = np.resize((amplifier.voltage_max, amplifier.voltage_min), rows)
    table = np.column_stack((np.arange(rows) * step_s, voltages_v))
    return Request('waveform', tuple(table.ravel().tolist()), cycles=cycles)


def largest_commands(parameters: Parameters) -> Iterator[Request]:
    """Give each command with its largest numbers, shorter ones, and one beyond its limit."""
    amplifier, stand = parameters.amplifier, parameters.stand
    range_v = amplifier.voltage_max - amplifier.voltage_min
    fastest_hz = FALL_SHARE_MAX * slew_of(parameters) / range_v
    highest_hz = min(fastest_hz, amplifier.frequency_max)
    yield from (Request('voltage', (each,)) for each in (amplifier.voltage_min, 0.0))
    yield from (sawtooth(range_v, each) for each in (highest_hz, -highest_hz, 1e-3))
    yield from map(steps, (STEPS_MAX, -STEPS_MAX))
    yield from (Request('jog', (each,)) for each in (highest_hz, -highest_hz))
    yield zigzag(parameters, 3001, 1e-6)
    yield zigzag(parameters, 3001, 1e-8)
    yield zigzag(parameters, 61, 1e-6, cycles=STEPS_MAX)
    targets = stand.travel_min, stand.travel_max, 9.0
    yield from (Request('position', (each, 0.0, 0.0)) for each in targets)
    yield Request('joint', joints=Joints((), (stand.travel_max,)))
    yield Request('joint', joints=Joints((), (), (fastest_steps_m_per_s(parameters),)))
    yield Request('trajectory', (0.1, 0.1 * fastest_steps_m_per_s(parameters), 0.0, 0.0))
    yield from (push(each) for each in (stand.load_limit, -stand.load_limit))
    yield from (Request('preload', (each,)) for each in (stand.preload_limit, 1e-3))
    yield Request('preload', (1.001 * stand.preload_limit,))  # is refused
    yield from (Request('enable_amplifier', (each,)) for each in (0.0, 1.0))
    yield from map(Request, ('stop', 'reset', 'zero_position', 'tare_force', 'clear_faults'))
    yield Request('fault', settings=(('fault.dead_foot', 1), ('fault.missed_steps', 1.0)))
    limits = ('limits.soft_min', stand.travel_min), ('limits.soft_max', stand.travel_max)
    yield Request('parameters', settings=limits)


def follow(bench: Bench, requests: list[Request]) -> list[Any]:
    """Carry out requests, one in each block; return their events."""
    blocks = [bench.update(bench.time_ns + bench.parameters.block_ns, (r,)) for r in requests]
    return [event for output in blocks for event in output.events]


@pytest.mark.parametrize('stage', [*STANDS, 'longest'])
def test_no_pair_of_the_largest_commands_ends_a_drive(stage):
    parameters = STANDS.get(stage, LONGEST).updated({'sim.block': BLOCK_S})
    bench, results = Bench(parameters), set()
    enable = Request('enable_amplifier', (1.0,))
    numbered = [*enumerate(largest_commands(parameters))]
    for (i, first), (j, second) in combinations_with_replacement(numbered, 2):
        if stage in DEALT and (i + j) % len(DEALT) != DEALT.index(stage):
            continue
        results |= {event.result for event in follow(bench, [enable, first, second, first])}
    assert {Result.DONE, Result.INVALID_PARAMETER} <= results
    assert np.isfinite(bench.state.position_m)


def remembered(bench: Bench) -> int:
    """Return the pieces of the voltage that delayed feet still read."""
    history, late = bench.state.history, bench.state.late[: bench.plant.delayed]
    return max((history.newest - each.corner) % CORNERS + 1 for each in late)


@pytest.mark.parametrize('changes', [{}, CONVERTER, {'amplifier.slew_rate': 1e7}], ids=str)
@pytest.mark.parametrize('stand', [WALKER, LONGEST], ids=['walker', 'longest'])
def test_a_wave_has_no_more_corners_than_were_counted(stand, changes):
    stand = stand.updated(changes)
    waves = (
        sawtooth(400.0, 100.0),
        sawtooth(100.0, 20e3),
        zigzag(stand, 3001, 1e-6),
        zigzag(stand, 801, 1e-7, cycles=0),
        zigzag(stand, 901, 1e-5, cycles=7),
    )
    delay_s, step_v = max(stand.feet.delay), stand.amplifier.resolution
    counted = 0
    for request in waves:
        bench, most = Bench(stand), 0
        bench.accept(request)
        for _ in range(round(1.2e3 * delay_s) + 1):
            output = bench.update(bench.time_ns + stand.block_ns)
            most = max(most, remembered(bench))
        if bench.refused:
            continue
        wave = check_request(request, stand)
        corners = corners_within(wave, delay_s, slew_of(stand), step_v, tread_s(stand))
        assert most <= corners + SLACK
        assert Result.CORNER_LIMIT_REACHED not in {each.result for each in output.events}
        counted += 1
    assert counted


@pytest.mark.parametrize(
    ('changes', 'request_of', 'remedy'),
    [
        ({}, lambda stand: zigzag(stand, 9001, DENSE_S), lambda stand: zigzag(stand, 99, DENSE_S)),
        ({}, lambda stand: zigzag(stand, 9001, DENSE_S), {'feet.delay': (0.0,) * 6}),
        ({}, lambda stand: zigzag(stand, 61, 1e-6, 0), {'feet.delay': (0.0, 1e-3, 0, 0, 0, 0)}),
        ({'amplifier.frequency_max': 1e6}, lambda _: sawtooth(50.0, 1e5), sawtooth(50.0, 2e4)),
        ({'amplifier.resolution': 0.3}, lambda _: sawtooth(400.0, 100.0), sawtooth(400.0, 10.0)),
        ({'amplifier.resolution': 0.3, 'step.amplitude': 400.0, 'step.frequency': 100.0},
         lambda _: Request('position', (1e-6, 0.0, 0.0)), {'amplifier.resolution': 0.0}),
        ({'amplifier.resolution': 0.3}, lambda _: Request('jog', (100.0,)),
         {'amplifier.resolution': 0.0}),
    ],
)  # fmt: skip
def test_more_corners_than_a_delay_remembers_are_refused_with_remedies(
    changes, request_of, remedy
):
    stand = LONGEST.updated(changes)
    bench, request = Bench(stand), request_of(stand)
    (event,) = follow(bench, [request])
    assert event.result is Result.INVALID_PARAMETER
    assert 'is above the 8192 that are remembered for the longest feet.delay' in event.message
    assert 'shorten it, send a lower frequency or fewer rows' in event.message
    if isinstance(remedy, dict):
        stand, wanted = stand.updated(remedy), request
    else:
        wanted = remedy(stand) if callable(remedy) else remedy
    bench = Bench(stand)
    follow(bench, [wanted])
    assert bench.refused == 0


def test_waves_that_add_up_to_more_hold_the_voltage_and_say_so():
    bench = Bench(LONGEST)
    wave = zigzag(LONGEST, 2701, DENSE_S)
    results = [event.result for event in follow(bench, [wave] * 8)]
    assert set(results) == {Result.DONE, Result.CORNER_LIMIT_REACHED}
    held_v = bench.stand.voltage_v
    output = bench.update(bench.time_ns + LONGEST.block_ns)
    assert set(output.readings.trace[:, VOLTAGE]) == {held_v}
    assert not output.status & Status.MOVING
    assert output.status & Status.MOVEMENT_FAILED
    for _ in range(60):
        bench.update(bench.time_ns + LONGEST.block_ns)
    (event,) = follow(bench, [wave])
    assert event.result is Result.DONE


def test_a_voltage_in_each_sample_is_followed_or_held():
    stand = LONGEST.updated({'trace.sample_rate': 1e6, 'sim.block': 1e-4, 'trace.period': 1e-3})
    bench, results = Bench(stand), set()
    for i in range(20000):
        output = bench.update(bench.time_ns + stand.sample_ns, (Request('voltage', (i % 2,)),))
        results |= {event.result for event in output.events}
    assert results == {Result.DONE, Result.CORNER_LIMIT_REACHED}


@pytest.mark.parametrize('stage', STANDS)
def test_a_target_is_taken_up_to_the_limit_that_the_panel_shows(stage):
    stand = STANDS[stage].updated({'load_cell.contact': 'absent'})
    low, high = (
        getattr(stand.stand, str(name).partition('.')[2])
        for name in NUMBER_FIELDS['position', 'x'][:2]
    )
    doors = (
        lambda x_m: Request('position', (x_m, 0.0, 0.0)),
        lambda x_m: Request('joint', joints=Joints((), (x_m,))),
        lambda x_m: Request('trajectory', (1e3, x_m, 0.0, 0.0)),
        lambda x_m: Request('parameters', settings=(('limits.soft_max', abs(x_m)),)),
    )
    for door in doors:
        for inside, outside in ((low, 1.001 * low), (high, 1.001 * high), (high, 9.0)):
            check_request(door(inside), stand)
            (event,) = follow(Bench(stand), [door(outside)])
            assert event.result is Result.INVALID_PARAMETER
    with pytest.raises(OutOfRange, match='outside the travel'):
        stand.updated({'limits.soft_min': 1.001 * low})


def test_there_is_room_for_all_play_operators():
    assert spec_of('actuator.plays').maximum == PLAYS_MAX
