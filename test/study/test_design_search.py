"""The search for a wave: seeded, resumable, the same on any number of workers."""

import dataclasses
import json
import time
from statistics import fmean
from typing import Any

import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Parameters
from stickslip_ros.study import batch
from stickslip_ros.study.batch import executor_of
from stickslip_ros.study.design.answer import (
    PLAIN,
    RIVAL,
    Answer,
    Entry,
    Order,
    gain_over,
    optimise,
    spread_stands,
    unseen_stands,
)
from stickslip_ros.study.design.objectives import Goal
from stickslip_ros.study.design.search import Budget, Task, search
from stickslip_ros.study.design.shapes import SHAPES
from stickslip_ros.study.design.waves import SPLINE, Space
from stickslip_ros.study.journal import Journal, identify

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
FIXED = ((1000.0, 1000.0), (0.5, 0.5))
SPLINES = Space(SPLINE, STAND, *FIXED)
TASK = Task(SPLINES, Goal('speed'), (STAND,))
BUDGET = Budget(40)
SMALL = Order(Goal('speed'), STAND, *FIXED, knots=6, budget=Budget(12), seeds=1)


def found_by(workers=1, seed=7, task=TASK, **how):
    with executor_of(workers) as executor:
        return search(task, how.pop('budget', BUDGET), seed, executor, **how)


def test_the_same_seed_finds_the_same_wave_on_one_worker_and_on_two():
    long = Budget(150)
    one, two = found_by(1, budget=long), found_by(2, budget=long)
    other = found_by(1, seed=8, budget=long)
    assert dataclasses.asdict(one) == dataclasses.asdict(two)
    assert other.wave != one.wave
    assert len(one.history) == long.evaluations
    assert one.history == sorted(one.history, reverse=True)
    assert one.cost == one.history[-1] < one.history[0]  # better than the saw-tooth it began with


def test_a_shape_of_a_single_number_is_searched_too():
    found = found_by(task=Task(Space('cycloid', STAND, *FIXED), Goal('force'), (STAND,)))
    assert found.wave.shape == 'cycloid'
    assert len(found.history) == BUDGET.evaluations


def test_a_search_that_was_killed_goes_on_as_if_it_had_not_been(tmp_path, monkeypatch):
    identity = identify('test', STAND, 100, {})
    with Journal(tmp_path / 'whole', identity) as journal:
        whole = found_by(journal=journal, first=10)
        assert sorted(journal.rows) == list(range(10, 50))
    lines = (tmp_path / 'whole').read_bytes().splitlines(keepends=True)
    (tmp_path / 'torn').write_bytes(b''.join(lines[:20]) + lines[20][:9])
    computed: list[object] = []
    cost = Task.__call__

    def counted(task, place):
        computed.append(place)
        return cost(task, place)

    monkeypatch.setattr(Task, '__call__', counted)
    with Journal(tmp_path / 'torn', identity) as journal:
        resumed = found_by(journal=journal, first=10)
    assert dataclasses.asdict(resumed) == dataclasses.asdict(whole)
    assert len(computed) == BUDGET.evaluations - 19


def test_a_stopped_search_keeps_its_best_wave(monkeypatch):
    looks = []

    def stop_after_a_while():
        looks.append(1)
        if len(looks) > 300:
            raise KeyboardInterrupt

    monkeypatch.setattr(batch, 'heed_stop', stop_after_a_while)
    stopped = found_by(budget=Budget(5000))
    assert stopped.stopped
    assert 1 < len(stopped.history) < 5000
    assert stopped.cost == min(stopped.history) < stopped.history[0]
    answer = optimise(dataclasses.replace(SMALL, budget=Budget(5000)), workers=1)
    assert answer.stopped
    assert answer.unseen == {}


def test_seconds_end_a_search_between_two_generations(monkeypatch):
    seconds = iter(range(1000))
    monkeypatch.setattr(time, 'monotonic', lambda: float(next(seconds)))
    found = found_by(budget=Budget(5000, seconds=5.0))
    assert 1 < len(found.history) < 100


def test_several_stands_judge_by_their_mean_or_by_the_worst():
    stands = tuple(spread_stands(STAND, 3, 0.2, 5))
    place = SPLINES.start.tolist()
    alone = [float(Task(SPLINES, Goal('speed'), (stand,))(place)['cost']) for stand in stands]
    assert len(set(alone)) == 3
    mean, worst = (
        Task(SPLINES, Goal('speed'), stands, rule)(place)['cost'] for rule in ('mean', 'worst')
    )
    assert mean == pytest.approx(fmean(alone))
    assert worst == max(alone)


def test_the_answer_has_every_shape_at_its_best_and_tries_the_best_elsewhere():
    answer = optimise(SMALL, workers=1)
    assert list(answer.entries) == [*SHAPES, SPLINE, PLAIN]
    assert all(len(entry.history) in {0, 12} for entry in answer.entries.values())
    assert answer.entries[RIVAL].value >= answer.entries[PLAIN].value
    assert answer.gain_of(RIVAL) == 0.0
    best = answer.entries[answer.best]
    assert answer.gain == pytest.approx(best.value / answer.entries[RIVAL].value - 1.0)
    assert 0.0 < best.error < 0.05 * best.value
    assert set(answer.unseen) == set(unseen_stands(SMALL))
    assert {'damping 20 N s/m', 'rough lines from 101 on'} < set(answer.unseen)
    json.dumps({name: entry.costs for name, entry in answer.entries.items()})


def entry(value, error, seed=0):
    wave = dataclasses.replace(SPLINES.plain, voltage_v=300.0 - seed)
    return Entry(wave, value, error, True, (-value,), [-value])


@pytest.mark.parametrize(
    ('value', 'error', 'counts'),
    [(1.5, 0.01, True), (1.01, 0.0001, False), (1.5, 0.2, False), (1.0, 0.0, False)],
)
def test_a_gain_counts_above_five_errors_and_two_per_cent(value, error, counts):
    entries = {RIVAL: entry(1.0, error), SPLINE: entry(value, error, 1)}
    answer = Answer(SMALL, entries, {})
    assert answer.counts is counts
    assert answer.gain == pytest.approx(value - 1.0)
    missed = dataclasses.replace(entries[SPLINE], meets=False)
    assert not Answer(SMALL, {**entries, SPLINE: missed}, {}).counts


def test_what_is_smaller_is_better_where_the_smallest_is_wanted():
    assert gain_over(Goal('energy'), 0.5, 1.0) == 0.5
    assert gain_over(Goal('speed'), 0.5, 1.0) == -0.5


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ({'seeds': 0}, 'number of seeds 0 is not from 1'),
        ({'stands': 0}, 'number of stands 0 is not from 1'),
        ({'spread': 0.9}, 'spread 0.9 is not from 0 to 0.5'),
        ({'seed': -1}, 'seed -1 is below 0'),
    ],
)
def test_orders_that_ask_for_nothing_are_refused(values: dict[str, Any], message: str):
    with pytest.raises(StickSlipError, match=message):
        dataclasses.replace(SMALL, **values)


@pytest.mark.parametrize(
    ('values', 'message'),
    [
        ((0,), 'number of evaluations 0 is not from 1'),
        ((10, float('nan')), 'seconds nan s is not a time'),
    ],
)
def test_budgets_that_are_none_are_refused(values: tuple[Any, ...], message: str):
    with pytest.raises(StickSlipError, match=message):
        Budget(*values)


def test_a_rule_that_nobody_knows_is_refused():
    with pytest.raises(StickSlipError, match="rule 'best' is not known; known are mean, worst"):
        Task(SPLINES, Goal('speed'), (STAND,), 'best')
