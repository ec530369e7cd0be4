# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Deadlines are absolute, what cannot be caught up is counted, and threads wake up in time."""

import json
import math
import os
import sys
import time
from types import SimpleNamespace
from typing import Any

import pytest
from processes import run_process

from stickslip_ros.runtime import pacing
from stickslip_ros.runtime.pacing import KNOWS_SLICES, SLACK_S, SLICE_S, SWITCH_S, Pacer

PERIOD_S = 0.002
TICKS = 50
LAG_MAX_S = 0.1
ROUNDING_S = 1e-9
TO_THE_NANOSECOND: Any = {'rel': 0.0, 'abs': ROUNDING_S}


class Clock:
    """Time that passes only when it is told to, so that no busy machine can interfere."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.late_s = 0.0
        """How much longer than asked for every sleep lasts."""

    def work(self, seconds: float) -> None:
        """Let time pass."""
        self.now_s += seconds

    def sleep(self, seconds: float) -> None:
        """Let a sleep pass."""
        self.now_s += seconds + self.late_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    faked = Clock()
    module = SimpleNamespace(monotonic=lambda: faked.now_s, sleep=faked.sleep)
    monkeypatch.setattr(pacing, 'time', module)
    return faked


def test_ticks_do_not_drift_whatever_the_work_and_however_long_the_sleeps(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    begun_s, clock.late_s = clock.now_s, 0.1 * PERIOD_S
    for tick in range(TICKS):
        clock.work(0.5 * PERIOD_S)
        pacer.wait(clock.sleep)
        assert clock.now_s == pytest.approx(
            begun_s + (tick + 1) * PERIOD_S + clock.late_s, **TO_THE_NANOSECOND
        )
    report = pacer.report()
    assert report.lateness_mean_s == pytest.approx(clock.late_s, **TO_THE_NANOSECOND)
    assert report.lateness_p99_s == pytest.approx(clock.late_s, **TO_THE_NANOSECOND)
    assert (report.overruns, report.behind_s) == (0, 0.0)


def test_on_the_real_clock_no_tick_begins_before_its_deadline():
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    before_s = time.monotonic()
    pacer.start()
    for tick in range(TICKS):
        pacer.wait()
        assert time.monotonic() >= before_s + (tick + 1) * PERIOD_S
    assert pacer.report().ticks == TICKS


def test_a_short_delay_is_caught_up(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    begun_s = clock.now_s
    clock.work(10.5 * PERIOD_S)
    for _ in range(11):
        pacer.wait(clock.sleep)
    report = pacer.report()
    assert report.behind_s == 0.0
    assert report.overruns == 9  # the tenth was late by half a period
    assert report.lateness_max_s == pytest.approx(9.5 * PERIOD_S, **TO_THE_NANOSECOND)
    assert clock.now_s == pytest.approx(begun_s + 11 * PERIOD_S, **TO_THE_NANOSECOND)


def test_a_lag_above_the_largest_moves_the_deadlines_and_is_counted(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    clock.work(PERIOD_S + 1.5 * LAG_MAX_S)
    resumed_s = clock.now_s
    pacer.wait(clock.sleep)
    report = pacer.report()
    assert report.behind_s == pytest.approx(1.5 * LAG_MAX_S, **TO_THE_NANOSECOND)
    assert report.behind_s == report.given_up_s == report.lateness_max_s
    assert report.overruns == report.overruns_total == 1
    pacer.wait(clock.sleep)  # a full period later: the lag is forgotten, not hurried through
    assert clock.now_s == pytest.approx(resumed_s + PERIOD_S, **TO_THE_NANOSECOND)


def test_a_lag_is_told_while_it_is_made_up(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    clock.work(PERIOD_S + 0.9 * LAG_MAX_S)
    told_s = [pacer.report().lag_s]
    for _ in range(3):
        pacer.wait(clock.sleep)
        report = pacer.report()
        told_s.append(report.lag_s)
    assert told_s == pytest.approx(
        [0.9 * LAG_MAX_S - max(0, tick) * PERIOD_S for tick in range(4)], **TO_THE_NANOSECOND
    )
    assert (report.given_up_s, report.behind_s) == (0.0, 0.0)


def test_a_lag_is_still_made_up_after_a_hold(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    begun_s = clock.now_s
    clock.work(5.0 * PERIOD_S)
    pacer.wait(clock.sleep)
    pacer.hold()
    clock.work(10.0)
    pacer.resume()
    for _ in range(6):
        pacer.wait(clock.sleep)
    assert clock.now_s == pytest.approx(begun_s + 10.0 + 7 * PERIOD_S, **TO_THE_NANOSECOND)


def test_a_slow_pace_may_lag_by_two_ticks(clock: Clock):
    pacer = Pacer(PERIOD_S, PERIOD_S / LAG_MAX_S, LAG_MAX_S)
    for lag_periods, behind_periods in ((1.9, 0.0), (2.1, 2.1)):
        pacer.start()
        clock.work((1.0 + lag_periods) * LAG_MAX_S)
        pacer.wait(clock.sleep)
        behind_s = pacer.report().behind_s
        assert behind_s == pytest.approx(behind_periods * LAG_MAX_S, **TO_THE_NANOSECOND)


def test_a_report_counts_since_the_last_one(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    for _ in range(5):
        pacer.wait(clock.sleep)
    first = pacer.report()
    clock.work(3.5 * PERIOD_S)
    for _ in range(3):
        pacer.wait(clock.sleep)
    second = pacer.report()
    assert (first.ticks, second.ticks) == (5, 3)
    assert (first.overruns, second.overruns, second.overruns_total) == (0, 2, 2)
    assert second.lateness_mean_s == pytest.approx(1.5 * PERIOD_S, **TO_THE_NANOSECOND)


@pytest.mark.parametrize('wanted', [0.5, 1.0, 2.0])
def test_the_real_time_factor_is_simulated_time_over_wall_clock_time(clock: Clock, wanted: float):
    pacer = Pacer(PERIOD_S, wanted, LAG_MAX_S)
    for _ in range(TICKS):
        pacer.wait(clock.sleep)
    clock.work(TICKS * PERIOD_S / wanted)  # as long again, without a tick
    report = pacer.report()
    assert report.real_time_factor == pytest.approx(0.5 * wanted)
    assert report.missing_s == pytest.approx(TICKS * PERIOD_S)


def test_as_fast_as_possible_waits_for_nothing_and_is_never_late(clock: Clock):
    pacer = Pacer(1.0, 0.0, LAG_MAX_S)
    begun_s = clock.now_s
    for _ in range(1000):
        pacer.wait(clock.sleep)
    assert clock.now_s == begun_s
    clock.work(0.5)
    report = pacer.report()
    assert (report.ticks, report.real_time_factor) == (1000, 2000.0)
    assert (report.overruns, report.overruns_total, report.behind_s) == (0, 0, 0.0)
    assert (report.lateness_max_s, report.missing_s) == (0.0, 0.0)


def test_a_report_without_ticks_has_no_lateness(clock: Clock):
    report = Pacer(PERIOD_S, 1.0, LAG_MAX_S).report()
    assert report.ticks == report.overruns == 0
    assert report.real_time_factor == 0.0
    assert math.isnan(report.lateness_mean_s)


def test_a_hold_is_no_lateness_and_does_not_count_as_time(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    pacer.wait(clock.sleep)
    pacer.hold()
    clock.work(LAG_MAX_S)
    pacer.hold()  # twice is as once
    clock.work(0.5 * LAG_MAX_S)
    pacer.resume()
    resumed_s = clock.now_s
    pacer.wait(clock.sleep)
    assert clock.now_s == pytest.approx(resumed_s + PERIOD_S, **TO_THE_NANOSECOND)
    report = pacer.report()
    assert report.ticks == 2
    assert report.real_time_factor == pytest.approx(1.0)
    assert report.missing_s == pytest.approx(0.0, **TO_THE_NANOSECOND)
    assert report.lateness_max_s == pytest.approx(0.0, **TO_THE_NANOSECOND)


def test_a_report_in_the_middle_of_a_hold_ends_with_the_hold(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    pacer.hold()
    clock.work(10 * PERIOD_S)
    report = pacer.report()
    assert (report.missing_s, report.lag_s) == pytest.approx((0.0, 0.0), **TO_THE_NANOSECOND)
    clock.work(10 * PERIOD_S)
    pacer.resume()
    pacer.wait(clock.sleep)
    report = pacer.report()
    assert report.missing_s == pytest.approx(0.0, **TO_THE_NANOSECOND)
    assert report.lateness_max_s == pytest.approx(0.0, **TO_THE_NANOSECOND)


def test_what_is_missing_is_the_wanted_pace_less_the_ticks(clock: Clock):
    pacer, fast = Pacer(PERIOD_S, 3.0, LAG_MAX_S), Pacer(PERIOD_S, 0.0, LAG_MAX_S)
    clock.work(10 * PERIOD_S)
    assert pacer.report().missing_s == pytest.approx(30 * PERIOD_S)
    assert fast.report().missing_s == 0.0


def test_a_sleep_may_end_early_and_is_then_not_late(clock: Clock):
    pacer = Pacer(1e6, 1.0, LAG_MAX_S)
    asked_s: list[float] = []
    pacer.wait(asked_s.append)
    assert asked_s == [1e6]
    assert pacer.report().lateness_max_s == 0.0


def test_start_forgets_the_time_before_it(clock: Clock):
    pacer = Pacer(PERIOD_S, 1.0, LAG_MAX_S)
    clock.work(1.2 * LAG_MAX_S)
    pacer.start()
    begun_s = clock.now_s
    pacer.wait(clock.sleep)
    assert clock.now_s == pytest.approx(begun_s + PERIOD_S, **TO_THE_NANOSECOND)
    assert pacer.report().behind_s == 0.0


REPORT = """
import ctypes, json, os, sys, threading
from stickslip_ros.runtime.pacing import scheduling, wake_in_time
{before}
wake_in_time()
told = []
def tell():
    slack_s = ctypes.CDLL(None).prctl(30) * 1e-9  # PR_GET_TIMERSLACK
    slice_ns = getattr(scheduling(0), 'runtime_ns', 0)
    told.append([sys.getswitchinterval(), slack_s, slice_ns * 1e-9, os.sched_getscheduler(0)])
tell()
thread = threading.Thread(target=tell)
thread.start()
thread.join()
print(json.dumps(told))
"""

CONFIGURE_THRICE = """
import gc, json, rclpy
from rclpy.parameter import Parameter
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.ros.executable import GarbageFreezer
rclpy.init()
node = StickSlipDrive(parameter_overrides=[Parameter('autostart', value=False)])
node.add_managed_entity(GarbageFreezer())
told = []
for _ in range(3):
    node.trigger_configure()
    told.append([gc.get_freeze_count(), len(gc.get_objects())])
    node.trigger_cleanup()
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps(told))
"""


def reported_by(program: str) -> Any:
    """Run a program in a process of its own: what it asks for holds for the whole process."""
    done = run_process([sys.executable, '-c', program], check=True)
    return json.loads(done.stdout.splitlines()[-1])


def test_every_thread_wakes_up_in_time_and_takes_turns():
    here, new = reported_by(REPORT.format(before=''))
    assert here == new
    interval_s, slack_s, own_slice_s, policy = here
    assert interval_s == pytest.approx(SWITCH_S)
    assert slack_s == pytest.approx(SLACK_S)
    assert policy == os.SCHED_OTHER
    if KNOWS_SLICES:
        assert own_slice_s == pytest.approx(SLICE_S)


def test_a_policy_that_was_chosen_stays():
    choose = 'os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))'
    for _, slack_s, own_slice_s, policy in reported_by(REPORT.format(before=choose)):
        assert slack_s == pytest.approx(SLACK_S)
        assert own_slice_s != pytest.approx(SLICE_S)
        assert policy == os.SCHED_BATCH


def test_what_a_configured_drive_consists_of_is_kept_from_collections():
    told = reported_by(CONFIGURE_THRICE)
    for kept, collected in told:
        assert kept > 50_000
        assert collected < 0.02 * kept
    # The second configuration still makes things that last; none leaves anything behind for ever.
    assert told[-1][0] < 1.002 * told[1][0]
