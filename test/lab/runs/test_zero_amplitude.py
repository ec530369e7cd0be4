# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The 0-amplitude, against the reference numbers of a free runner at 200 Hz."""

import dataclasses
from functools import cache

import pytest

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.runs.zero_amplitude import STEP_MIN_M, zero_amplitude

zero_amplitude = cache(zero_amplitude)  # several tests look at the same

REFERENCE_M = 0.5e-9
"""References are given to the nanometre."""
DIRECT_M = 0.3e-9
"""The first net step is larger by its threshold; the line bends by as much."""
PRELOADS_N = (0.1, 0.5, 1.0)
CASES = [
    (profile, damping, preload_n, zero_nm * 1e-9)
    for profile, damping, zeros_nm in (
        ('rough', 0.0, (26, 66, 95)),
        ('smooth', 0.0, (17, 53, 80)),
        ('rough', 80.0, (21, 54, 83)),
    )
    for preload_n, zero_nm in zip(PRELOADS_N, zeros_nm, strict=True)
]


@pytest.mark.parametrize(('profile', 'damping', 'preload_n', 'zero_m'), CASES)
def test_extrapolation_gives_the_reference(profile, damping, preload_n, zero_m, stand):
    there = stand.updated(
        {'contact.profile': profile, 'runner.damping': damping, 'stand.preload': preload_n}
    )
    found = zero_amplitude(there, 200.0)
    assert found.zero_amplitude_m == pytest.approx(zero_m, rel=0.0, abs=REFERENCE_M)
    assert 0.985 < found.slope < 1.005  # 0.99 to 1.00, to two digits
    assert found.zero_amplitude_direct_m == pytest.approx(
        found.zero_amplitude_m + STEP_MIN_M, rel=0.0, abs=DIRECT_M
    )
    assert found.fit_rms_m < 0.01e-9
    assert (found.preload_n, found.frequency_hz, found.steps) == (preload_n, 200.0, 120)


def test_the_amplitudes_of_the_line_are_stated(stand):
    found = zero_amplitude(stand, 200.0)
    half_m = 0.5 * (found.zero_amplitude_direct_m + 160e-9)
    assert found.fit_from_m == pytest.approx(half_m, rel=1e-12, abs=0.0)
    assert found.fit_to_m == pytest.approx(160e-9, rel=1e-12, abs=0.0)
    assert f'at 17 amplitudes, {found.fit_from_m:.4g} to 1.6e-07 m' in found.method
    assert 'net step above 1e-10 m' in found.method


@pytest.mark.parametrize(
    ('profile', 'limit_m'),
    [('rough', 66.1653e-9), ('smooth', 42.8031e-9), ('rough_line', 88.4060e-9)],
)
def test_the_presliding_of_a_lower_contact_stands_beside_it(profile, limit_m, stand):
    found = zero_amplitude(stand.updated({'contact.profile': profile}), 200.0, steps=10)
    assert found.max_presliding_lower_m == pytest.approx(limit_m, rel=1e-4, abs=0.0)


def test_backwards_it_is_the_same_but_for_rounding(stand):
    forwards, backwards = (zero_amplitude(stand, sign * 200.0) for sign in (1.0, -1.0))
    assert backwards.zero_amplitude_m == pytest.approx(
        forwards.zero_amplitude_m, rel=1e-6, abs=0.0
    )


def test_the_number_of_workers_changes_nothing_and_progress_is_told(stand):
    told = []
    one = zero_amplitude(stand, 200.0, workers=1, progress=lambda *both: told.append(both))
    assert dataclasses.asdict(one) == dataclasses.asdict(zero_amplitude(stand, 200.0, workers=2))
    assert told[0] == (0, 59)
    assert told[-1] == (59, 59)
    assert told == sorted(told)


@pytest.mark.parametrize(
    ('values', 'frequency_hz', 'steps', 'message'),
    [
        ({'stand.preload': 5.0}, 200.0, 120, 'stroke 1.6e-07 m is too small for a step: none'),
        ({}, 0.0, 120, 'frequency 0 Hz is not a frequency'),
        (
            {},
            200.0,
            0,
            'steps 0 is below the minimum 10 (the first steps are irregular); raise it',
        ),
    ],
)
def test_what_has_no_zero_amplitude_is_refused(values, frequency_hz, steps, message, stand):
    with pytest.raises(OutOfRange) as caught:
        zero_amplitude(stand.updated(values), frequency_hz, steps=steps)
    assert message in str(caught.value)
