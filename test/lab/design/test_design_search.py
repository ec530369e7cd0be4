# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The search for a wave: seeded, the same on any number of workers."""

import dataclasses
import itertools
from statistics import fmean
from typing import Any

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.design.objectives import WaveGoal
from stickslip_ros.lab.design.search import (
    COMPARED_SHAPE,
    PLAIN,
    SearchResult,
    SearchStopped,
    ShapeResult,
    WaveSearch,
    evaluations,
    optimise,
)
from stickslip_ros.lab.design.shapes import SHAPES
from stickslip_ros.lab.design.waves import SPLINE
from stickslip_ros.lab.runs import batch
from stickslip_ros.lab.runs.batch import pool_of
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.parameters import Parameters

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
SPEED = WaveSearch(WaveGoal('speed'), STAND, (1000.0, 1000.0), (0.5, 0.5), evaluations=40)
SMALL = dataclasses.replace(SPEED, knots=6, evaluations=12)


def tried(workers=1, seed=7, search=SPEED, shape=SPLINE):
    seeded = dataclasses.replace(search, seed=seed)
    with pool_of(workers) as pool:
        found = evaluations(seeded, [shape], pool)
        return [(wave, cost) for _, wave, cost in found]


def test_the_same_seed_tries_the_same_waves_on_one_worker_and_on_two():
    long = dataclasses.replace(SPEED, evaluations=150)
    one, two = tried(1, search=long), tried(2, search=long)
    assert one == two != tried(1, seed=8, search=long)
    assert len(one) == 150
    costs = [cost for _, cost in one]
    assert min(costs) < costs[0]  # better than the saw-tooth it began with


def test_a_shape_of_a_single_number_is_searched_too():
    assert len(tried(shape='cycloid')) == SPEED.evaluations


def test_a_stopped_search_has_its_best_wave(monkeypatch):
    looks = itertools.count()

    def stop_after_a_while():
        if next(looks) > 10:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch, 'stop_if_asked', stop_after_a_while)
    done: list[tuple[int, float]] = []
    long = dataclasses.replace(SMALL, evaluations=5000)
    with pytest.raises(SearchStopped, match=r'stopped after \d+ evaluations') as stopped:
        optimise(long, workers=1, progress=lambda *how_far: done.append(how_far))
    number, cost = done[-1]
    assert 1 < number < 5000
    [worth] = run_course(long.worths(stopped.value.wave, [STAND]))
    assert worth.cost == cost < done[0][1]


def test_several_stands_judge_by_their_mean():
    wave = SPEED.wave(SPLINE, SPEED.start(SPLINE))
    judges = tuple(SPEED.stand.updated({'contact.friction': each}) for each in (0.27, 0.3, 0.33))
    several = dataclasses.replace(SPEED, judges=judges)
    costs = [worth.cost for worth in run_course(several.worths(wave, judges))]
    assert len(set(costs)) == 3
    assert run_course(several.cost(wave)) == fmean(costs)


def test_the_answer_has_every_shape_at_its_best_and_its_error():
    result = optimise(SMALL, workers=1)
    assert list(result.shapes) == [*SHAPES, SPLINE, PLAIN]
    plain, rival, best = (result.shapes[name] for name in (PLAIN, COMPARED_SHAPE, result.best))
    assert rival.value >= plain.value
    assert result.gain_of(COMPARED_SHAPE) == 0.0
    assert result.gain_of(result.best) == pytest.approx(best.value / rival.value - 1.0)
    assert 0.0 < best.error < 0.05 * best.value


def result_of(value, error):
    wave = SPEED.wave(SPLINE, SPEED.start(SPLINE))
    rival, best = (ShapeResult(wave, -one, one, error, meets=True) for one in (1.0, value))
    return SearchResult(SMALL, {COMPARED_SHAPE: rival, SPLINE: best})


@pytest.mark.parametrize(
    ('value', 'error', 'counts'),
    [
        (1.5, 0.01, True),
        (1.5, 0.0, True),
        (1.01, 0.0001, False),
        (1.5, 0.2, False),
        (1.0, 0.0, False),
    ],
)
def test_a_gain_counts_above_five_errors_and_two_per_cent(value, error, counts):
    result = result_of(value, error)
    assert result.counts is counts
    assert result.gain_of(result.best) == pytest.approx(value - 1.0)
    result.shapes[result.best].meets = False
    assert not result.counts


def test_what_is_smaller_is_better_where_the_smallest_is_wanted():
    assert dataclasses.replace(SPEED, goal=WaveGoal('energy')).gain(0.5, 1.0) == 0.5
    assert SPEED.gain(0.5, 1.0) == -0.5
    assert np.isnan(SPEED.gain(0.5, 0.0))


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'evaluations': 0}, 'number of evaluations 0 is not from 1 to 1000000'),
        ({'seed': -1}, 'seed -1 is not from 0'),
        ({'knots': 5}, 'number of knots 5'),
        ({'frequencies_hz': (0.0, 10.0)}, 'frequency 0 Hz is not from 0.001 to 20000 Hz'),
        ({'frequencies_hz': (10.0, 3e4)}, 'frequency 30000 Hz is not from 0.001'),
        ({'frequencies_hz': (20.0, 10.0)}, 'frequency 20 Hz is above the end of its range'),
        ({'preloads_n': (0.5, float('nan'))}, 'preload nan N is not from 0.001 to 100 N'),
    ],
)
def test_numbers_that_no_search_can_have_are_refused(values: dict[str, Any], message: str):
    with pytest.raises(StickSlipError, match=message):
        dataclasses.replace(SMALL, **values)
