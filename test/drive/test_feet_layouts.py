# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Layouts of feet against known answers: guides, delays, equal groups, and their energy."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from stickslip_ros.drive.advance import RAMP_END, observe_samples
from stickslip_ros.drive.build import (
    PHASE_MAX,
    all_contacts,
    change_preload,
    longest_step_s,
    plant_of,
)
from stickslip_ros.drive.faults import apply_faults
from stickslip_ros.drive.feet import mean_place
from stickslip_ros.drive.layout import contacts_at, contacts_of
from stickslip_ros.drive.records import CORNERS, FOOT, FORCE
from stickslip_ros.drive.waveform import level, sawtooth, table
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.parameters import Parameters

STROKE_M = 160e-9
WAVE = sawtooth(0.0, 300.0, 1000.0, 0)
LAYOUTS: dict[str, dict[str, Any]] = {
    'guides': {'feet__count': (4, 2), 'feet__gain': (1.0, 0.0)},
    'dry guide': {'feet__guide_friction': 0.05},
    'opposed': {'feet__count': (4, 2), 'feet__gain': (1.0, -0.7)},
    'stuffs': {
        'feet__count': (2, 4),
        'feet__radius': (0.3e-3, 0.8e-3),
        'feet__friction': (0.0, 0.1),
        'feet__young': (5e9, 0.0),
        'contact__poisson_sphere': 0.45,
    },
    'walker': {'feet__count': (2, 2, 2), 'feet__share': 0.5, 'feet__delay': (0.0, 2.7e-4, 6.1e-4)},
    'three gains, one delay': {
        'feet__count': (3, 4, 5),
        'feet__share': (0.4, 0.2, 0.3),
        'feet__gain': (1.0, 0.5, 1.2),
        'feet__delay': (0.0, 5e-5, 5e-5),
    },
}
STACKS: dict[str, Any] = {'actuator__resonance': 1e5, 'actuator__stiffness': 4e7}
PIEZO: dict[str, Any] = {
    'actuator__hysteresis': 0.15,
    'actuator__creep': 0.02,
    'actuator__resonance': 1e5,
    'amplifier__bandwidth': 5e4,
}
LINES: dict[str, Any] = {
    'contact.profile': 'rough_line',
    'contact.travel': 0.7,
    'contact.line_points': 2048,
    'contact.cutoff_upper': 1e6,
}
CONDITIONS: dict[str, dict[str, Any]] = {
    'rigid': {},
    'frame': {'frame__mass': 0.05, 'frame__resonance': 2e3, 'actuator__mass': 1e-4},
    'stacks': STACKS,
    'stacks on a frame': {**STACKS, 'frame__mass': 0.05, 'frame__resonance': 2e3},
    'piezo': PIEZO,
    'converter': {**PIEZO, 'amplifier__resolution': 0.5},
    'tolerance': {'actuator__gain_tolerance': 0.1},
    'ageing': {'contact__friction_ageing': 0.01, 'contact__friction_rate': 0.01},
    'dahl': {'contact__law': 'dahl'},
    'travel': {name.replace('.', '__'): value for name, value in LINES.items()},
}
RESIDUAL = 1e-3
"""Largest residual at the default step, relative to the work of the feet."""
SAME = 1e-9
"""Relative; the feet come in another order of sums."""
OTHER_STEPS = 1e-4
"""Relative; other pieces of time lead to other steps."""
LATE = 1e-11
"""Rounding of a delayed foot, relative to the stroke: each stage is exact for a straight voltage.
"""
LATE_STAGES = 2e-4
"""The same behind several stages, of which a later one gets no straight line."""
SLOW = 3e-3
"""What viscous damping of some mN takes from a step of a walker, relative to the stroke."""
HOLDS = 1e-3
"""Relative to the stroke: a runner that does not move on."""
STIFF = 1e-4
"""Relative; what is left of presliding between stiff bodies."""
STICKS = 2e-2
"""Relative; the first cell of the table is softer than full stick."""
GUIDED: dict[str, Any] = {
    'feet__count': 4,
    'feet__share': 0.25,
    'feet__gain': 0.0,
    'feet__weight': 0.0,
}
GUIDE_N = 0.3 * 4 * 0.25 * 0.5
"""Friction limit of these guides."""


@pytest.mark.parametrize('extra', [{}, {'feet.gain': 0.5}, {'feet.delay': 1e-4}], ids=str)
@pytest.mark.parametrize('counts', [(2, 4), (3, 3), (1, 2, 3)])
def test_groups_of_equal_feet_are_one_group(counts, extra):
    values = {'feet.share': 0.5, 'feet.weight': 0.1, 'stand.weight': True, **extra}
    one, several = (
        run_drive(Parameters().updated({**values, 'feet.count': each}), STROKE_M, 500.0, 20)
        for each in ((6,), counts)
    )
    assert one == several


def test_the_order_of_groups_does_not_matter(drive):
    runs = [
        drive(feet__count=(2, 3)[::turn], feet__share=(0.5, 0.3)[::turn],
              feet__gain=(1.0, 0.4)[::turn], feet__delay=(1e-4, 0.0)[::turn]).start(WAVE, [0.01])
        for turn in (1, -1)
    ]  # fmt: skip
    there, back = (run.state.position_m for run in runs)
    assert there == pytest.approx(back, rel=SAME, abs=0.0)


def test_reversed_gains_are_the_mirror(drive):
    there, back = (
        drive(**PIEZO, feet__gain=(gain, gain)).start(WAVE, [0.01]) for gain in (1.0, -1.0)
    )
    assert back.plant.separate
    assert back.state.position_m == pytest.approx(-there.state.position_m, rel=SAME, abs=0.0)


@pytest.mark.parametrize('is_command', [True, False])
@pytest.mark.parametrize('dry_n', [0.0, 0.05])
def test_guides_hold_a_load_up_to_their_friction(dry_n, is_command, drive):
    least_n = GUIDE_N + dry_n
    for share in (0.99, 1.01):
        load_n = share * least_n
        command_n = load_n if is_command else 0.0
        values = {**GUIDED, 'stand__load': load_n - command_n, 'runner__damping': 80.0}
        values['feet__guide_friction'] = dry_n
        machine = drive(**values, load_cell__contact='absent')
        machine.start(level(0.0), [0.02], command_n)
        at_m = machine.state.position_m
        machine.run(level(0.0), [0.02], command_n)
        slid_m = machine.state.position_m - at_m
        expected_m = max(0.0, (load_n - least_n) / 80.0 * 0.02)
        assert slid_m == pytest.approx(expected_m, rel=1e-9, abs=1e-15)
        assert machine.ledger.feet_work_j == 0.0
        assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.load_work_j


@pytest.mark.parametrize(
    'changes',
    [{}, {'contact__law': 'coulomb'}, {'contact__law': 'dahl'}, {'feet__delay': 1e-4}],
    ids=str,
)
def test_a_constant_load_is_like_one_of_a_command(changes, drive):
    one = drive(**changes, stand__load=0.05).start(WAVE, [5e-3])
    other = drive(**changes).start(WAVE, [5e-3], 0.05)
    assert one.ledger == other.ledger
    assert one.state.position_m == other.state.position_m


def test_guides_take_their_friction_from_the_blocking_force(drive):
    for guides, dry_n in ((0, 0.0), (2, 0.0), (0, 0.04)):
        machine = drive(
            feet__count=(4, guides) if guides else 4,
            feet__share=(0.3, 0.2) if guides else 0.3,
            feet__gain=(1.0, 0.0) if guides else 1.0,
            feet__guide_friction=dry_n,
            contact__young_sphere=1e12,
            contact__young_runner=1e12,
            load_cell__stiffness=1e6,
            runner__damping=80.0,
        ).start(sawtooth(0.0, 300.0, 50.0, 0), [41 / 50.0])
        force_n = 1e6 * machine.ramps[39, RAMP_END]
        assert force_n == pytest.approx(0.3 * 0.5 * (4 * 0.3 - guides * 0.2) - dry_n, rel=STIFF)


def _walker(drive, counts, share, preload_n=0.1):
    """Return a slow walker, whose falls do not overlap, and its wave."""
    groups, cycle_s = len(counts), 0.055
    machine = drive(
        feet__count=counts,
        feet__share=share,
        feet__weight=0.0,
        feet__delay=tuple(k * cycle_s / groups for k in range(groups)),
        stand__preload=preload_n,
        amplifier__slew_rate=3e4,
        runner__damping=10.0 if preload_n < 0.5 else 40.0,
        load_cell__contact='absent',
    )
    return machine, sawtooth(0.0, 300.0, 1.0 / cycle_s, 0)


@pytest.mark.parametrize(
    ('counts', 'preload_n'),
    [((1, 1, 1, 1), 0.5), ((1, 1, 1, 1), 0.1), ((2, 2, 2), 0.1), ((1,) * 6, 0.5)],
)
def test_feet_that_fall_one_after_another_step_by_the_stroke_less_n_dips(counts, preload_n, drive):
    """
    The n feet fall one after another, each while the others hold.

    A foot falls to -f, its friction limit. Each of n - 1 falls of other feet then pulls the runner
    back by d and this foot to -f + 2 T(m d / 2) after m of them (Masing). The forces of all feet
    together are 0 at any time, which gives d. In a cycle the runner follows the ramp, and dips n
    times by d.

    """
    machine, wave = _walker(drive, counts, 0.5, preload_n)
    contact, n = contacts_of(machine.parameters)[0], len(counts)

    def sum_n(dip_m):
        forces_n = [float(contact.tangential_force(0.5 * m * dip_m)) for m in range(n)]
        return sum(forces_n) - 0.5 * n * contact.max_force_n

    dip_m = brentq(sum_n, 0.0, 4.0 * contact.max_displacement_m)
    machine.start(wave, [4.0 * wave.period_s])
    at_m, piece_s = machine.state.position_m, [wave.period_s / 200]
    path_m = [machine.run(wave, piece_s).state.position_m for _ in range(200)]
    assert path_m[-1] - at_m == pytest.approx(STROKE_M - n * dip_m, abs=SLOW * STROKE_M)
    # While a foot falls the others rise.
    assert np.max(np.maximum.accumulate(path_m) - path_m) < dip_m


@pytest.mark.parametrize(('weak', 'walks'), [(0.1, False), (0.2, False), (0.3, True)])
def test_no_walker_steps_whose_other_feet_cannot_hold_the_strongest(weak, walks, drive):
    machine, wave = _walker(drive, (1, 1, 1), (0.5, weak, weak))
    machine.start(wave, [5.0 * wave.period_s])
    at_m = machine.state.position_m
    step_m = machine.run(wave, [wave.period_s]).state.position_m - at_m
    assert (step_m > 0.5 * STROKE_M) if walks else (abs(step_m) < HOLDS * STROKE_M)


def _missed_by_late_foot(drive, **changes):
    """Return the largest distance of a delayed foot from the earlier other foot, per stroke."""
    sample_s, late = 1e-5, 37
    machine = drive(feet__count=(2, 4), feet__delay=(0.0, late * sample_s), **changes)
    now_m, late_m = [0.0], [0.0]
    rows = table([(0.0, 120.0), (0.4e-3, 7.0), (0.7e-3, 7.0), (1.3e-3, 222.2)])
    for wave, samples in (
        (sawtooth(0.0, 300.0, 1234.5, 0), 211),
        (rows, 150),
        (level(30.0), 39),
        (sawtooth(0.0, 250.0, -777.7, 0), 300),
    ):
        machine.start(wave, ())
        for _ in range(samples):
            state = machine.run(wave, [sample_s]).state
            now_m.append(state.foot_m)
            late_m.append(state.late[0].foot_m)
    assert np.ptp(late_m) > 0.5 * STROKE_M
    missed_m = np.array(late_m) - np.array([0.0] * late + now_m[:-late])
    return np.max(np.abs(missed_m)) / STROKE_M


@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'amplifier__bandwidth': 2e4},
        {'amplifier__resolution': 1.0},
        {'actuator__hysteresis': 0.2},
        {'actuator__creep': 0.05},
        {'actuator__resonance': 3e4},
        {'actuator__gain_tolerance': 0.1},
    ],
    ids=str,
)
def test_a_delayed_foot_repeats_the_nominal_foot(changes, drive):
    assert _missed_by_late_foot(drive, **changes) < LATE


def test_a_delayed_foot_repeats_all_stages_together_the_better_the_shorter_the_steps(drive):
    stages = {**PIEZO, 'amplifier__resolution': 0.3}
    missed = [_missed_by_late_foot(drive, **stages, sim__dt=dt_s) for dt_s in (5e-6, 1e-6)]
    assert missed[0] < LATE_STAGES
    assert missed[1] < 0.1 * missed[0]


def test_a_fall_of_one_foot_of_twelve_takes_fewer_steps_and_is_as_exact(drive):
    wave, seen = sawtooth(0.0, 243.75, 1000.0, 0), {}
    for feet, dt_s in ((6, 5e-6), (12, 5e-6), (12, 6.25e-7)):
        late_s = tuple(k * 1e-3 / feet for k in range(feet))
        machine = drive(
            feet__count=(1,) * feet, feet__share=1.0 / feet, feet__delay=late_s, sim__dt=dt_s
        )
        seen[feet, dt_s] = machine.start(wave, [1e-5] * 400)
    few, many, fine = seen.values()
    assert many.state.passes_made < 1.3 * few.state.passes_made
    assert many.ramps[:4, 1:] == pytest.approx(fine.ramps[:4, 1:], rel=2e-5, abs=0.0)


def test_pieces_of_time_do_not_matter_to_delayed_feet(drive):
    values = {**LAYOUTS['walker'], **PIEZO, 'runner__damping': 80.0}
    whole = drive(**values).start(WAVE, [0.01])
    pieces = drive(**values).start(WAVE, [1e-3 / 7.0] * 70)
    assert pieces.state.position_m == pytest.approx(whole.state.position_m, rel=OTHER_STEPS)
    for j in range(2):
        late_m = whole.state.late[j].foot_m
        assert pieces.state.late[j].foot_m == pytest.approx(late_m, abs=1e-5 * STROKE_M)


@pytest.mark.parametrize('condition', CONDITIONS)
@pytest.mark.parametrize('layout', LAYOUTS)
def test_the_balance_closes_in_every_layout(layout, condition, drive):
    machine = drive(**LAYOUTS[layout], **CONDITIONS[condition]).start(WAVE, [0.01])
    work_j = machine.ledger.feet_work_j
    assert work_j > 0.0
    assert abs(machine.ledger.residual_j) < RESIDUAL * work_j


@pytest.mark.parametrize('layout', [*LAYOUTS, 'tolerance'])
def test_the_mirrored_layout_moves_in_the_mirror(layout, drive):
    values = {**(LAYOUTS | CONDITIONS)[layout], **PIEZO, 'runner__damping': 20.0}
    there = drive(**values, stand__load=0.01).start(WAVE, [0.01])
    below = {'amplifier__voltage_min': -300.0, 'amplifier__voltage_max': 0.0}
    back = drive(**values, **below, stand__load=-0.01)
    back.start(sawtooth(-300.0, 300.0, -1000.0, 0), [0.01])
    assert back.state.position_m == -there.state.position_m
    assert back.ledger == there.ledger


@pytest.mark.parametrize('law', ['mdr', 'dahl'])
@pytest.mark.parametrize('layout', LAYOUTS)
def test_a_foot_of_any_layout_dies_and_lives_again(layout, law, drive):
    machine = drive(**LAYOUTS[layout], contact__law=law, runner__damping=20.0)
    machine.start(WAVE, [3.3e-3])
    feet = machine.parameters.feet.total
    for foot in (1, feet, 0):
        before, force_n = machine.ledger, machine.state.contact_n
        apply_faults(machine.plants, machine.states, machine.parameters, dead_foot=foot,
                     runner_stuck=False, amplifier_on=True)  # fmt: skip
        assert machine.plant.moved == feet
        assert machine.ledger.residual_j == pytest.approx(before.residual_j, abs=1e-15)
        limit_n = sum(each.max_force_n for each in contacts_of(machine.parameters))
        assert machine.state.contact_n == pytest.approx(force_n, abs=1e-6 * limit_n)
        place_m = machine.state.places_m[foot]
        machine.run(WAVE, [2.35e-3])
        assert not foot or machine.state.places_m[foot] == place_m
    assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.feet_work_j


@pytest.mark.parametrize('layout', LAYOUTS)
def test_any_layout_goes_to_another_preload(layout, drive):
    machine = drive(**LAYOUTS[layout], stand__preload_rate=10.0).start(WAVE, [3.3e-3])
    change_preload(machine.plants, machine.states, machine.parameters, 0.6)
    machine.run(WAVE, [0.02])
    assert machine.state.preload_n == 0.6
    assert (machine.state.contacts['preload_n'][1 : 1 + machine.plant.moved] == 0.6).all() or (
        not machine.plant.separate
    )
    assert abs(machine.residual) < RESIDUAL
    limit_n = 0.6 / 0.5 * sum(each.max_force_n for each in contacts_of(machine.parameters))
    assert abs(machine.state.contact_n) <= limit_n * (1.0 + 1e-6)


@pytest.mark.parametrize('layout', ['stuffs', 'walker'])
def test_springs_stick_as_stiffly_as_under_the_largest_preload(layout):
    stand = Parameters().updated(
        {name.replace('__', '.'): value for name, value in LAYOUTS[layout].items()}
    )
    plant = plant_of(stand)[0]
    banks = plant.contacts[1 : 1 + plant.moved] if plant.separate else plant.contacts[:1]
    pressed = contacts_at(stand.contact, stand.feet, stand.stand.preload_limit, 0.0)
    stiffness_n_per_m = sum(each.stick_stiffness_n_per_m for each in pressed)
    own_n_per_m = banks['bank']['shear_n_per_m'].sum()
    assert own_n_per_m == pytest.approx(stiffness_n_per_m, rel=STICKS)


def test_each_foot_is_as_deep_as_its_own_radius_makes_it():
    shares, radii_m, preload_n = (0.5, 0.7, 0.7), (0.3e-3, 0.8e-3, 0.8e-3), 0.6
    layout = {'feet.count': (1, 2), 'feet.share': shares[:2], 'feet.radius': radii_m[:2]}
    changes = {'contact.profile': 'smooth', 'stand.preload': preload_n, **layout}
    found_m = [each.indentation.depth_m for each in contacts_of(Parameters().updated(changes))]
    e_star_pa = 147.2149e9  # Eq. 5
    hertz_m = [
        np.cbrt(9.0 * (share * preload_n) ** 2 / (16.0 * e_star_pa**2 * radius_m))
        for share, radius_m in zip(shares, radii_m, strict=True)
    ]
    assert found_m == pytest.approx(hertz_m, rel=1e-6, abs=0.0)


def test_the_mean_foot_counts_each_foot_of_a_group(drive):
    layout = {'feet__count': (3, 1, 2), 'feet__gain': (1.0, 0.5, 0.0), 'feet__share': 0.3}
    machine = drive(**layout).start(level(300.0), [1e-4])
    mean_m = entry_point(mean_place)(machine.plant, machine.state)
    assert mean_m == pytest.approx((3.0 + 0.5) / 4.0 * STROKE_M, rel=SAME, abs=0.0)


def test_guides_are_no_driven_feet(drive):
    guided, foot_kg = LAYOUTS['guides'], 1e-3
    machine = drive(**guided, frame__mass=0.05, frame__resonance=2e3, actuator__mass=foot_kg)
    feet_kg = 4 * machine.parameters.actuator.foot_mass
    assert machine.plant.frame.feet_share == pytest.approx(feet_kg / 0.05, rel=1e-12)
    machine = drive(**guided, **STACKS).start(WAVE, [3.3e-3])
    truth = np.zeros((1, FORCE + 1))
    observe_samples(machine.plants, machine.states, WAVE, 0.0, 1e-5, truth, machine.ramps)
    driven_m = machine.state.places_m[1:5].mean()
    assert truth[0, FOOT] == pytest.approx(driven_m, rel=SAME)


def test_the_longest_step_follows_the_stiffest_foot():
    shares = {'feet.count': (1, 5), 'feet.share': (0.9, 0.02)}
    stand = Parameters().updated({**shares, 'actuator.resonance': 1e5, 'actuator.stiffness': 4e7})
    stiffest_n_per_m = max(each.stick_stiffness_n_per_m for each in contacts_of(stand))
    foot_per_s = np.sqrt(stiffest_n_per_m / stand.actuator.foot_mass)
    longest_s = longest_step_s(stand, all_contacts(stand), 0.0)
    assert longest_s == pytest.approx(PHASE_MAX / foot_per_s, rel=STICKS)


def test_a_guide_of_a_short_range_does_not_shorten_the_steps_of_falls(drive):
    zigzag = table([(k * 1e-6, 150.0 * (k % 2)) for k in range(201)])
    seen = {}
    for friction, dt_s in ((0.3, 5e-6), (0.003, 5e-6), (0.003, 6.25e-7)):
        guided = {**LAYOUTS['guides'], 'feet__friction': (0.3, friction)}
        machine = drive(**guided, sim__dt=dt_s, runner__mass=0.5, load_cell__contact='absent')
        seen[friction, dt_s] = machine.start(zigzag, [2e-4]).state
    dry, slippery, fine = seen.values()
    assert slippery.passes_made < 1.1 * dry.passes_made
    assert slippery.position_m == pytest.approx(fine.position_m, rel=1e-5, abs=0.0)


def test_a_guide_with_a_delay_is_a_guide():
    guided = {'feet.count': (4, 2), 'feet.gain': (1.0, 0.0)}
    late = Parameters().updated({**guided, 'feet.delay': (0.0, 1e-3)})
    assert plant_of(late) == plant_of(Parameters().updated(guided))


SMALL = 'is between 0 and 1e-06'
OVERFLOWS: dict[str, Any] = {'feet__count': (3, 3), 'feet__share': 0.5, 'feet__delay': (0.0, 0.05)}


def test_more_corners_than_are_remembered_are_refused_with_their_mend(drive):
    steep, fine = sawtooth(0.0, 300.0, 200e3, 0), sawtooth(0.0, 300.0, 100.0, 0)
    remedies: tuple[tuple[dict[str, Any], Any, dict[str, Any]], ...] = (
        (OVERFLOWS, steep, {'feet__delay': (0.0, 0.02)}),
        ({**OVERFLOWS, 'amplifier__resolution': 0.16}, fine, {'amplifier__resolution': 0.0}),
        (OVERFLOWS, steep, {}),
    )
    for values, wave, remedy in remedies:
        message = f'feet.delay spans more than {CORNERS} corners of the voltage; shorten it'
        with pytest.raises(StickSlipError, match=message):
            drive(**values).start(wave, [0.06])
        slower = wave if remedy else sawtooth(0.0, 300.0, 50e3, 0)
        drive(**(values | remedy)).start(slower, [0.06])


@pytest.mark.parametrize(
    ('values', 'message', 'remedy'),
    [
        ({'feet.count': (2, 2, 2)}, 'feet.share [0.7', {'feet.share': 0.5}),
        ({'feet.gain': (1.0, 1.0, 1.0)}, 'feet.gain [1', {'feet.gain': (1.0, 0.5)}),
        ({'feet.gain': (1.0, 1.0, 1.0)}, 'feet.gain [1', {'feet.gain': 0.5}),
        ({'feet.count': (9, 4)}, 'feet.count [9, 4] is above 12 feet', {'feet.count': (8, 4)}),
        ({'feet.count': (13, 4)}, 'feet.count 13 is above the maximum', {'feet.count': (8, 4)}),
        ({'feet.delay': (0.0, 1e-7)}, f'feet.delay 1e-07 s {SMALL} s', {'feet.delay': 1e-6}),
        ({'feet.delay': (0.0, 1e-7)}, f'feet.delay 1e-07 s {SMALL} s', {'feet.delay': 0.0}),
        ({'feet.delay': (0.0, 0.06)}, 'feet.delay 0.06 s is above', {'feet.delay': (0.0, 0.05)}),
        ({'feet.radius': 1e-8}, f'feet.radius 1e-08 m {SMALL} m', {'feet.radius': 1e-6}),
        ({'feet.young': 9.0}, 'feet.young 9 Pa is between 0 and 1000 Pa', {'feet.young': 1e3}),
        ({'feet.friction': 1e-5}, 'between 0 and 0.0001', {'feet.friction': (1e-4, 0.0)}),
        ({'feet.share': (0.0, 1.0)}, 'feet.share 0 is below', {'feet.share': (1e-6, 1.0)}),
        (
            {'stand.weight': True, 'feet.weight': 0.0},
            'stand.weight True is true, but no foot',
            {'feet.weight': (0.0, 0.1)},
        ),
        (
            {'feet.count': (2, 1), 'fault.dead_foot': 4},
            'fault.dead_foot 4 is above the number of feet, 3',
            {'fault.dead_foot': 3},
        ),
        ({'contact.law': 'coulomb', 'feet.gain': (1.0, 0.5)}, 'feet.gain [1', {'feet.gain': 1.0}),
        ({'contact.law': 'coulomb', 'feet.delay': 1e-3}, 'feet.', {'feet.delay': 0.0}),
        (
            {**LINES, 'feet.count': (2, 2, 2), 'feet.share': 0.5, 'feet.gain': (1.0, 0.5, 1.0)},
            'feet.gain [1',
            {'feet.gain': (1.0, 1.0, 0.5)},
        ),
    ],
    ids=str,
)  # fmt: skip
def test_feet_that_do_not_fit_together_are_refused_and_the_mend_works(values, message, remedy):
    with pytest.raises(OutOfRange) as caught:
        plant_of(Parameters().updated(values))
    assert message in str(caught.value)
    plant_of(Parameters().updated(values | remedy))
