# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rigs of each stage, made of springs, are learned from a recording with the file of the stage."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from stage_rig import GRAVITY, STEP_S, Foot, StageRig, waves

from stickslip_ros import load_yaml, stage_file
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, SawtoothSteps
from stickslip_ros.lab.experiments.predict import predict_all
from stickslip_ros.lab.fitting.fit import FitOptions, fit
from stickslip_ros.parameters import Parameters

RATE_HZ, SLEW_V_PER_S = 50e3, 150e6
FREE = 'friction', 'prefactor', 'mass_kg', 'damping_n_s_per_m', 'gain_m_per_v'
NAMES = (
    *('contact.friction', 'contact.prefactor', 'runner.mass', 'runner.damping'),
    'actuator.gain',
)
HERTZ = {'clamp': 400.0, 'heavy': 120.0, 'rod': 400.0, 'three_balls': 120.0, 'walker': 80.0}
DRAWS, RUN, STEPS = 400, 20, 12
"""Draws, whose median errs by a sixteenth of their spread; those that are run, and their steps."""
STEP_SHARE = 3e-3  # least allowed error of a step


def rig_of(stage: str, on: Parameters) -> StageRig:
    """Give a rig whose values are off those of its file."""
    feet, mass_kg = on.feet, 1.4 * on.runner.mass
    weight_n = mass_kg * GRAVITY * on.stand.weight
    names = 'share', 'weight', 'count', 'gain', 'delay', 'friction', 'young'
    groups = zip(*(getattr(feet, each) for each in names), strict=True)
    return StageRig(
        tuple(
            Foot(share * on.stand.preload + weight * weight_n, *others)
            for share, weight, *others in groups
        ),
        radius_m=on.contact.radius,
        friction=0.26,
        prefactor=3.7e-4,
        mass_kg=mass_kg,
        damping_n_s_per_m=1.5 * on.runner.damping,
        gain_m_per_v=1.1 * on.actuator.gain,
        load_n=on.stand.load,
        moduli_pa=(on.contact.young_sphere, on.contact.young_runner),
    )


@pytest.mark.parametrize(
    'stage',
    [
        *('clamp', 'rod', 'three_balls'),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ('heavy', 'walker')),
    ],
)
def test_draws_lie_around_the_fitted_stand_and_steps_of_a_rig_in_their_bands(stage: str):
    on = load_yaml(stage_file(stage))
    rig, low_v, hertz = rig_of(stage, on), on.amplifier.voltage_min, HERTZ[stage]
    range_v = on.amplifier.voltage_max - low_v
    parts = (-0.2, 0.9, 1), (-0.6, 0.8, 1), (0.9, 1.0, 3), (1.0, 2.0, 3)
    rows = waves(
        *((share * range_v, by * hertz, count) for share, by, count in parts),
        slew_v_per_s=SLEW_V_PER_S,
        low_v=low_v,
    )
    columns = zip(('time_s', 'voltage_v', 'position_m'), rig.recorded(rows, RATE_HZ), strict=True)
    preloads_n = () if on.stand.weight else (on.stand.preload,)
    options = FitOptions(preloads_n=preloads_n, starts=1, workers=1)
    found = fit(pd.DataFrame(dict(columns)), list(NAMES), parameters=on, options=options)
    assert found.holds
    for one, name in zip(found.estimates, FREE, strict=True):
        assert abs(np.log(one.value / getattr(rig, name))) < 3.0 * one.standard_error / one.value
    draws = found.draws(DRAWS)
    for one in found.estimates:
        drawn = [float(each.flat()[one.name]) for each in draws]
        assert abs(np.median(drawn) - one.value) < 0.25 * np.std(drawn)
    volts, period_s = 0.75 * range_v, 1.0 / hertz
    rows = waves((volts, hertz, STEPS), slew_v_per_s=SLEW_V_PER_S, low_v=low_v)
    place_m, ends_s = rig.motion(rows, 1), rows[1, 0] + period_s * np.arange(STEPS + 1)
    step_m = np.diff(place_m[np.rint(ends_s[[-11, -1]] / STEP_S).astype(int)])[0] / 10.0
    drive = SawtoothSteps(0.0, hertz, STEPS, is_steady=False, voltage_v=volts)
    asked = Experiment('', {}, drive, (Readout('step_length_m', np.zeros(1)),))
    shown_m = [each.values[0] for [[each]] in predict_all(draws[:RUN], [asked])]
    middle_m, wide_m = np.mean(shown_m), np.hypot(np.std(shown_m), STEP_SHARE * step_m)
    assert abs(step_m - middle_m) < 2.0 * wide_m


@pytest.mark.parametrize(('stage', 'dry_n'), [('clamp', 0.09), ('three_balls', 0.005)])
def test_a_dry_guide_that_no_file_names_does_not_pass_in_silence(stage: str, dry_n: float):
    on = load_yaml(stage_file(stage))
    rig, hertz = replace(rig_of(stage, on), dry_n=dry_n), HERTZ[stage]
    range_v = on.amplifier.voltage_max
    parts = (-0.55 * range_v, hertz, 1), (0.93 * range_v, hertz, 3), (range_v, 2.0 * hertz, 4)
    rows = waves(*parts, slew_v_per_s=SLEW_V_PER_S, low_v=0.0)
    columns = zip(('time_s', 'voltage_v', 'position_m'), rig.recorded(rows, RATE_HZ), strict=True)
    found = fit(
        pd.DataFrame(dict(columns)), list(NAMES), parameters=on, options=FitOptions(starts=1)
    )
    assert not found.holds
    assert found.culprit is not None
    assert found.culprit.name == 'feet.guide_friction'
