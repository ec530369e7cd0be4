"""Deadlines are absolute: no drift, and what cannot be caught up is counted."""

import math
import time

import pytest

from stickslip_ros.ros.pacing import LAG_MAX_S, Pacer

PERIOD_S = 0.002
TICKS = 50
#: Reading the clock and returning; generous, as it bounds from the wrong side only.
EARLY_S = 1e-6


def spin_until(end_s: float) -> None:
    """Be busy until a moment."""
    while time.monotonic() < end_s:
        pass


def test_no_tick_begins_before_its_deadline_and_ticks_do_not_drift():
    pacer = Pacer(PERIOD_S, 1.0)
    begun_s = time.monotonic()
    pacer.start()
    ended_s = []
    for _ in range(TICKS):
        spin_until(time.monotonic() + 0.5 * PERIOD_S)  # work, which must not add up
        pacer.wait()
        ended_s.append(time.monotonic())
    deadlines_s = [begun_s + (tick + 1) * PERIOD_S for tick in range(TICKS)]
    report = pacer.report()
    if report.behind_s == 0.0:
        early = [at - due for at, due in zip(ended_s, deadlines_s, strict=True)]
        assert min(early) >= -EARLY_S
        # A relative pacer would be late by the work of all ticks: TICKS * PERIOD_S / 2.
        assert early[-1] <= report.lateness_max_s + PERIOD_S
    assert pacer._deadline_s == pytest.approx(
        deadlines_s[-1] + report.behind_s, rel=0.0, abs=PERIOD_S
    )


def test_a_short_delay_is_caught_up():
    pacer = Pacer(PERIOD_S, 1.0)
    begun_s = time.monotonic()
    pacer.start()
    spin_until(begun_s + 10.5 * PERIOD_S)
    for _ in range(10):
        pacer.wait()
    report = pacer.report()
    assert report.behind_s == 0.0
    assert report.overruns >= 8
    assert pacer._deadline_s == pytest.approx(begun_s + 10 * PERIOD_S, rel=0.0, abs=PERIOD_S)


def test_a_long_delay_moves_the_deadlines_and_is_counted():
    pacer = Pacer(PERIOD_S, 1.0)
    begun_s = time.monotonic()
    pacer.start()
    spin_until(begun_s + PERIOD_S + 1.5 * LAG_MAX_S)
    pacer.wait()
    report = pacer.report()
    assert report.behind_s >= 1.5 * LAG_MAX_S - PERIOD_S
    assert report.behind_s == report.lateness_max_s
    assert report.overruns == report.overruns_total == 1
    assert pacer._deadline_s >= begun_s + PERIOD_S + 1.5 * LAG_MAX_S - EARLY_S
    before_s = time.monotonic()
    pacer.wait()  # a full period later: the lag is forgotten, not hurried through
    assert time.monotonic() >= min(before_s, pacer._deadline_s)


def test_a_report_counts_since_the_last_one():
    pacer = Pacer(PERIOD_S, 1.0)
    for _ in range(5):
        pacer.wait()
    first = pacer.report()
    for _ in range(3):
        pacer.wait()
    second = pacer.report()
    assert (first.ticks, second.ticks) == (5, 3)
    assert second.overruns_total == first.overruns + second.overruns
    assert 0.0 <= first.lateness_mean_s <= first.lateness_max_s
    assert first.lateness_p99_s <= first.lateness_max_s


def test_the_real_time_factor_is_simulated_time_over_wall_clock_time():
    pacer = Pacer(PERIOD_S, 2.0)
    begun_s = time.monotonic()
    pacer.start()
    inner_s = time.monotonic()
    for _ in range(TICKS):
        pacer.wait()
    before_s = time.monotonic()
    factor = pacer.report().real_time_factor
    after_s = time.monotonic()
    simulated_s = TICKS * PERIOD_S
    assert simulated_s / (after_s - begun_s) <= factor <= simulated_s / (before_s - inner_s)
    assert factor <= 2.0 * (1.0 + EARLY_S / simulated_s)


def test_as_fast_as_possible_waits_for_nothing_and_is_never_late():
    pacer = Pacer(1.0, 0.0)
    for _ in range(1000):
        pacer.wait()
    report = pacer.report()
    assert report.ticks == 1000
    assert report.real_time_factor > 1000.0
    assert (report.overruns, report.overruns_total, report.behind_s) == (0, 0, 0.0)
    assert report.lateness_max_s == 0.0


def test_a_report_without_ticks_has_no_lateness():
    report = Pacer(PERIOD_S, 1.0).report()
    assert report.ticks == report.overruns == 0
    assert report.real_time_factor == 0.0
    assert math.isnan(report.lateness_mean_s)


def test_a_hold_is_no_lateness_and_does_not_count_as_time():
    pacer = Pacer(PERIOD_S, 1.0)
    pacer.wait()
    pacer.hold()
    held_s = time.monotonic()
    spin_until(held_s + 1.5 * LAG_MAX_S)
    pacer.hold()  # twice is as once
    pacer.resume()
    resumed_s = time.monotonic()
    assert pacer._deadline_s == pytest.approx(resumed_s, rel=0.0, abs=PERIOD_S)
    pacer.wait()
    report = pacer.report()
    assert report.ticks == 2
    assert report.real_time_factor > 2 * PERIOD_S / (1.5 * LAG_MAX_S)
    assert report.missing_s < 1.5 * LAG_MAX_S
    assert report.lateness_max_s < LAG_MAX_S


def test_a_report_in_the_middle_of_a_hold_ends_with_the_hold():
    pacer = Pacer(PERIOD_S, 1.0)
    pacer.hold()
    spin_until(time.monotonic() + 10 * PERIOD_S)
    assert pacer.report().missing_s < PERIOD_S
    spin_until(time.monotonic() + 10 * PERIOD_S)
    pacer.resume()
    assert pacer.report().missing_s < PERIOD_S


def test_what_is_missing_is_the_wanted_pace_less_the_ticks():
    pacer = Pacer(PERIOD_S, 3.0)
    begun_s = time.monotonic()
    pacer.start()
    spin_until(begun_s + 10 * PERIOD_S)
    report = pacer.report()
    assert report.missing_s >= 3.0 * 10 * PERIOD_S - EARLY_S
    assert Pacer(PERIOD_S, 0.0).report().missing_s == 0.0


def test_a_sleep_may_end_early_and_is_then_not_late():
    pacer = Pacer(1e6, 1.0)
    asked_s: list[float] = []
    pacer.wait(asked_s.append)
    assert asked_s[0] == pytest.approx(1e6, rel=1e-3)
    assert pacer.report().lateness_max_s == 0.0


def test_start_forgets_the_time_before_it():
    pacer = Pacer(PERIOD_S, 1.0)
    spin_until(time.monotonic() + 1.2 * LAG_MAX_S)
    pacer.start()
    begun_s = time.monotonic()
    pacer.wait()
    assert time.monotonic() >= begun_s
    assert pacer._deadline_s >= begun_s
