# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What to measure next: a second preload, and the errors that it then really has."""

from dataclasses import replace

import numpy as np
import pytest
from fit_cases import EXACT, TRUTH, exact_points
from spring_rig import Rig
from test_fit_of_traces import NAMES, experiment

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Voltage
from stickslip_ros.lab.fitting.fit import FitOptions, fit, fit_experiments
from stickslip_ros.lab.fitting.free import choose_free
from stickslip_ros.lab.fitting.plan import plan
from stickslip_ros.parameters import Parameters

AGREES = 1.5
"""Factor within which errors that are expected are those of a fit to what was then measured."""


def test_a_second_preload_comes_first_and_has_the_errors_that_were_expected():
    rig = Rig(preload_n=0.35, friction=0.24, prefactor=5.2e-4, mass_kg=3.4e-3)
    stand = Parameters().updated({'runner.damping': rig.damping_n_s_per_m})
    free = [name for name in NAMES if name != 'runner.damping']
    first = experiment(rig, 1)
    exact = FitOptions(starts=1, assume=EXACT)
    known = fit(first, free, parameters=stand, options=exact)
    planned = plan(known, 3)
    assert planned.names == tuple(free)
    best = planned.chosen[0]
    assert best.experiment is not None
    preload_n = float(best.experiment.settings['stand.preload'])
    assert abs(preload_n / rig.preload_n - 1.0) > 0.4
    assert best.commands[0] == f'preload {preload_n:g}N'
    assert planned.errors[0, 0] < 0.5 * planned.errors_now[0]  # of the friction
    assert np.all(np.diff(planned.errors, axis=0) <= 1e-12)
    drive = best.experiment.drive
    assert isinstance(drive, Voltage)
    measured = experiment(replace(rig, preload_n=preload_n), 2, drive.rows)
    both = fit([first, measured], free, parameters=stand, options=exact)
    pairs = zip(both.estimates, known.estimates, strict=True)
    ratios = planned.errors[0] / [one.standard_error / before.value for one, before in pairs]
    assert np.all((ratios > 1.0 / AGREES) & (ratios < AGREES))


def test_numbers_are_planned_too_and_a_count_that_is_none_is_refused():
    truth = Parameters().updated(TRUTH)
    stand, free, _ = choose_free(truth, list(TRUTH))
    known = fit_experiments(stand, free, exact_points(truth), options=FitOptions(starts=1))
    planned = plan(known, 2)
    assert all(each.commands[1].startswith('sawtooth ') for each in planned.chosen)
    assert np.all(planned.errors[1] < planned.errors_now)
    with pytest.raises(StickSlipError, match='number of measurements 0 is not from 1 to 20'):
        plan(known, 0)
