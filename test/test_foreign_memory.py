# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""No result holds memory that was never written: with NaN in fresh memory it is the same."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from stickslip_ros import (
    Bench,
    Parameters,
    Request,
    linearise,
    measure_response,
    run_drive,
    simulate,
)
from stickslip_ros.lab.design.steady_cycle import measure
from stickslip_ros.lab.runs.courses import run_course

PROBED = Parameters(), Parameters().updated({'capacitive_probe.enabled': True})
WAVE = np.array([[0.0, 0.0], [1e-3, 300.0], [1.01e-3, 0.0]])


def readings_of(parameters: Parameters) -> list[Any]:
    """Return all numbers of the output of a bench."""
    bench, blocks = Bench(parameters), []
    for requests in ([Request('sawtooth', (300.0, 1e3, 0.0))], [], []):
        output = bench.update(bench.time_ns + parameters.block_ns, requests)
        blocks += [output.readings.truth, output.readings.trace, output.ramps]
    return blocks


RESULTS: dict[str, Callable[[], Any]] = {
    'bench': lambda: readings_of(PROBED[0]),
    'bench with a probe': lambda: readings_of(PROBED[1]),
    'run': lambda: run_drive(PROBED[0], 60e-9, 500.0, 5),
    'simulate': lambda: simulate(PROBED[0], waveform=WAVE, record=False).result.step_scatter_m,
    'linearise': lambda: linearise(PROBED[0]).matrix(np.array([100.0, 1e3])),
    'response': lambda: measure_response(PROBED[0], [1e3], workers=1).softening,
    'cycle': lambda: run_course(measure(PROBED[0], WAVE)).trace(),
}


@pytest.fixture
def poisoned(monkeypatch):
    empty = np.empty

    def full_of_nan(shape: Any, dtype: Any = float, **options: Any) -> Any:
        fresh = empty(shape, dtype, **options)
        if fresh.dtype == float:
            fresh.fill(np.nan)
        return fresh

    return lambda: monkeypatch.setattr(np, 'empty', full_of_nan)


@pytest.mark.parametrize('name', RESULTS)
def test_a_result_is_the_same_with_nan_in_fresh_memory(name, poisoned):
    before = RESULTS[name]()
    poisoned()
    np.testing.assert_equal(RESULTS[name](), before)
