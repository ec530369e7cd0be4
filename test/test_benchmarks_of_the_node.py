"""What the benchmarks of the node compute from what they measure, and that rivals are fair."""

import os
import time

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from benchmarks.node.drift import drift_of
from benchmarks.node.lateness import STALLS, summary, windows_of, windows_of_diagnostics
from benchmarks.node.listener import Stamps
from benchmarks.node.process import cpu_clock_of
from benchmarks.node.soak import excess_of, growth_of
from benchmarks.node.traffic import BLOCK_NS, TRACE_BLOCKS, TYPES, Fresh, Objects
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.interface.feed import Feed
from stickslip_ros.interface.topics import READINGS
from stickslip_ros.parameters import Parameters

RATE_HZ = 50e3
ROUNDING = 1e-9
SEEDS = range(200)
COVERED = 0.9
"""Two standard errors cover 95 % of straight lines in noise; of 200 a few fewer by chance."""
DRIFT_S, DELAY_S = 1e-4, 1e-5
END_SHARES = 2 * 100 / 6000
"""The least delay may lie anywhere in the hundred windows of six thousand at either end."""
SPREAD_ERROR = 0.3
"""Three standard errors of the standard deviation of 200 exponential delays."""


class Wire:
    """A publisher that keeps what it is given."""

    def __init__(self):
        self.sent = []

    def publish(self, message):
        self.sent.append(serialize_message(message))


class Switchboard:
    """As much of a node as a bare loop needs to publish."""

    def __init__(self):
        self.wires = {}

    def create_publisher(self, _kind, name, _profile):
        return self.wires.setdefault(name, Wire())


@pytest.mark.parametrize('kind', [Objects, Fresh])
def test_a_bare_loop_sends_as_many_bytes_as_the_node_in_as_many_messages(kind):
    parameters = Parameters().updated({'trace.sample_rate': RATE_HZ})
    bench, feed = Bench(parameters), Feed(parameters)
    ours: dict[str, list[int]] = {}
    board = Switchboard()
    bare = kind(board, RATE_HZ, tuple(TYPES))
    for tick in range(1, 1 + TRACE_BLOCKS):
        bare.send(tick)
        for packed in feed.pack(bench.update(tick * BLOCK_NS, [])):
            ours.setdefault(packed.key, []).append(len(packed.data))
    theirs = {name: list(map(len, wire.sent)) for name, wire in board.wires.items()}
    assert theirs == {key: ours[key] for key in theirs}
    assert set(ours) - set(theirs) <= {'status'}


def test_a_bare_loop_uses_the_types_of_the_node():
    types = {topic.key: topic.type_name for topic in READINGS}
    for name, kind in TYPES.items():
        assert types[name].split('/')[-1] == kind.__name__


def test_lateness_is_summed_up_by_the_second():
    late_s = [1e-6] * 1000 + [3e-6] * 999 + [2e-3]
    windows = windows_of(late_s, 1e-3)
    assert [window['ticks'] for window in windows] == [1000, 1000]
    whole = summary(windows)
    assert whole['ticks'] == 2000
    assert whole['overruns'] == 1
    assert whole['mean_us'] == pytest.approx((1000 * 1.0 + 999 * 3.0 + 2000.0) / 2000)
    assert whole['p99_us'] == pytest.approx(2.0)
    assert whole['max_us'] == pytest.approx(2000.0)


def test_no_tick_is_left_out_and_nothing_is_no_window():
    assert [window['ticks'] for window in windows_of([1e-6] * 2010, 1e-3)] == [1005, 1005]
    assert [window['ticks'] for window in windows_of([1e-6] * 7, 1e-3)] == [7]
    assert windows_of([], 1e-3) == []
    assert summary([])['ticks'] == 0


def test_reports_without_ticks_do_not_count():
    told = {'ticks': '10', 'overruns': '2', 'lateness_mean_us': '1.5'}
    told |= {'lateness_p99_us': '3.0', 'lateness_max_us': '4.0'}
    told |= {f'overruns_{name}': '0.5' for name in STALLS}
    assert windows_of_diagnostics([told, told | {'ticks': '0', 'lateness_mean_us': 'nan'}]) == [
        {'ticks': 10, 'overruns': 2, 'mean_us': 1.5, 'p99_us': 3.0, 'max_us': 4.0}
        | dict.fromkeys(STALLS, 0.5)
    ]


def test_the_drift_of_a_clock_is_found_under_random_delays():
    random = np.random.default_rng(1)
    delays_s = 5.0 + np.linspace(0.0, DRIFT_S, 6000) + random.exponential(DELAY_S, 6000)
    drift_s, spread_s = drift_of(list(delays_s))
    assert drift_s == pytest.approx(DRIFT_S, rel=END_SHARES)
    assert spread_s == pytest.approx(DELAY_S, rel=SPREAD_ERROR)


def test_a_straight_line_grows_by_its_slope_without_error():
    slope, error = growth_of([1e8 + 250.0 * i for i in range(50)], 0.5)
    assert slope == pytest.approx(500.0, rel=ROUNDING)
    assert error == pytest.approx(0.0, abs=ROUNDING)
    assert growth_of([7.0] * 20, 1.0) == pytest.approx((0.0, 0.0), abs=ROUNDING)


@pytest.mark.parametrize('memory', [0.0, 0.6], ids=['white noise', 'noise with a memory'])
def test_two_standard_errors_hold_the_true_growth_as_often_as_they_should(memory):
    held = 0
    for seed in SEEDS:
        noise = np.random.default_rng(seed).normal(size=100)
        for i in range(1, len(noise)):
            noise[i] += memory * noise[i - 1]
        slope, error = growth_of(list(3.0 * np.arange(100) + noise), 1.0)
        held += abs(slope - 3.0) <= 2.0 * error
    assert held >= COVERED * len(SEEDS)


def test_overruns_are_compared_minute_by_minute():
    def windows(*minutes):
        return [{'overruns': each / 60.0} for each in minutes for _ in range(60)]

    more, error = excess_of(windows(130.0, 250.0, 70.0), windows(100.0, 190.0, 70.0, 999.0))
    assert more == pytest.approx(30.0, rel=ROUNDING)
    assert error == pytest.approx(np.std([30.0, 60.0, 0.0], ddof=1) / np.sqrt(3.0), rel=ROUNDING)
    assert np.isnan(excess_of(windows(1.0), windows(1.0))[1])


def test_stamps_that_are_missing_are_counted_and_delays_are_the_least():
    stamps = Stamps(BLOCK_NS)
    for tick, arrival_s in ((1, 10.0), (2, 10.0015), (5, 10.0045), (6, 10.2)):
        stamps.add(tick * BLOCK_NS, arrival_s)
    assert stamps.messages == 4
    assert stamps.missing == 2
    assert len(stamps.minima_s) == 2
    assert stamps.minima_s[0] == pytest.approx(10.0)


def test_the_processor_clock_of_this_process_is_its_own():
    before_s = time.process_time()
    between_s = time.clock_gettime(cpu_clock_of(os.getpid()))
    assert before_s <= between_s <= time.process_time()
