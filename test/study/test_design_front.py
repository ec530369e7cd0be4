"""Two objectives at once: no wave of a front is beaten, and its ends are the best of either."""

import dataclasses
import itertools
from dataclasses import dataclass

import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Parameters
from stickslip_ros.stopping import Stopped
from stickslip_ros.study import batch
from stickslip_ros.study.batch import executor_of
from stickslip_ros.study.design import front as module
from stickslip_ros.study.design.answer import Order
from stickslip_ros.study.design.front import FrontOrder, Point, TradeOff, _range, find_fronts
from stickslip_ros.study.design.objectives import WORTHLESS, Goal, assess
from stickslip_ros.study.design.picture import draw_fronts
from stickslip_ros.study.design.search import Budget, search
from stickslip_ros.study.design.waves import Space
from stickslip_ros.study.journal import Journal

pytestmark = pytest.mark.usefixtures('compiled_kernels')

STAND = Parameters()
FIXED = ((1000.0, 1000.0), (0.5, 0.5))
QUIET = Goal('vibration', speed_m_per_s=20e-6)
FAST = Order(Goal('speed'), STAND, *FIXED, knots=6, budget=Budget(24))
FAST_AND_QUIET = FrontOrder(FAST, QUIET, 4)


@dataclass(frozen=True)
class Squares:
    """Cost of the distance from a place, whose front with another place is known."""

    best: float
    scale: float

    @property
    def space(self):
        return Space('cycloid', STAND, *FIXED)

    def __call__(self, place):
        return {'cost': self.scale * (place[0] - self.best) ** 2}


@pytest.mark.parametrize(('weight', 'known'), [(0.5, 0.5), (0.9, 0.35), (0.1, 0.65)])
def test_the_weight_chooses_the_known_place_between_two_minima(weight, known):
    # of the larger one alone: sqrt(w) (x - 0.2) = sqrt(1 - w) (0.8 - x) in units of the range
    trade_off = TradeOff((Squares(0.2, 3.0), Squares(0.8, 50.0)), weight, (0.0, 0.0), (1.08, 18.0))
    with executor_of(1) as executor:
        found = search(trade_off, Budget(200), 3, executor)
    assert found.place[0] == pytest.approx(known, abs=1e-3)


def test_a_place_that_is_worthless_to_one_is_worthless():
    trade_off = TradeOff((Squares(0.2, 1.0), Squares(0.8, 1e12)), 0.5, (0.0, 0.0), (1.0, 1.0))
    assert trade_off([0.2, 0.5]) == {'cost': WORTHLESS}


def test_a_loss_is_counted_from_the_better_end_to_the_other():
    assert _range(-3.0, 2.0) == 5.0
    assert _range(-3.0, -3.0) == 3.0  # one end is the best of both
    assert _range(-3.0, WORTHLESS) == 3.0  # the other end does not move the runner


def test_searches_go_from_the_best_of_the_first_to_the_best_of_the_second(monkeypatch):
    asked = []

    def noted(task, *rest, start, **more):
        found = search(task, *rest, start=start, **more)
        asked.append((getattr(task, 'weight', None), start, found.place))
        return found

    monkeypatch.setattr(module, 'search', noted)
    find_fronts(FAST_AND_QUIET, workers=1)
    weights = [None, None, pytest.approx(2 / 3), pytest.approx(1 / 3)]
    assert [weight for weight, *_ in asked] == 2 * weights
    for ends in (asked[:4], asked[4:]):
        first, second, third, fourth = ends
        assert first[1] is second[1] is None
        assert third[1] == first[2]
        assert fourth[1] == third[2]


def test_a_front_has_the_best_of_both_and_nothing_that_is_beaten():
    fronts = find_fronts(FAST_AND_QUIET, workers=1)
    for shape, points in fronts.items():
        for place, end in enumerate((points[0], points[-1])):
            order = FAST_AND_QUIET.orders[place]
            with executor_of(1) as executor:
                best = search(order.tasks[shape], order.budget, order.seed, executor)
            worth = assess(order.goal, STAND, best.wave.rows(STAND))
            assert end.costs[place] <= worth.cost + 2.0 * end.errors[place]
        for one, other in itertools.permutations(points, 2):
            assert not one.equals(other)
            assert any(a < b for a, b in zip(one.costs, other.costs, strict=True))
        for point in points:
            for goal, value in zip(FAST_AND_QUIET.goals, point.values, strict=True):
                assert assess(goal, STAND, point.wave.rows(STAND)).value == value
            assert 0.0 <= point.errors[0] < 0.05 * point.values[0]
    figure = draw_fronts(FAST_AND_QUIET, fronts)
    front, waves = figure.axes
    assert front.get_xlabel() == 'speed (um/s), more is better'
    assert front.get_ylabel() == 'vibration (um/s), less is better'
    assert len(waves.lines) == len(fronts['spline'])


def test_several_stands_judge_a_front_together():
    two = dataclasses.replace(FAST, stands=2, spread=0.3, rule='worst', budget=Budget(12))
    order = dataclasses.replace(FAST_AND_QUIET, first=two, points=3)
    for shape, points in find_fronts(order, workers=1).items():
        for point in points:
            worst = max(
                assess(QUIET, stand, point.wave.rows(STAND)).cost
                for stand in two.tasks[shape].stands
            )
            assert point.costs[1] == worst


def test_waves_that_miss_a_constraint_or_do_not_move_the_runner_make_no_front():
    too_fast = dataclasses.replace(QUIET, speed_m_per_s=1.0)
    order = dataclasses.replace(FAST_AND_QUIET, second=too_fast, points=3)
    with pytest.raises(StickSlipError, match='no wave was found that moves the runner and keeps'):
        find_fronts(order, workers=1)


def test_one_wave_beats_another_if_it_is_nowhere_worse():
    fast = Point(None, (0, 0), (0, 0), (-2.0, 5.0))
    assert fast.beats(dataclasses.replace(fast, costs=(-2.0, 6.0)))
    assert not fast.beats(dataclasses.replace(fast, costs=(-3.0, 6.0)))
    assert not fast.beats(fast)


def test_waves_are_equal_within_the_errors_of_their_values():
    one = Point(None, (1.0, 5.0), (0.1, 0.2), (0, 0))
    assert one.equals(dataclasses.replace(one, values=(1.15, 4.65)))
    assert not one.equals(dataclasses.replace(one, values=(1.25, 5.0)))
    assert not one.equals(dataclasses.replace(one, values=(1.0, 5.5)))


def test_a_stopped_search_goes_on_to_the_same_fronts(tmp_path, monkeypatch):
    whole = find_fronts(FAST_AND_QUIET, workers=2)
    looks = []

    def stop_after_a_while():
        looks.append(1)
        if len(looks) > 150:
            raise KeyboardInterrupt

    identity = FAST_AND_QUIET.identity()
    with Journal(tmp_path / 'journal', identity) as journal:
        with monkeypatch.context() as patch:
            patch.setattr(batch, 'heed_stop', stop_after_a_while)
            with pytest.raises(Stopped, match=r'after \d+ evaluations; the same command goes on'):
                find_fronts(FAST_AND_QUIET, journal=journal, workers=1)
        kept = len(journal.rows)
        assert 0 < kept < FAST_AND_QUIET.evaluations
        assert find_fronts(FAST_AND_QUIET, journal=journal, workers=1) == whole
        assert len(journal.rows) == FAST_AND_QUIET.evaluations > kept


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'second': Goal('speed')}, "second objective 'speed' is the first one too; take another"),
        ({'points': 2}, 'number of points 2 is not from 3 to 100'),
        ({'first': dataclasses.replace(FAST, seeds=2)}, 'number of seeds 2 is of no use to two'),
        (
            {'first': dataclasses.replace(FAST, budget=Budget(9, 3.0))},
            'seconds 3 s is of no use to two',
        ),
    ],
)
def test_fronts_that_are_none_are_refused(change, said):
    with pytest.raises(StickSlipError, match=said):
        dataclasses.replace(FAST_AND_QUIET, **change)
