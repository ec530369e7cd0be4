# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""All kernels of a stand are compiled before it runs, with reports of the progress."""

from collections import Counter
from pathlib import Path

import pytest
from bench_runs import MS

from stickslip_ros.instrument import compilation
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.compilation import (
    KERNELS,
    REPORT_EVERY,
    RUNS_KERNELS,
    progress_reporter,
)
from stickslip_ros.instrument.reports import Result
from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import Folders
from stickslip_ros.kernels.kernel import compilation_reported, entry_point, kernel
from stickslip_ros.parameters import Parameters, load_yaml

REALISTIC = Path(__file__).parents[2] / 'config/realistic.yaml'
STANDS: dict[str, dict[str, object]] = {
    'default': {},
    'smooth': {'contact.profile': 'smooth'},
    'rough line': {'contact.profile': 'rough_line'},
    'travelling': {'contact.profile': 'rough_line', 'contact.travel': 0.5},
    'lugre': {'contact.law': 'lugre'},
    'coulomb': {'contact.law': 'coulomb'},
    'feet': {'actuator.gain_tolerance': 0.1},
    'walls': {'load_cell.contact': 'one_sided', 'stand.stop_stiffness': 1e6},
    'preload': {'stand.preload_end': 0.3},
    'dead foot': {'fault.dead_foot': 2},
}
REQUESTS = (
    Request('voltage', (100.0,)),
    Request('sawtooth', (200.0, 1000.0, 1.0)),
    Request('steps', (-1.0,)),
    Request('waveform', (0.0, 0.0, 1e-3, 100.0)),
    Request('position', (1e-7, 0.0, 0.0)),
    Request('preload', (0.4,)),
    Request('load', (0.05, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Request('fault', settings=(('fault.dead_foot', 6),)),
    Request('fault', settings=(('fault.runner_stuck', True), ('fault.missed_steps', 0.5))),
    Request('clear_faults'),
    Request('enable_amplifier', (0.0,)),
    Request('reset'),
)


@pytest.mark.parametrize('name', [*STANDS, 'realistic'])
def test_no_stand_compiles_anything_once_the_kernels_are_compiled(name, compiled_kernels):
    parameters = load_yaml(REALISTIC) if name == 'realistic' else Parameters()
    compiled: list[int] = []
    with compilation_reported(compiled.append):
        bench = Bench(parameters.updated(STANDS.get(name, {})))
        results: Counter[Result] = Counter()
        for number, request in enumerate(REQUESTS, start=1):
            results.update(each.result for each in bench.update(number * MS, [request]).events)
    assert compiled == []
    assert abs(bench.ledger.residual_j) < 1.0
    # Coulomb's law has no feet of different force, and separate feet no such law; roughness that
    # travels keeps the preload.
    assert results[Result.INVALID_PARAMETER] <= (name in {'coulomb', 'travelling'})


def test_the_number_of_compiled_kernels_is_reported(monkeypatch):
    @kernel
    def twice(value):
        return 2.0 * value

    @entry_point
    def four_times(value):
        return twice(twice(value))

    monkeypatch.setattr(kernel_cache, 'cache_folders', lambda: Folders((), None))
    monkeypatch.setattr(compilation, 'REPORT_EVERY', 1)
    lines: list[str] = []
    with compilation_reported(progress_reporter(lines.append)):
        assert four_times(1.5) == 6.0
        assert four_times(2.5) == 10.0
    assert 'set NUMBA_CACHE_DIR' in lines.pop(0)
    kernels = KERNELS + RUNS_KERNELS
    assert lines == [f'compiling kernels, once: {done} of {kernels}' for done in (0, 1)]


def test_the_progress_is_not_reported_too_often():
    lines: list[str] = []
    tell = progress_reporter(lines.append)
    for done in range(KERNELS):
        tell(done)
    assert len(lines) == -(-KERNELS // REPORT_EVERY)
