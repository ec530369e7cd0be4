# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The example that ranks measurements: another preload, and the errors that it then has."""

import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

EXAMPLE = Path(__file__).parents[3] / 'docs' / 'examples' / 'next_measurement.py'
AGREES = 1.05
"""Factor between expected errors and those of a fit to what was then measured."""


@pytest.mark.usefixtures('compiled_kernels')
def test_the_first_of_the_ranked_measurements_leaves_the_errors_that_were_expected(capsys):
    example = runpy.run_path(str(EXAMPLE))
    fitted, ranking = example['main']()
    errors, (preload_n, voltage_v) = ranking[0]
    assert preload_n > 0.7  # the fit is of 0.35 N
    assert f'{preload_n:g} N, {voltage_v:g} V leave errors' in capsys.readouterr().out
    pairs = [(0.35, volts) for volts in (200.0, 250.0, 300.0)] + [(preload_n, voltage_v)]
    both = example['fit_steps'](
        pd.concat([example['measured'](example['FREE'], [each]) for each in pairs])
    )
    found = np.sqrt(np.diag(both.covariance)) / [one.value for one in both.estimates]
    assert np.abs(np.log(errors / found)).max() < np.log(AGREES)
    before = np.sqrt(np.diag(fitted.covariance)) / [one.value for one in fitted.estimates]
    assert np.all(errors < 0.5 * before)
