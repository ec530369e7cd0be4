# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Steps on travelling roughness: dependence, mean, and energy balance."""

import numpy as np
import pytest

from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters

HERTZ = 200.0
WAVE = sawtooth(0.0, 280.0, HERTZ, 0)
STROKE_M = 280.0 * 160e-9 / 300.0
SMALL = sawtooth(0.0, 80.0, HERTZ, 0)
"""Below the 0-amplitude: nothing slips as a whole."""
TRAVELS = {'contact__profile': 'rough_line', 'contact__travel': 1.0}
FREE = {'load_cell__contact': 'absent', 'runner__damping': 40.0}
COARSE = {'contact__line_points': 1 << 15, 'contact__cutoff_upper': 2e7}
"""A quarter of the springs: 24 frozen lines have the same mean step to 0.1 %."""
STEADY = 20
"""Steps until the first ones are forgotten."""
RESIDUAL = 2e-5


def steps_of(machine, count, wave=WAVE):
    """Return the steps of a drive, m, shape (count - 1,)."""
    machine.start(wave, [(count + 0.5) / HERTZ])
    return np.diff(machine.ramps[:count, 2])


def correlation_length(values):
    """Return the number of steps over which a correlation falls to 1/e."""
    deviations = values - values.mean()
    products = np.correlate(deviations, deviations, 'full')[len(values) - 1 :]
    return int(np.argmax(products < products[0] / np.e))


def test_a_step_is_as_long_as_the_contact_says_where_it_is_made(drive):
    """Known answer: without rebound it is the stroke less 2 T_v^-1(T_max/2), physics.md."""
    count = 300
    machine = drive(**TRAVELS, **{**FREE, 'runner__damping': 150.0}, ramps=1)
    machine.start(WAVE, [])
    ends_m, expected_m, losses_j = [], [], []
    for _ in range(count):
        machine.run(WAVE, [1.0 / HERTZ])
        ends_m.append(float(machine.state.position_m))
        losses_j.append(machine.ledger.contact_lost_j)
        curve = machine.plant.contacts[ALL].curve
        half = np.interp(0.5 * curve.force_max_n, curve.cells[:, 0], np.arange(len(curve.cells)))
        expected_m.append(STROKE_M * (1.0 - HERTZ * 2e-6) - 2.0 * half * curve.core_m)
    steps_m, known_m = np.diff(ends_m)[STEADY:], np.array(expected_m)[STEADY + 1 :]
    assert steps_m.std() > 0.03 * steps_m.mean()
    assert np.corrcoef(steps_m, known_m)[0, 1] > 0.99
    assert steps_m.mean() == pytest.approx(known_m.mean(), rel=0.05)
    found, known = correlation_length(steps_m), correlation_length(known_m)
    assert found == pytest.approx(known, rel=0.1)
    assert np.all(np.diff(losses_j) > 0.0)
    assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.feet_work_j


def test_a_thousand_steps_have_the_mean_of_frozen_lines(drive):
    steps_m = steps_of(drive(**TRAVELS, **FREE, **COARSE, ramps=1000), 1000)[STEADY:]
    frozen_m = [
        steps_of(
            drive(**FREE, **COARSE, contact__profile='rough_line', contact__line_seed=1 + 6 * k),
            STEADY + 2,
        )[-1]
        for k in range(20)
    ]
    stretch = 2 * correlation_length(steps_m)
    means_m = [part.mean() for part in np.array_split(steps_m, len(steps_m) // stretch)]
    errors_m = [np.std(each, ddof=1) / len(each) ** 0.5 for each in (means_m, frozen_m)]
    assert max(errors_m) < 0.025 * steps_m.mean()
    assert abs(steps_m.mean() - np.mean(frozen_m)) < 2.0 * np.hypot(*errors_m)
    assert np.std(steps_m) == pytest.approx(np.std(frozen_m), rel=0.5)


def test_a_runner_that_never_slips_as_a_whole_stays_on_the_line_where_it_is(drive):
    travelling, frozen = (drive(**TRAVELS, **FREE) for _ in range(2))
    frozen.plant.track.on = False
    for machine in (travelling, frozen):
        machine.start(SMALL, [0.05])
    assert travelling.state.contacts[ALL].window_m == 0.0
    assert travelling.state.position_m == pytest.approx(frozen.state.position_m, rel=1e-9)


def test_a_smooth_profile_has_no_scatter(drive):
    flat = drive(**TRAVELS, **FREE, contact__rms_height=1e-16, contact__prefactor=0.0)
    smooth = drive(**FREE, contact__profile='smooth')
    steps_m, smooth_m = (steps_of(machine, 40)[STEADY:] for machine in (flat, smooth))
    assert flat.state.contacts[ALL].window_m > 1e-6
    assert np.ptp(steps_m) < 1e-6 * steps_m.mean()
    assert steps_m.mean() == pytest.approx(smooth_m.mean(), rel=1e-3)


@pytest.mark.parametrize(
    'changes', [{}, {'actuator__gain_tolerance': 0.02}, {'actuator__resonance': 150e3}]
)
def test_the_energy_balances_whatever_moves_the_windows(changes, drive):
    machine = drive(**TRAVELS, **FREE, **changes)
    steps_of(machine, 40)
    assert np.abs(machine.state.contacts['window_m']).max() > 2e-6
    assert abs(machine.ledger.residual_j) < RESIDUAL * machine.ledger.feet_work_j


def test_each_window_follows_its_own_foot(drive):
    machine = drive(**TRAVELS, **FREE, actuator__gain_tolerance=0.1)
    steps_of(machine, 20)
    windows_m = machine.state.contacts['window_m'][1:7]
    assert len(set(windows_m)) == 6
    assert np.ptp(windows_m) < 0.5 * windows_m.min()


def test_pieces_of_time_do_not_matter(drive):
    whole, pieces = (drive(**TRAVELS, **FREE) for _ in range(2))
    whole.start(WAVE, [0.05])
    pieces.start(WAVE, [0.01] * 5)
    assert pieces.state.position_m == pytest.approx(whole.state.position_m, rel=1e-6)
    assert pieces.state.contacts[ALL].window_m == pytest.approx(
        whole.state.contacts[ALL].window_m, rel=1e-6
    )


def test_the_closed_loop_arrives_on_roughness_that_travels():
    """It holds 5 um within the window of the loop although no two of its steps are alike."""
    changes = {name.replace('__', '.'): value for name, value in {**TRAVELS, **FREE}.items()}
    bench = Bench(Parameters().updated(changes))
    bench.accept(Request('position', (5e-6, 0.0, 0.0)))
    for _ in range(300):
        bench.update(bench.time_ns + bench.parameters.block_ns)
    assert bench.status & Status.IN_POSITION
    assert abs(bench.state.position_m - 5e-6) < 20e-9
    assert bench.state.contacts[ALL].window_m > 4e-6
