"""One-sided springs: the load cell that the runner presses on, and the end stops."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.kernel import in_python
from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import cell_energy, cell_force, stops_energy, stops_force
from stickslip_ros.drive.waveform import level, sawtooth

cell_force = in_python(cell_force)
stops_force = in_python(stops_force)

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
BACK = sawtooth(0.0, 300.0, -1000.0, 0)
VERLET = 2e-4
"""Relative; what short steps of second order miss against long ones of fourth."""
RESIDUAL = 1e-3
"""Largest residual at the default step, relative to the energy put in."""
FREE = {'stand__preload': 1e-3, 'load_cell__contact': 'absent'}
"""A runner that almost nothing holds: friction is 0.8 mN."""


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


def test_a_runner_that_always_presses_moves_as_on_a_fixed_load_cell(drive):
    fixed = drive(runner__damping=80.0).start(WAVE, [0.02])
    pressing = drive(runner__damping=80.0, load_cell__contact='one_sided').start(WAVE, [0.02])
    assert pressing.ramps[18, RAMP_MEAN] == pytest.approx(fixed.ramps[18, RAMP_MEAN], rel=VERLET)
    assert pressing.ledger.cell_j == pytest.approx(fixed.ledger.cell_j, rel=10.0 * VERLET)


def test_far_from_its_load_cell_a_runner_is_free_to_the_bit(drive):
    free = drive(load_cell__contact='absent').start(WAVE, [0.02])
    far = drive(load_cell__contact='one_sided', load_cell__gap=1e-3).start(WAVE, [0.02])
    assert far.state == free.state


def test_far_from_its_end_stops_a_runner_does_not_feel_them(drive):
    free = drive(load_cell__contact='absent').start(WAVE, [0.02])
    far = drive(load_cell__contact='absent', stand__stop_stiffness=1e5).start(WAVE, [0.02])
    assert far.state == free.state


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


@pytest.mark.parametrize(
    'changes',
    [{'load_cell__contact': 'one_sided', 'load_cell__gap': 1e-6},
     {'load_cell__contact': 'absent', 'stand__stop_stiffness': 1e7, 'stand__travel_max': 5e-7}],
    ids=str,
)  # fmt: skip
def test_the_balance_of_a_runner_that_meets_a_wall_closes_with_shorter_steps(changes, drive):
    residuals = []
    for dt_s in (5e-6, 6.25e-7):
        machine = drive(**changes, sim__dt=dt_s).start(WAVE, [0.03])
        residuals.append(abs(machine.ledger.residual_j / machine.ledger.feet_work_j))
    assert residuals[0] < RESIDUAL
    # An eighth of the step, a sixty-fourth of the error, less what the kinks scatter.
    assert residuals[1] < residuals[0] / 16.0


def test_two_load_cells_are_never_counted(drive):
    for contact, springs in (('attached', (1e5, 0.0)), ('one_sided', (0.0, 1e5)),
                             ('absent', (0.0, 0.0))):  # fmt: skip
        plant = drive(load_cell__contact=contact).plant
        assert (plant.cell_n_per_m, plant.walls.cell_n_per_m) == springs
