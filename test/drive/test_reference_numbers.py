# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The drive as a whole against reference numbers, symmetries and what a stage must not do."""

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.waveform import sawtooth

CELL_N_PER_M = 1e5
FULL_V, FULL_NM = 300.0, 160.0
VOLT_PER_NM = FULL_V / FULL_NM

FORCE_ERROR = 0.01
"""Of the generated forces, which are given to the millinewton."""
A0_ERROR_NM = 2.0
"""0-amplitudes are given to the nanometre, at a frequency of their own; the runner still rings
when the next fall comes, which moves them by a nanometre or two."""
DRIFT_M = 1e-12
"""Net motion per step that counts as none: a picometre."""

AMPLITUDES_NM = np.array([100.0, 120.0, 140.0, 160.0])


def _force_n(machine):
    machine.start(sawtooth(0.0, FULL_V, 1000.0, 200), [0.2 + 1e-4])
    return CELL_N_PER_M * machine.ramps[199, RAMP_MEAN]


@pytest.mark.parametrize(('preload_n', 'force_n'), [(0.1, 0.061), (0.5, 0.172), (1.0, 0.224)])
def test_the_generated_force_is_the_known_one(preload_n, force_n, drive):
    found_n = _force_n(drive(stand__preload=preload_n))
    assert found_n == pytest.approx(force_n, rel=FORCE_ERROR, abs=0.0)


def _step_length_nm(machine, amplitude_nm):
    wave = sawtooth(0.0, amplitude_nm * VOLT_PER_NM, 200.0, 120)
    machine.start(wave, [120 / 200.0 + 1e-4])
    ends_m = machine.ramps[:120, RAMP_END]
    return 1e9 * (ends_m[119] - ends_m[109]) / 10.0


@pytest.mark.parametrize(
    ('profile', 'damping', 'preload_n', 'zero_nm'),
    [
        ('rough', 0.0, 0.1, 26.0),
        ('rough', 0.0, 0.5, 66.0),
        ('rough', 0.0, 1.0, 95.0),
        ('smooth', 0.0, 0.1, 17.0),
        ('smooth', 0.0, 0.5, 53.0),
        ('smooth', 0.0, 1.0, 80.0),
        ('rough', 80.0, 0.1, 21.0),
        ('rough', 80.0, 0.5, 54.0),
        ('rough', 80.0, 1.0, 83.0),
    ],
)
def test_a_free_runner_steps_by_the_amplitude_less_the_zero_amplitude(
    profile, damping, preload_n, zero_nm, drive
):
    lengths_nm = [
        _step_length_nm(
            drive(
                contact__profile=profile,
                runner__damping=damping,
                stand__preload=preload_n,
                load_cell__contact='absent',
            ),
            amplitude_nm,
        )
        for amplitude_nm in AMPLITUDES_NM
    ]
    slope, offset_nm = np.polyfit(AMPLITUDES_NM, lengths_nm, 1)
    assert 0.99 <= slope <= 1.0
    assert -offset_nm / slope == pytest.approx(zero_nm, rel=0.0, abs=A0_ERROR_NM)


@pytest.mark.parametrize(('preload_n', 'amplitude_nm'), [(0.1, 20.0), (0.5, 55.0), (1.0, 80.0)])
def test_below_the_zero_amplitude_a_free_runner_goes_nowhere(preload_n, amplitude_nm, drive):
    machine = drive(stand__preload=preload_n, load_cell__contact='absent')
    machine.start(sawtooth(0.0, amplitude_nm * VOLT_PER_NM, 200.0, 200), [1.0 + 1e-4])
    ends_m = machine.ramps[:200, RAMP_END]
    assert abs(ends_m[199] - ends_m[99]) / 100.0 < DRIFT_M


def test_a_fall_as_slow_as_the_ramp_moves_nothing(drive):
    lengths_nm = [
        _step_length_nm(drive(load_cell__contact='absent', amplifier__slew_rate=slew), FULL_NM)
        for slew in (150e6, 0.5e6)
    ]
    assert lengths_nm[0] > 90.0
    assert abs(lengths_nm[1]) < 1e9 * DRIFT_M


def test_twice_the_mass_moves_alike_in_a_time_stretched_by_the_root_of_two(drive):
    stretch = np.sqrt(2.0)
    light = drive(load_cell__contact='absent')
    heavy = drive(
        load_cell__contact='absent',
        runner__mass=6e-3,
        sim__dt=light.plant.dt_s * stretch,
        amplifier__slew_rate=150e6 / stretch,
    )
    light.start(sawtooth(0.0, FULL_V, 1000.0, 10), [0.0105])
    heavy.start(sawtooth(0.0, FULL_V, 1000.0 / stretch, 10), [0.0105 * stretch])
    # The steps scale too, so that only rounding differs.
    np.testing.assert_allclose(heavy.ramps[:10], light.ramps[:10], rtol=1e-9, atol=1e-18)
