# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The runner against closed forms, and the springs that it meets: load cell and end stops."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.virgin import virgin_force
from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import cell_energy, cell_force, stops_energy, stops_force
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.kernels.kernel import entry_point, in_python

cell_force = in_python(cell_force)
stops_force = in_python(stops_force)
cell_energy, stops_energy = in_python(cell_energy), entry_point(stops_energy)
virgin_force = entry_point(virgin_force)

MASS_KG, CELL_N_PER_M = 3e-3, 1e5
OMEGA = math.sqrt(CELL_N_PER_M / MASS_KG)
EXACT = 1e-9
"""Of the series that solve the oscillator, and of rounding."""
WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
BACK = sawtooth(0.0, 300.0, -1000.0, 0)
SAME_SPRING = 1e-9
"""Relative; rounding, which the turns of the sliding magnify."""
LOCATED = (8.0, 40.0)
"""Half the step, a sixteenth of the error; where walls are met scatters it."""
RESIDUAL = 1e-3
"""Largest residual at the default step, relative to the energy put in."""
FREE = {'stand__preload': 1e-3, 'load_cell__contact': 'absent'}
"""A runner that almost nothing holds: friction is 0.8 mN."""


@pytest.fixture(params=['long', 'short'])
def oscillator(request, drive):
    """Return how to make a runner on its load cell without friction, in either kind of step."""

    def make(damping):
        machine = drive(runner__damping=damping, load_cell__stiffness=CELL_N_PER_M)
        curve = machine.plant.contacts[ALL].curve
        curve.cells[:] = curve.force_max_n = curve.energy_max_j = 0.0
        if request.param == 'short':
            machine.plant.ideal = machine.plant.only_long_steps = False
        return machine

    return make


def _closed_form(damping, load_n, start_m, time_s):
    """Return position and velocity of a damped oscillator that starts at rest."""
    decay = damping / (2.0 * MASS_KG)
    omega = math.sqrt(OMEGA**2 - decay**2)
    rest_m = load_n / CELL_N_PER_M
    swing_m = (start_m - rest_m) * math.exp(-decay * time_s)
    cos, sin = math.cos(omega * time_s), math.sin(omega * time_s)
    position_m = rest_m + swing_m * (cos + decay / omega * sin)
    return position_m, -swing_m * OMEGA**2 / omega * sin


@pytest.mark.parametrize('damping', [0.0, 2.0, 20.0])
@pytest.mark.parametrize('load_n', [0.0, 0.03])
def test_a_runner_on_its_load_cell_alone_is_a_damped_oscillator(damping, load_n, oscillator):
    start_m, time_s = 1e-6, 2e-3
    machine = oscillator(damping)
    machine.state.position_m = machine.state.contacts[ALL].memory.u_m = start_m
    machine.run(level(0.0), [time_s], load_n)
    expected_m, expected_m_per_s = _closed_form(damping, load_n, start_m, time_s)
    assert abs(machine.state.position_m - expected_m) < EXACT * start_m
    assert abs(machine.state.velocity_m_per_s - expected_m_per_s) < EXACT * start_m * OMEGA


def test_an_undamped_runner_swings_a_hundred_thousand_steps_without_gain_or_loss(oscillator):
    machine = oscillator(0.0)
    machine.state.velocity_m_per_s = OMEGA * 1e-6
    machine.run(level(0.0), [0.5])
    state = machine.state
    energy = (state.position_m**2 + (state.velocity_m_per_s / OMEGA) ** 2) / 1e-12
    assert energy == pytest.approx(1.0, rel=0.0, abs=EXACT)


def test_a_load_below_friction_shifts_a_creeping_runner_along_the_virgin_curve(drive):
    machine = drive(load_cell__contact='absent', runner__damping=5000.0)
    curve = machine.plant.contacts[ALL].curve
    load_n = 0.5 * curve.force_max_n
    machine.start(level(0.0), [0.1], load_n)
    settled_n = virgin_force(curve, machine.state.position_m)
    # A hundred times the slowest time constant, damping over stiffness, has passed.
    assert settled_n == pytest.approx(load_n, rel=1e-9, abs=0.0)
    assert machine.state.contacts[ALL].memory.depth == 0


def test_a_load_beyond_friction_accelerates_a_free_runner_by_the_rest(drive):
    machine = drive(load_cell__contact='absent')
    friction_n = machine.plant.contacts[ALL].curve.force_max_n
    assert friction_n == pytest.approx(0.3 * 2.0 * math.sqrt(2.0) * 0.5, rel=1e-12, abs=0.0)
    load_n = 2.0 * friction_n
    machine.start(level(0.0), [1e-3], load_n)
    before = machine.state.velocity_m_per_s
    machine.run(level(0.0), [1e-3], load_n)
    gained = machine.state.velocity_m_per_s - before
    assert gained == pytest.approx(friction_n / MASS_KG * 1e-3, rel=1e-9, abs=0.0)


def test_a_drive_that_is_left_alone_stays_exactly_at_rest(drive):
    machine = drive().start(level(0.0), [1e-3] * 10)
    assert machine.state.position_m == machine.state.velocity_m_per_s == 0.0
    assert not any(machine.state.sums.item())
    assert machine.ledger.residual_j == 0.0


def test_the_load_cell_is_fixed_or_pressed_or_absent(drive):
    k = 1e5
    fixed, absent = drive().plant, drive(load_cell__contact='absent').plant
    pressed = drive(load_cell__contact='one_sided', load_cell__gap=2e-6).plant
    for position_m in (-3e-6, 0.0, 1e-6, 2e-6, 3.5e-6):
        assert cell_force(fixed, position_m) == k * position_m
        assert cell_force(absent, position_m) == 0.0
        expected_n = k * max(position_m - 2e-6, 0.0)
        assert cell_force(pressed, position_m) == pytest.approx(expected_n, rel=1e-12, abs=0.0)
        expected_j = 0.5 * expected_n**2 / k
        assert cell_energy(pressed, position_m) == pytest.approx(expected_j, rel=1e-12, abs=0.0)


def test_end_stops_push_back_from_both_sides(drive):
    plant = drive(stand__stop_stiffness=2e6, stand__travel_min=-1e-6, stand__travel_max=3e-6).plant
    for position_m, force_n in ((-1.5e-6, -1.0), (-1e-6, 0.0), (3e-6, 0.0), (3.2e-6, 0.4)):
        assert stops_force(plant, position_m) == pytest.approx(force_n, rel=1e-9, abs=1e-15)
        energy_j = 0.25e-6 * force_n**2
        assert stops_energy(plant, position_m) == pytest.approx(energy_j, rel=1e-9, abs=1e-24)


@pytest.mark.parametrize('damping', [0.0, 80.0])
def test_a_runner_that_always_presses_moves_as_on_a_fixed_load_cell(damping, drive):
    fixed = drive(stand__preload=1.0, runner__damping=damping).start(WAVE, [0.02])
    pressing = drive(
        stand__preload=1.0, runner__damping=damping, load_cell__contact='one_sided'
    ).start(WAVE, [0.02])
    mean_m = fixed.ramps[18, RAMP_MEAN]
    assert pressing.ramps[18, RAMP_MEAN] == pytest.approx(mean_m, rel=SAME_SPRING)
    assert pressing.ledger.cell_j == pytest.approx(fixed.ledger.cell_j, rel=SAME_SPRING)


@pytest.mark.parametrize(
    'changes',
    [{'load_cell__contact': 'one_sided', 'load_cell__gap': 3.137e-7},
     {'load_cell__contact': 'absent', 'stand__stop_stiffness': 3.3e6, 'stand__travel_max': 7e-7}],
    ids=str,
)  # fmt: skip
def test_where_a_runner_meets_walls_the_motion_is_of_fourth_order_too(changes, drive):
    paths_m = []
    for dt_s in (3.125e-7, 2.5e-6, 5e-6):
        machine = drive(**changes, sim__dt=dt_s)
        paths_m.append([machine.run(WAVE, [2e-5]).state.position_m for _ in range(500)])
    errors_m = np.sqrt(np.mean((np.array(paths_m[1:]) - paths_m[0]) ** 2, axis=1))
    assert LOCATED[0] < errors_m[1] / errors_m[0] < LOCATED[1]


@pytest.mark.parametrize(
    'changes',
    [{'load_cell__contact': 'one_sided', 'load_cell__gap': 1e-3},
     {'load_cell__contact': 'absent', 'stand__stop_stiffness': 1e5}],
    ids=str,
)  # fmt: skip
def test_far_from_walls_a_runner_is_free_to_the_bit(changes, drive):
    free = drive(load_cell__contact='absent').start(WAVE, [0.02])
    assert drive(**changes).start(WAVE, [0.02]).state == free.state


def test_a_runner_bounces_from_a_load_cell_within_half_a_swing(drive):
    k, mass_kg, speed = 1e6, 3e-3, 0.1
    machine = drive(
        **(FREE | {'load_cell__contact': 'one_sided'}), load_cell__gap=1e-5, load_cell__stiffness=k
    )
    machine.state.velocity_m_per_s = speed
    positions_m, step_s = [], 1e-6
    for _ in range(600):
        machine.run(level(0.0), [step_s])
        positions_m.append(machine.state.position_m)
    omega = math.sqrt(k / mass_kg)
    pressed_s = np.count_nonzero(np.array(positions_m) > 1e-5) * step_s
    assert pressed_s == pytest.approx(math.pi / omega, rel=0.0, abs=2.0 * step_s)
    # Friction of 0.8 mN along 60 um takes 5e-8 J of the 1.5e-5 J.
    assert np.max(positions_m) == pytest.approx(1e-5 + speed / omega, rel=5e-3, abs=0.0)
    assert machine.state.velocity_m_per_s == pytest.approx(-speed, rel=1e-2, abs=0.0)


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_loaded_runner_comes_to_rest_in_the_end_stop(sign, drive):
    stiffness, stop_m, load_n = 1e6, 2e-6, 1.0
    machine = drive(
        **FREE, stand__stop_stiffness=stiffness, runner__damping=60.0,
        stand__travel_max=stop_m, stand__travel_min=-stop_m,
    ).start(level(0.0), [0.05], sign * load_n)  # fmt: skip
    friction_n = machine.plant.contacts[ALL].curve.force_max_n
    pressed_m = sign * machine.state.position_m - stop_m
    assert pressed_m == pytest.approx(load_n / stiffness, rel=0.0, abs=friction_n / stiffness)
    assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.load_work_j


@pytest.mark.parametrize('wave', [WAVE, BACK], ids=['up', 'down'])
def test_a_drive_that_steps_into_its_end_stop_stays_there(wave, drive):
    changes = {'load_cell__contact': 'absent', 'stand__stop_stiffness': 1e6}
    changes |= {'stand__travel_min': -1e-6, 'stand__travel_max': 1e-6, 'runner__damping': 20.0}
    start_v = wave.start_v
    machine = drive(amplifier__voltage_initial=start_v, **changes).start(wave, [0.1])
    friction_n = machine.plant.contacts[ALL].curve.force_max_n
    pressed_m = abs(machine.state.position_m) - 1e-6
    assert 0.0 < pressed_m < friction_n / 1e6
    assert machine.ledger.stops_j > 0.0
    assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.feet_work_j
    assert machine.state.clock.cycle in {99, 100}


def test_two_load_cells_are_never_counted(drive):
    for contact, springs in (('attached', (1e5, 0.0)), ('one_sided', (0.0, 1e5)),
                             ('absent', (0.0, 0.0))):  # fmt: skip
        plant = drive(load_cell__contact=contact).plant
        assert (plant.cell_n_per_m, plant.walls.cell_n_per_m) == springs
