# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The commanded voltage: saw-teeth, levels, tables, and ramps that are left out."""

import math

import numpy as np
import pytest

from stickslip_ros.drive.amplifier import has_arrived
from stickslip_ros.drive.records import CLOCK, ENDLESS
from stickslip_ros.drive.waveform import (
    CORNER_S,
    is_missed,
    level,
    ramp_is_over,
    sawtooth,
    table,
    target,
    with_missed_steps,
)
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import record

ramp_is_over = entry_point(ramp_is_over)
target = entry_point(target)
is_missed = entry_point(is_missed)

ROUNDING = 1e-12
"""A few operations on doubles."""
ROWS = [(0.0, 0.0), (1e-3, 200.0), (1.5e-3, 200.0), (4e-3, 50.0)]
SUMMED_TIME = 1e-9
"""Relative; the drive adds pieces of time up."""


def _clock(ramp_s, cycle=0):
    return record(CLOCK, ramp_s=ramp_s, cycle=cycle)


@pytest.mark.parametrize(
    ('wave', 'cycle', 'held_v'),
    [
        (level(120.0), 0, 120.0),
        (sawtooth(10.0, 200.0, -500.0, 3), 3, 210.0),
        (table(ROWS), 1, 50.0),
        (table([(0.0, 70.0)]), 0, 70.0),
    ],
)
def test_after_its_cycles_a_wave_is_held_for_ever(wave, cycle, held_v):
    for clock in (_clock(0.0, cycle), _clock(3.0, cycle), _clock(1e6, cycle + 7)):
        assert target(wave, clock) == (held_v, 0.0, math.inf)
        assert not ramp_is_over(wave, clock)


@pytest.mark.parametrize(
    ('hertz', 'start_v', 'rise_v', 'wanted'),
    [(500.0, 10.0, 200.0, (60.0, 1e5, 1.5e-3)), (-500.0, 210.0, -200.0, (160.0, -1e5, 1.5e-3))],
)
def test_a_sawtooth_rises_forwards_and_falls_backwards(hertz, start_v, rise_v, wanted):
    wave = sawtooth(10.0, 200.0, hertz, 3)
    assert (wave.start_v, wave.rise_v, wave.period_s, wave.cycles) == (start_v, rise_v, 2e-3, 3)
    assert target(wave, _clock(0.5e-3)) == pytest.approx(wanted, rel=ROUNDING, abs=0.0)
    assert sawtooth(10.0, 200.0, hertz, 0).cycles == ENDLESS


def test_a_ramp_is_over_at_its_corner():
    wave = sawtooth(0.0, 300.0, 1000.0, 1)
    assert not ramp_is_over(wave, _clock(1e-3 - 1e-9))
    assert ramp_is_over(wave, _clock(1e-3 - 0.5 * CORNER_S))
    assert ramp_is_over(wave, _clock(1e-3))


def test_a_table_is_joined_by_straight_lines_and_its_rows_are_corners():
    wave = table(ROWS)
    assert (wave.cycles, wave.period_s, wave.start_v) == (1, 4e-3, 50.0)
    for time_s, voltage_v, slope, corner_s in (
        (0.0, 0.0, 2e5, 1e-3),
        (0.25e-3, 50.0, 2e5, 0.75e-3),
        (1e-3, 200.0, 0.0, 0.5e-3),
        (2e-3, 170.0, -6e4, 2e-3),
    ):
        assert target(wave, _clock(time_s)) == pytest.approx(
            (voltage_v, slope, corner_s), rel=1e-12
        )


def test_two_rows_of_the_same_time_are_a_jump():
    wave = table([(0.0, 0.0), (1.0, 10.0), (1.0, 50.0), (2.0, 60.0)])
    assert target(wave, _clock(1.0))[0] == 50.0
    assert target(wave, _clock(1.5))[0] == pytest.approx(55.0, rel=1e-12)


@pytest.mark.parametrize('changes', [{}, {'actuator__resonance': 1e5}], ids=['ideal', 'ringing'])
@pytest.mark.parametrize('piece_s', [1e-3, 1.7e-5])
def test_a_drive_plays_a_table_once_and_holds(changes, piece_s, drive):
    wave, machine = table(ROWS), drive(**changes)
    machine.start(wave, ())
    for i in range(1, int(6e-3 / piece_s) + 1):
        machine.run(wave, [piece_s])
        times_s, voltages_v = np.transpose(ROWS)
        expected_v = np.interp(i * piece_s, times_s, voltages_v)
        assert machine.state.voltage_v == pytest.approx(expected_v, rel=SUMMED_TIME, abs=1e-9)
        assert has_arrived(machine.plants, wave, machine.states) == (i * piece_s >= 4e-3 - 1e-12)
    assert machine.state.clock.cycle == 1


def test_a_long_table_does_not_hang_on_rounding(drive):
    rows = np.column_stack((np.linspace(0.0, 1.0, 1001), np.tile([0.0, 30.0], 501)[:1001]))
    machine = drive(sim__dt=2e-5, ramps=4).start(table(rows), [0.1] * 11)
    assert machine.state.clock.cycle == 1
    assert machine.state.voltage_v == 0.0


def test_a_saw_tooth_as_a_table_is_the_saw_tooth(drive):
    teeth = [(1e-3 * (i + j), 300.0 * j) for i in range(5) for j in (0, 1)] + [(5e-3, 0.0)]
    played = drive().start(table(teeth), [6e-3])
    driven = drive().start(sawtooth(0.0, 300.0, 1000.0, 5), [6e-3])
    assert played.state.position_m == pytest.approx(driven.state.position_m, rel=1e-6, abs=0.0)


@pytest.mark.parametrize('share', [0.01, 0.3, 0.9])
def test_the_share_of_the_missed_ramps_is_exact_on_average(share):
    cycles = 100_000
    wave = with_missed_steps(sawtooth(0.0, 300.0, 1000.0, 0), share, 7)
    missed = [is_missed(wave, cycle) for cycle in range(cycles)]
    # Five standard deviations of as many independent draws.
    within = 5.0 * math.sqrt(share * (1.0 - share) / cycles)
    assert np.mean(missed) == pytest.approx(share, rel=0.0, abs=within)
    # Neighbours are independent: as many pairs as chance gives.
    pairs = np.mean(np.array(missed[1:]) & np.array(missed[:-1]))
    assert pairs == pytest.approx(share**2, rel=0.0, abs=2.0 * within)


def test_another_seed_misses_other_ramps_and_the_same_seed_the_same():
    ramps = range(200)
    tooth = sawtooth(0.0, 300.0, 1000.0, 0)
    drawn = [
        [is_missed(with_missed_steps(tooth, 0.5, seed), i) for i in ramps] for seed in (1, 2, 1)
    ]
    assert drawn[0] == drawn[2] != drawn[1]
    assert all(is_missed(with_missed_steps(tooth, 1.0, 3), i) for i in ramps)
    assert not any(is_missed(with_missed_steps(tooth, 0.0, 3), i) for i in ramps)


def test_a_missed_ramp_stays_where_ramps_start_but_counts(drive):
    wave = with_missed_steps(sawtooth(0.0, 300.0, 1000.0, 40), 0.5, 5)
    machine, tops_v = drive(load_cell__contact='absent').start(wave, [0.9e-3]), []
    for _ in range(40):
        tops_v.append(machine.state.voltage_v)
        machine.run(wave, [1e-3])
    expected_v = [0.0 if is_missed(wave, i) else 270.0 for i in range(40)]
    assert tops_v == pytest.approx(expected_v, rel=1e-9, abs=1e-9)
    assert machine.state.clock.cycle == 40
    assert 0 < expected_v.count(0.0) < 40
