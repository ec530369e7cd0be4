"""The runner against closed forms of the damped oscillator, and Newton's second law."""

import math

import numpy as np
import pytest

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import virgin_force
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import force_on_runner, kick_after, kick_before
from stickslip_ros.drive.waveform import level

virgin_force = entry_point(virgin_force)

MASS_KG, CELL_N_PER_M = 3e-3, 1e5
OMEGA = math.sqrt(CELL_N_PER_M / MASS_KG)
ORDER_2 = (3.8, 4.2)
"""Half the step, a quarter of the error; the next order is within five per cent here."""


@entry_point
def _oscillate(plant: Record, position_m, velocity_m_per_s, load_n, dt_s, steps):
    force_n = force_on_runner(plant, position_m, 0.0, load_n)
    for _ in range(steps):
        velocity_m_per_s = kick_before(plant, velocity_m_per_s, force_n, dt_s)
        position_m += dt_s * velocity_m_per_s
        force_n = force_on_runner(plant, position_m, 0.0, load_n)
        velocity_m_per_s = kick_after(plant, velocity_m_per_s, force_n, dt_s)
    return position_m, velocity_m_per_s


@pytest.fixture
def oscillator(stand):
    def make(damping):
        plant = plant_of(stand)[0]
        plant.mass_kg, plant.cell_n_per_m, plant.damping_n_s_per_m = MASS_KG, CELL_N_PER_M, damping
        return plant

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
    expected = np.array(_closed_form(damping, load_n, start_m, time_s))
    errors = []
    for steps in (2000, 4000, 8000):
        found = np.array(
            _oscillate(oscillator(damping), start_m, 0.0, load_n, time_s / steps, steps)
        )
        errors.append(np.abs(found - expected))
    scale = np.array([start_m, start_m * OMEGA])
    # Phase error of Verlet: (omega dt)^2/24 per radian, 11 radians here.
    assert np.all(errors[0] / scale < 12.0 * (OMEGA * time_s / 2000) ** 2)
    ratios = np.array(errors[:2]) / np.array(errors[1:])
    assert np.all((ratios > ORDER_2[0]) & (ratios < ORDER_2[1]))


def test_an_undamped_runner_swings_a_million_steps_without_gain_or_loss(oscillator):
    dt_s = 5e-7
    position_m, velocity = _oscillate(oscillator(0.0), 1e-6, 0.0, 0.0, dt_s, 1_000_000)
    energy = (position_m**2 + (velocity / OMEGA) ** 2) / 1e-12
    # Verlet keeps a neighbouring energy: off by at most (omega dt / 2)^2 at any time.
    assert energy == pytest.approx(1.0, rel=0.0, abs=(OMEGA * dt_s / 2.0) ** 2)


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
