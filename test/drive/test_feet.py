# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Six feet moved one by one: against the six as one, in the mirror, and by their energy."""

import numpy as np
import pytest

from stickslip_ros.drive.build import change_preload, plant_of, separate_feet
from stickslip_ros.drive.layout import contacts_of, gain_ratios, ratios_of
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
RUN_S = 0.02
EVERYTHING = {
    'actuator__hysteresis': 0.15,
    'actuator__resonance': 1e5,
    'actuator__gain_tolerance': 0.05,
    'load_cell__contact': 'one_sided',
}
SAME_STEPS = 1e-9
"""Relative; sums of six instead of one sum."""
RESIDUAL = 2e-4
"""Largest residual at the default step, relative to the work of the feet."""
ORDER_2 = 3.0
"""Half the step leaves a quarter of the error; the closing of loops scatters it."""

SECOND_ORDER = 25.0
"""Steps of second order would leave a sixteenth, those of third a sixty-fourth."""


def _in_short_steps(machine):
    machine.plant.ideal = machine.plant.only_long_steps = False
    return machine


def test_feet_keep_the_order_of_the_arrays_where_equal_groups_are_apart():
    values = {'feet.count': [1, 2, 1], 'feet.share': [0.5, 0.2, 0.5], 'feet.gain': [1, 0, 1]}
    parameters = Parameters().updated(values)
    normal_n = [each.indentation.normal_force_n for each in contacts_of(parameters)]
    assert normal_n == pytest.approx([0.25, 0.1, 0.1, 0.25])
    assert ratios_of(parameters).tolist() == [1.0, 0.0, 0.0, 1.0]
    plants = plant_of(parameters)
    separate_feet(plants, parameters)
    assert plants[0].ratios[1:5].tolist() == [1.0, 0.0, 0.0, 1.0]
    forces_n = [float(plants[0].contacts[k].curve.force_max_n) for k in range(1, 5)]
    assert forces_n == pytest.approx([0.075, 0.03, 0.03, 0.075])


@pytest.mark.parametrize('profile', ['rough', 'smooth', 'rough_line'])
def test_equal_feet_one_by_one_move_like_all_as_one(profile, drive):
    one = _in_short_steps(drive(contact__profile=profile)).start(WAVE, [RUN_S])
    six = drive(contact__profile=profile).separate().start(WAVE, [RUN_S])
    assert six.state.position_m == pytest.approx(one.state.position_m, rel=SAME_STEPS, abs=0.0)
    assert np.all(six.state.places_m[1:7] == six.state.foot_m)
    for term in ('feet_work_j', 'contact_stored_j', 'contact_lost_j', 'kinetic_j'):
        expected_j = getattr(one.ledger, term)
        scale_j = 1e-9 * one.ledger.feet_work_j
        assert getattr(six.ledger, term) == pytest.approx(expected_j, rel=1e-6, abs=scale_j)


@pytest.mark.parametrize('law', ['dahl', 'lugre', 'epm'])
def test_equal_feet_share_the_bristles_of_a_rival_law(law, drive):
    changes = {'contact__law': law, 'friction_law__bristle_stiffness': 4e6}
    changes |= {'friction_law__bristle_damping': 5.0, 'friction_law__viscous': 2.0}
    one = drive(**changes).start(WAVE, [RUN_S])
    six = _in_short_steps(drive(**changes)).separate().start(WAVE, [RUN_S])
    # The fall takes other steps; the bristle's damping makes them of first order.
    assert six.state.position_m == pytest.approx(one.state.position_m, rel=5e-3, abs=0.0)
    assert six.ledger.contact_lost_j == pytest.approx(one.ledger.contact_lost_j, rel=5e-3)


def test_equal_feet_go_to_another_preload_like_all_as_one(drive):
    machines = [_in_short_steps(drive()), drive().separate()]
    for machine in machines:
        machine.start(WAVE, [3.3e-3])
        change_preload(machine.plants, machine.states, machine.parameters, 0.52)
        assert not machine.plant.ideal
        assert machine.contacts['on_springs'].all()
        machine.run(WAVE, [5e-3])
        assert machine.state.preload_n == pytest.approx(0.505, rel=1e-6)
        machine.run(WAVE, [0.02])
        assert machine.state.preload_n == 0.52
        assert abs(machine.residual) < 1e-3
    one, six = machines
    # Each foot's springs take up their own misfit to the continuum, 2.5e-3 of the limit.
    assert six.state.position_m == pytest.approx(one.state.position_m, rel=5e-3, abs=0.0)


def test_feet_that_differ_go_back_from_the_springs_to_their_turning_points(drive):
    machine = drive(actuator__gain_tolerance=0.1, stand__preload_rate=10.0).start(WAVE, [2e-3])
    change_preload(machine.plants, machine.states, machine.parameters, 0.45)
    machine.run(WAVE, [0.02])
    assert machine.state.preload_n == 0.45
    assert not machine.contacts['on_springs'].any()
    assert abs(machine.residual) < 1e-3


@pytest.mark.parametrize('tolerance', [1e-3, 0.1, 0.9])
def test_gains_keep_mean_and_tolerance_and_come_from_the_seed(tolerance):
    for seed in range(50):
        ratios = gain_ratios(tolerance, seed, 6)
        assert np.mean(ratios) == pytest.approx(1.0, rel=1e-15)
        assert np.max(np.abs(ratios - 1.0)) <= tolerance * (1.0 + 1e-12)
        assert np.ptp(ratios) > 0.1 * tolerance
    assert np.array_equal(gain_ratios(tolerance, 3, 6), gain_ratios(tolerance, 3, 6))
    assert not np.array_equal(gain_ratios(tolerance, 3, 6), gain_ratios(tolerance, 4, 6))


def test_each_foot_goes_its_own_way(drive):
    machine = drive(actuator__gain_tolerance=0.1).start(WAVE, [0.5e-3])
    ratios = machine.plant.ratios[1:7]
    places_m = machine.state.places_m[1:7]
    np.testing.assert_allclose(places_m, ratios * machine.state.foot_m, rtol=1e-12)
    total_n = machine.contacts['memory']['force_n'].sum()
    assert machine.state.contact_n == pytest.approx(total_n, rel=1e-12)


@pytest.mark.parametrize(
    'extra',
    [{}, {'actuator__gain_tolerance': 0.5}, {'contact__law': 'dahl'},
     {'amplifier__bandwidth': 5e4, 'actuator__creep': 0.05, 'amplifier__resolution': 1.0},
     {'stand__stop_stiffness': 1e6, 'stand__travel_max': 1e-6}],
    ids=str,
)  # fmt: skip
def test_the_balance_closes_with_everything_on(extra, drive):
    residuals = [
        abs(drive(**(EVERYTHING | extra), sim__dt=dt_s).start(WAVE, [RUN_S]).residual)
        for dt_s in (5e-6, 1.25e-6)
    ]
    assert residuals[0] < RESIDUAL
    assert residuals[1] < residuals[0] / ORDER_2


def test_the_same_drive_moves_to_the_bit(drive):
    states = [drive(**EVERYTHING).start(WAVE, [1e-3] * 3).state for _ in range(2)]
    assert states[0] == states[1]
    another = drive(**EVERYTHING, sim__seed=2).start(WAVE, [1e-3] * 3).state
    assert another.position_m != states[0].position_m


@pytest.mark.parametrize(
    'values',
    [
        {'actuator.gain_tolerance': 0.1},
        {'actuator.stiffness': 4e7, 'actuator.resonance': 1e5},
        {'frame.mass': 1.0},
        {'load_cell.resonance': 1e3, 'load_cell.contact': 'one_sided'},
    ],
    ids=str,
)
def test_coulombs_rigid_law_does_not_say_how_bodies_share_a_load(values):
    with pytest.raises(OutOfRange, match=rf'{next(iter(values))} .* under Coulomb'):
        plant_of(Parameters().updated({'contact.law': 'coulomb', **values}))


@pytest.mark.parametrize(
    'changes',
    [{'actuator__gain_tolerance': 0.03}, {'actuator__resonance': 1.5e5},
     {'amplifier__bandwidth': 2e5}, {'actuator__hysteresis': 0.1}, {'actuator__creep': 0.01}],
    ids=str,
)  # fmt: skip
def test_a_quarter_of_the_step_leaves_far_less_than_a_sixteenth_of_the_error(changes, drive):
    wave, samples = sawtooth(0.0, 287.3, 1153.4, 0), [2e-5] * 300
    paths_m = []
    for dt_s in (3.125e-7, 2.5e-6, 1e-5):
        machine = drive(**changes, sim__dt=dt_s)
        paths_m.append([machine.run(wave, [time_s]).state.position_m for time_s in samples])
    fine, coarse = np.sqrt(np.mean((np.array(paths_m[1:]) - paths_m[0]) ** 2, axis=1))
    assert coarse / fine > SECOND_ORDER
