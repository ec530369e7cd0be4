# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Steps meet the corners of the voltage: how a caller cuts time does not matter."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.advance import (
    RAMP_END,
    RAMP_MEAN,
    RAMP_START,
)
from stickslip_ros.drive.long_step import SLEW_REFINEMENT
from stickslip_ros.drive.waveform import sawtooth

FREQUENCY_HZ = 333.0
CYCLES = 12
WAVE = sawtooth(0.0, 300.0, FREQUENCY_HZ, CYCLES)
PERIOD_S = WAVE.period_s
FALL_S = 300.0 / (150e6 + 300.0 * FREQUENCY_HZ)

SAME_STEPS = 1e-9
"""Relative; cuts between two steps change their lengths by rounding only."""
OTHER_STEPS = 2e-4
"""Relative; a cut within a step makes two of it, and 5e-6 s is not infinitely short."""


def _cuts_between_steps(dt_s: float) -> list[float]:
    """Return pieces of time that end where a step of the uncut run ends, never at a fall's end."""
    first = PERIOD_S / math.ceil(PERIOD_S / dt_s)
    pieces = [7 * first, PERIOD_S - 7 * first]
    fall = FALL_S / math.ceil(FALL_S / (dt_s / SLEW_REFINEMENT))
    rise = (PERIOD_S - FALL_S) / math.ceil((PERIOD_S - FALL_S) / dt_s)
    for cycle in range(1, CYCLES):
        steps = 50 * cycle
        pieces += [3 * fall, FALL_S - 3 * fall + steps * rise]
        pieces += [PERIOD_S - FALL_S - steps * rise]
    return pieces


def _random_pieces(seed: int, count: int = 200) -> np.ndarray:
    end_s = CYCLES * PERIOD_S
    cuts_s = np.sort(np.random.default_rng(seed).uniform(0.0, end_s, count))
    return np.diff(np.concatenate(([0.0], cuts_s, [end_s])))


@pytest.fixture(scope='module')
def uncut(drive):
    return drive().start(WAVE, [CYCLES * PERIOD_S])


def test_cuts_between_short_steps_leave_the_motion_as_it_is(drive):
    # Coulomb's law takes short steps of equal length.
    uncut, cut = drive(contact__law='coulomb'), drive(contact__law='coulomb')
    uncut.start(WAVE, [CYCLES * PERIOD_S])
    cut.start(WAVE, _cuts_between_steps(uncut.plant.dt_s))
    assert cut.state.clock.cycle == uncut.state.clock.cycle == CYCLES
    assert cut.state.position_m == pytest.approx(uncut.state.position_m, rel=SAME_STEPS, abs=0.0)
    np.testing.assert_allclose(cut.ramps[:CYCLES], uncut.ramps[:CYCLES], rtol=SAME_STEPS)
    assert cut.ledger.contact_lost_j == pytest.approx(
        uncut.ledger.contact_lost_j, rel=SAME_STEPS, abs=0.0
    )


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_cuts_anywhere_leave_the_motion_within_the_error_of_its_steps(seed, uncut, drive):
    cut = drive().start(WAVE, _random_pieces(seed))
    assert cut.state.clock.cycle == CYCLES
    assert abs(cut.state.voltage_v - uncut.state.voltage_v) < 1e-9
    np.testing.assert_allclose(cut.ramps[:CYCLES], uncut.ramps[:CYCLES], rtol=OTHER_STEPS)


@pytest.mark.parametrize('ulps', [-1000, -10, -1, 0, 1, 10, 1000])
def test_a_cut_at_the_very_end_of_a_fall_leaves_the_log_of_ramps_as_it_is(ulps, uncut, drive):
    end_s = FALL_S * (1.0 + ulps * 2.0**-52)
    cut = drive().start(WAVE, [PERIOD_S] + [end_s, PERIOD_S - end_s] * (CYCLES - 1))
    np.testing.assert_allclose(
        cut.ramps[:CYCLES, RAMP_START], uncut.ramps[:CYCLES, RAMP_START], rtol=SAME_STEPS
    )


def test_the_log_of_ramps_tells_start_mean_and_end(drive):
    machine, samples = drive().start(WAVE, ()), 2000
    positions_m = [machine.state.position_m]
    for _ in range(2 * samples):
        machine.run(WAVE, [PERIOD_S / samples])
        positions_m.append(machine.state.position_m)
    machine.run(WAVE, [1e-9])
    second = np.array(positions_m[samples:])
    assert machine.ramps[0, RAMP_START] == 0.0
    assert machine.ramps[0, RAMP_END] == pytest.approx(positions_m[samples], rel=1e-6, abs=0.0)
    assert machine.ramps[1, RAMP_END] == pytest.approx(positions_m[-1], rel=1e-6, abs=0.0)
    mean_m = np.mean(0.5 * (second[1:] + second[:-1]))
    assert machine.ramps[1, RAMP_MEAN] == pytest.approx(mean_m, rel=1e-4, abs=0.0)
    # The fall ends between the second and the third sample of its ramp.
    assert min(second[1:3]) <= machine.ramps[1, RAMP_START] <= max(second[1:3])


def test_a_hundred_thousand_ramps_do_not_blur_time(drive):
    machine = drive(sim__dt=1e-5, load_cell__contact='absent', ramps=7)
    frequency_hz, ramps = 20e3 / 3.0, 100_000
    wave = sawtooth(0.0, 1.0, frequency_hz, 0)
    piece_s = 1e-2
    total_s = (ramps + 0.5) / frequency_hz
    pieces = int(total_s / piece_s)
    machine.start(wave, [piece_s] * pieces + [total_s - pieces * piece_s])
    assert machine.state.clock.cycle == ramps
    # Each ramp may round by an ulp of its own length, and the sum of pieces by one of its own.
    assert machine.state.clock.ramp_s * frequency_hz == pytest.approx(0.5, rel=0.0, abs=1e-9)
    # Row cycle % 7 of the log was the last to be written; the run is steady.
    assert np.all(np.isfinite(machine.ramps))
    assert machine.ramps[(ramps - 1) % 7, RAMP_END] != 0.0
