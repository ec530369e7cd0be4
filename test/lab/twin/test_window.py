# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Windows follow the stamps of a rig, whatever comes late, twice, or not at all."""

import numpy as np
import pytest

from stickslip_ros.lab.twin.window import RigClock, Window, Windows

NS = 1_000_000_000
NAMES = ('voltage_v', 'position_m')


def fed(windows: Windows, stamps_ns: np.ndarray) -> list[Window]:
    """Give what samples of both quantities complete, one after the other."""
    found = list[Window]()
    for stamp_ns in stamps_ns.tolist():
        for name in NAMES:
            windows.add(name, (stamp_ns,), (stamp_ns * 1e-9,))
        found += windows.complete()
    return found


def even(start_s: float, end_s: float) -> np.ndarray:
    return np.arange(round(1e3 * start_s), round(1e3 * end_s)) * (NS // 1000)


def test_windows_stand_at_multiples_of_their_length_and_have_a_lead():
    found = fed(Windows(NAMES, 0.2, 0.05), even(7.13, 8.0))
    assert [each.start_ns for each in found] == [7_200_000_000, 7_400_000_000, 7_600_000_000]
    time_s, values = found[1].samples['position_m']
    np.testing.assert_allclose(time_s, np.arange(-50, 200) * 1e-3, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(values, 7.4 + time_s, rtol=0.0, atol=1e-9)


def test_messages_in_another_order_and_twice_give_the_same_windows():
    stamps_ns = even(0.0, 1.0)
    shuffled = stamps_ns.reshape(-1, 5)[:, ::-1].ravel()
    windows = Windows(NAMES, 0.2, 0.05)
    found = fed(windows, np.repeat(shuffled, 2))
    plain = fed(Windows(NAMES, 0.2, 0.05), stamps_ns)
    assert [each.start_ns for each in found][:3] == [each.start_ns for each in plain][:3]
    for one, other in zip(found[1:3], plain[1:3], strict=True):
        np.testing.assert_array_equal(
            one.samples['position_m'][1][:-5], other.samples['position_m'][1][:-5]
        )
    assert windows.doubled > 0
    assert windows.reordered > 0


@pytest.mark.parametrize('apart_s', [1.5, 5.0, -5.0])
def test_clocks_that_are_apart_are_told_and_the_first_to_begin_anew_has_windows(apart_s: float):
    windows = Windows(NAMES, 0.2, 0.05)
    found, told = list[Window](), list[str]()
    for stamp_ns in even(10.0, 12.0).tolist():
        told.append(windows.add('voltage_v', (stamp_ns,), (0.0,)))
        told.append(windows.add('position_m', (stamp_ns + round(apart_s * NS),), (0.0,)))
        found += windows.complete()
    assert len(found) > 5
    assert windows.pauses + windows.restarts == 1
    said = f'voltage_v is {-apart_s:+.2g} s off the other stamps; synchronise the clocks'
    assert told == ['', '', *[said, ''] * 1999]
    both = [*fed(windows, even(30.0, 31.0)), *fed(windows, even(2.0, 3.0))]
    assert {len(time_s) for each in both for time_s, _ in each.samples.values()} == {250}


def test_a_window_waits_for_a_quantity_that_lags_and_then_goes_without():
    windows = Windows(NAMES, 0.2, 0.05)
    for stamp_ns in even(0.0, 0.5).tolist():
        windows.add('voltage_v', (stamp_ns,), (0.0,))
        if stamp_ns < 0.449 * NS:
            assert list(windows.complete()) == []
    [window] = windows.complete()
    assert len(window.samples['position_m'][0]) == 0
    windows.add('position_m', (NS // 10,), (0.0,))
    assert windows.late == 1


def test_a_pause_and_a_clock_that_was_set_back_begin_anew():
    windows = Windows(NAMES, 0.2, 0.05)
    found = fed(windows, np.concatenate((even(100.0, 101.0), even(106.0, 107.0), even(0.0, 1.0))))
    starts_s = [each.start_ns / NS for each in found]
    np.testing.assert_allclose(starts_s, [100.2, 100.4, 100.6, 106.2, 106.4, 106.6, 0.2, 0.4, 0.6])
    assert (windows.pauses, windows.restarts) == (1, 1)
    assert all(len(each.samples['position_m'][0]) == 250 for each in found)


@pytest.mark.parametrize('apart', [0.0, 5e-5, -5e-5])
def test_a_message_without_a_stamp_is_told_in_the_clock_of_the_rig(apart: float):
    rng, clock = np.random.default_rng(1), RigClock()
    began_ns, took_s = 1_800_000_000 * NS, 1e-4 + rng.exponential(2e-3, 20_000)
    for number, late_s in enumerate(took_s):  # with a stamp and without one, in turn, for a minute
        true_s = 7.0 + 3e-3 * number
        sent_ns = began_ns + round((true_s * (1.0 + apart) + late_s) * NS)
        if number % 2:
            clock.learn(round(true_s * NS), sent_ns)
        elif number > 1000:
            assert clock.stamp_of(sent_ns) / NS - true_s == pytest.approx(
                late_s, rel=0.0, abs=1e-3
            )
    clock.learn(2 * NS, sent_ns)  # the rig has begun anew
    assert clock.stamp_of(sent_ns + NS // 100) == pytest.approx(2.01 * NS, rel=0.0, abs=1e3)


def test_a_window_that_ends_before_a_pause_is_not_lost_where_both_come_at_once():
    windows, found = Windows(NAMES, 0.2, 0.05), list[Window]()
    for start_ns in (7 * NS, 17 * NS):
        stamps_ns = (start_ns + even(0.0, 0.5)).tolist()
        for name in NAMES:
            windows.add(name, stamps_ns, stamps_ns)
        found += windows.complete()
    assert [each.start_ns / NS for each in found] == [7.2, 17.2]


@pytest.mark.parametrize(
    ('stamps_ns', 'why'),
    [
        ([], 'has no samples'),
        ([0, 10**6, 3600 * NS], 'a length of 3600 s, above 2 s'),
        ([0, 10**6, 600_000_000], 'a gap of 0.599 s, above 0.5 s'),
        ([0, 10**6, 2**63 - 1], 'do not rise from 0 to 2147483647 s'),
        ([-NS], 'stamps of -1 to -1 s do not rise from 0'),
        ([2, 1], 'do not rise'),
    ],
)
def test_a_block_of_odd_stamps_is_refused_and_changes_nothing(stamps_ns: list[int], why: str):
    windows, plain = Windows(NAMES, 0.2, 0.05), fed(Windows(NAMES, 0.2, 0.05), even(0.0, 1.0))
    found = list[Window]()
    for stamp_ns in even(0.0, 1.0).tolist():
        for name in NAMES:
            assert why in windows.add(name, stamps_ns, [0.0] * len(stamps_ns))
            assert windows.add(name, (stamp_ns,), (0.0,)) == ''
        found += windows.complete()
    assert [each.start_ns for each in found] == [each.start_ns for each in plain]
    assert 'foot_position_m is not expected' in windows.add('foot_position_m', [1], [1.0])


def test_stamps_that_stand_still_keep_no_samples_for_ever(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr('stickslip_ros.lab.twin.window._KEPT_MAX', 1000)
    windows = Windows(NAMES[:1], 0.2, 0.05)
    for _ in range(5000):
        assert windows.add(NAMES[0], (7 * NS,), (0.0,)) == ''
    assert windows.doubled == 4999
    why = [windows.add(NAMES[0], (7 * NS + each % 2,), (0.0,)) for each in range(5000)]
    assert 'more than 1000 samples before the end of a window' in why[-2]
    assert len(windows._stamps[NAMES[0]]) == 1000
    for stamp_ns in even(7.001, 7.7).tolist():
        windows.add(NAMES[0], (stamp_ns,), (0.0,))
        found = list(windows.complete())
        if found:
            break
    assert found[0].start_ns == 7_200_000_000


def test_numbers_that_are_not_finite_are_left_out_and_counted():
    windows, stamps_ns = Windows(NAMES, 0.2, 0.05), even(0.0, 0.5).tolist()
    for name, odd in zip(NAMES, (np.nan, np.inf), strict=True):
        windows.add(name, stamps_ns, [0.0, odd] * (len(stamps_ns) // 2))
        assert windows.add(name, stamps_ns[-1:], [odd]) == ''
    [window] = windows.complete()
    assert windows.not_finite == len(stamps_ns) + 2
    assert [len(each) for each, _ in window.samples.values()] == [125, 125]
