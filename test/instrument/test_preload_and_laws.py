# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The preload changes while the drive runs, and every friction law drives the bench."""

from typing import Any

import numpy as np
import pytest
from bench_runs import PERFECT, load

from stickslip_ros.contact.springs import friction_limit
from stickslip_ros.drive.records import FORCE, POSITION
from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Result, Status
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.runs.sawtooth_run import simulate, voltage_for
from stickslip_ros.parameters import Parameters, specs

friction_limit = entry_point(friction_limit)

LAWS = specs()['contact.law'].choices
PROFILES = specs()['contact.profile'].choices
FALL = Request('sawtooth', (300.0, 1000.0, 0.0))
# The ledger's error bound at the default step, relative to the work of the feet.
ENERGY_RESIDUAL = 1e-3
# Two ways of the same contact, one with 64 springs per group: see bank.BANK_ERROR.
BANK_TOLERANCE = 3e-3


def ran(stand: Parameters, **how: Any) -> SawtoothRun:
    """Return the result of a run without a recording."""
    return simulate(stand, **how, record=False).result


def quiet(**values):
    names = {name.replace('__', '.'): value for name, value in values.items()}
    return Parameters().updated({**PERFECT, **names})


def advance(bench, blocks, requests=()):
    outputs = []
    for _ in range(blocks):
        outputs.append(bench.update(bench.time_ns + bench.parameters.block_ns, requests))
        requests = ()
    return outputs


def test_a_preload_command_goes_there_at_its_rate_and_ends_with_an_event():
    bench = Bench(quiet(stand__preload=0.5, stand__preload_rate=10.0))
    outputs = advance(bench, 1, [Request('preload', (0.8,))])
    assert outputs[-1].status & Status.PRELOADING
    assert bench.state.preload_n == pytest.approx(0.51, rel=1e-9)
    outputs += advance(bench, 30)
    events = [event for output in outputs for event in output.events]
    assert [(e.command, e.result, e.time_ns) for e in events] == [
        ('preload', Result.DONE, 30_000_000)
    ]
    assert bench.state.preload_n == 0.8
    assert not outputs[-1].status & Status.PRELOADING


def test_the_force_does_not_jump_when_the_springs_take_over_or_hand_back():
    bench = Bench(quiet(stand__preload=0.2, stand__preload_rate=5.0))
    advance(bench, 50, [FALL])
    before_n = bench.state.contact_n
    bench.accept(Request('preload', (0.2000001,)))
    assert bench.state.contacts[0].on_springs
    advance(bench, 1)
    assert not bench.state.contacts[0].on_springs, 'a full slip must have handed back'
    twin = Bench(quiet(stand__preload=0.2, stand__preload_rate=5.0))
    advance(twin, 50, [FALL])
    assert twin.state.contact_n == before_n
    advance(twin, 1)
    limit_n = friction_limit(bench.plant.contacts[0].bank, 0.2)
    difference_n = bench.state.contact_n - twin.state.contact_n
    assert abs(difference_n) <= BANK_TOLERANCE * limit_n


def test_a_ramp_from_the_start_ends_like_a_run_at_the_final_preload():
    # Every fall slips fully at 0.25 N and below, so nothing of the way there is remembered.
    ramped = quiet(stand__preload=0.1, stand__preload_end=0.25, stand__preload_rate=5.0)
    plain = quiet(stand__preload=0.25)
    forces_n = [ran(p, voltage_v=300.0, steps=400).force_mean_n for p in (ramped, plain)]
    assert forces_n[0] == pytest.approx(forces_n[1], rel=1e-6)


@pytest.mark.parametrize('end_n', [0.1, 0.6, 1.5])
@pytest.mark.parametrize('damping', [0.0, 80.0])
def test_energy_balances_while_the_preload_changes(end_n, damping):
    parameters = quiet(stand__preload=0.5, stand__preload_end=end_n, runner__damping=damping)
    run = ran(parameters, voltage_v=300.0, steps=300)
    assert abs(run.energy_residual) < ENERGY_RESIDUAL


@pytest.mark.parametrize('law', LAWS)
def test_energy_balances_for_every_law_and_the_residual_falls_with_the_step(law):
    residuals = [
        abs(ran(quiet(contact__law=law, sim__dt=dt), voltage_v=300.0, steps=100).energy_residual)
        for dt in (1e-6, 5e-7)
    ]
    assert residuals[1] < ENERGY_RESIDUAL
    assert residuals[1] < residuals[0]


@pytest.mark.parametrize(
    ('law', 'profile'),
    [(law, PROFILES[0]) for law in LAWS] + [(LAWS[0], profile) for profile in PROFILES[1:]],
)
def test_no_law_gives_more_force_than_friction_allows(law, profile):
    parameters = quiet(contact__law=law, contact__profile=profile, stand__preload=0.1)
    bench = Bench(parameters)
    outputs = advance(bench, 100, [FALL])
    force_n = np.concatenate([output.readings.trace[:, FORCE] for output in outputs])
    limit_n = 0.3 * 2.0 * np.sqrt(2.0) * 0.1
    mean_n = np.mean(force_n[-500:])
    assert 0.3 * limit_n < mean_n <= limit_n


def test_coulomb_friction_holds_the_runner_still_under_a_load_below_its_limit():
    bench = Bench(quiet(contact__law='coulomb', load_cell__contact='absent'))
    outputs = advance(bench, 50, [load(0.2)])
    position_m = np.concatenate([output.readings.trace[:, POSITION] for output in outputs])
    # It cannot know the force before the first step: half a step of free flight.
    first_step_m = 0.2 / 3e-3 * (5e-7) ** 2
    assert np.all(np.abs(position_m) <= first_step_m)
    assert np.ptp(position_m[10:]) < 1e-18


def test_coulomb_friction_lets_go_above_its_limit():
    bench = Bench(quiet(contact__law='coulomb', load_cell__contact='absent'))
    advance(bench, 10, [load(0.5)])
    excess_n = 0.5 - friction_limit(bench.plant.contacts[0].bank, 0.5)
    expected_m = 0.5 * excess_n / 3e-3 * 0.01**2
    # Velocity Verlet is exact for a constant force but for its first step.
    assert bench.state.position_m == pytest.approx(expected_m, rel=2e-3)


def test_the_contact_model_has_no_drift_below_its_zero_amplitude_where_dahl_walks():
    def step_m(law):
        parameters = quiet(contact__law=law, load_cell__contact='absent')
        voltage_v = voltage_for(parameters, 40e-9)
        return ran(parameters, voltage_v=voltage_v, frequency_hz=200.0, steps=200).step_length_m

    assert abs(step_m('mdr')) < 1e-12
    assert step_m('dahl') > 1e-9


def test_reset_brings_the_first_preload_back():
    bench = Bench(quiet(stand__preload_rate=1000.0))
    advance(bench, 5, [FALL, Request('preload', (1.0,))])
    advance(bench, 1, [Request('reset')])
    again = advance(bench, 20, [FALL])
    fresh = advance(Bench(quiet(stand__preload_rate=1000.0)), 20, [FALL])
    for one, other in zip(again, fresh, strict=True):
        assert np.array_equal(one.readings.trace[:, 1:], other.readings.trace[:, 1:])


@pytest.mark.parametrize(
    ('value', 'said'),
    [
        (0.0, 'below the 0.001 N'),
        (-1.0, 'below the 0.001 N'),
        (2.5, 'raise stand.preload_limit'),
        (float('nan'), 'finite'),
    ],
)
def test_a_preload_out_of_range_is_refused_and_changes_nothing(value, said):
    bench = Bench(quiet())
    (output,) = advance(bench, 1, [Request('preload', (value,))])
    (event,) = output.events
    assert event.result is Result.INVALID_PARAMETER
    assert said in event.message
    assert bench.state.preload_n == 0.5
    assert not bench.state.contacts[0].on_springs


def test_a_motion_that_is_no_longer_finite_is_told_instead_of_published():
    bench = Bench(quiet())
    bench.state.velocity_m_per_s = float('nan')
    with pytest.raises(StickSlipError, match=r'no longer finite, .*; lower sim\.dt'):
        advance(bench, 1)
