# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The frame feels its feet: momentum, numbers of a row of springs, order, energy, poles."""

import numpy as np
import pytest

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, observe_samples
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.frame import frame_place
from stickslip_ros.drive.records import POSITION
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.parameters import Parameters

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
FRAME = {
    'frame__mass': 0.015,
    'frame__resonance': 1e4,
    'frame__damping_ratio': 0.05,
    'actuator__mass': 2e-4,
}
ROUNDING = 1e-9
RESIDUAL = 1e-4
"""Of the work of the feet, at the default step."""

place_of_frame = entry_point(frame_place)


def test_a_frame_that_nothing_holds_takes_the_momentum_that_the_runner_gets(drive):
    lost = []
    for dt_s in (5e-6, 1.25e-6):
        machine = drive(
            frame__mass=0.02, actuator__mass=1e-3, load_cell__contact='absent',
            runner__mass=4e-3, sim__dt=dt_s,
        ).start(WAVE, ())  # fmt: skip
        momenta = []
        for _ in range(30):
            machine.run(WAVE, [1.7e-4])
            state = machine.state
            momenta.append((4e-3 * state.velocity_m_per_s, 0.02 * state.centre_m_per_s))
        runner, frame = np.array(momenta).T
        lost.append(np.abs(runner + frame).max() / np.abs(runner).max())
    assert lost[0] < 1e-4
    assert lost[1] < lost[0] / 4.0**3


def test_without_contact_force_the_feet_push_the_frame_by_their_share(drive):
    # The runner is so light and weakly pressed that the feet fall off under it.
    machine = drive(
        frame__mass=0.02, actuator__mass=1e-3, load_cell__contact='absent',
        runner__mass=1e-6, stand__preload=1e-3,
    )  # fmt: skip
    machine.start(level(150.0), [1e-5])
    moved_m = place_of_frame(machine.plant, machine.state)
    assert moved_m == pytest.approx(-0.3 * machine.state.foot_m, rel=1e-3)


def test_a_heavier_frame_comes_ever_nearer_to_a_rigid_one(drive):
    rigid = drive().start(WAVE, [0.02]).ramps[18, RAMP_MEAN]
    off = [
        abs(drive(frame__mass=kg, frame__resonance=1e3).start(WAVE, [0.02]).ramps[18, RAMP_MEAN]
            / rigid - 1.0)
        for kg in (1.0, 100.0)
    ]  # fmt: skip
    assert off[1] < 0.02 * off[0]
    assert off[1] < 1e-4


@pytest.mark.parametrize('damping', [0.0, 30.0])
def test_the_balance_closes_and_the_error_falls_with_the_fourth_power(damping, drive):
    ends_m = []
    for dt_s in (1e-5, 5e-6, 2.5e-6, 3e-7):
        machine = drive(**FRAME, runner__damping=damping, sim__dt=dt_s)
        machine.start(sawtooth(0.0, 287.3, 1153.4, 0), [12e-3])
        assert abs(machine.residual) < RESIDUAL * (dt_s / 5e-6) ** 3 + ROUNDING
        ends_m.append(machine.ramps[:12, (RAMP_MEAN, RAMP_END)])
    errors = [np.sqrt(np.mean((each - ends_m[-1]) ** 2)) for each in ends_m[:-1]]
    assert errors[0] / errors[2] > 4.0**3


def test_the_interferometer_measures_against_the_frame_if_told(drive):
    truth = {}
    for reference in ('table', 'frame'):
        machine = drive(**FRAME, interferometer__reference=reference)
        truth[reference] = np.zeros((50, 5))
        ramps = np.empty((8, 3))
        machine.start(WAVE, ())
        observe_samples(machine.plants, machine.states, WAVE, 0.0, 2e-5, truth[reference], ramps)
    apart_m = truth['table'][-1, POSITION] - truth['frame'][-1, POSITION]
    assert apart_m == pytest.approx(place_of_frame(machine.plant, machine.state), rel=1e-9)
    assert np.abs(truth['table'] - truth['frame']).max() > 1e-10


def test_a_dead_foot_leaves_frame_and_momentum_where_they_are(drive):
    machine = drive(**FRAME).start(WAVE, [2.3e-4])
    before_m = place_of_frame(machine.plant, machine.state)
    machine.separate()
    machine.plant.dead, machine.state.offsets_m[2] = 2, machine.state.places_m[2]
    assert place_of_frame(machine.plant, machine.state) == pytest.approx(before_m, rel=1e-9)
    machine.run(WAVE, [5e-3])
    assert abs(machine.residual) < RESIDUAL


def test_a_frame_lighter_than_its_feet_is_refused():
    with pytest.raises(OutOfRange, match=r'frame\.mass'):
        plant_of(Parameters().updated({'actuator.mass': 2e-4, 'frame.mass': 1e-3}))
