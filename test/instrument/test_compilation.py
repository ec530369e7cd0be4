# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""All kernels of a stand are compiled before it runs, with reports of the progress."""

import json
import os
import sys
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import pytest
from bench_runs import MS
from processes import run_process

from stickslip_ros.drive import advance
from stickslip_ros.instrument import compilation, sensing
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.compilation import (
    KERNELS,
    REPORT_EVERY,
    RUNS_KERNELS,
    progress_reporter,
)
from stickslip_ros.instrument.reports import Result
from stickslip_ros.instrument.sensors import capacitive_probe, interferometer, load_cell
from stickslip_ros.kernels import cache as kernel_cache
from stickslip_ros.kernels.cache import Folders
from stickslip_ros.kernels.kernel import compilation_reported, entry_point, kernel
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.parameters import SENSORS, Parameters, load_yaml

REALISTIC = Path(__file__).parents[2] / 'config/realistic.yaml'
PACKAGE = Path(compilation.__file__).parents[1]
OWN_KERNELS = Path(__file__).with_name('kernels_of_stands.py')
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
    'stuck': {'fault.runner_stuck': True},
    'realistic': {},
}
REQUESTS = (
    Request('voltage', (100.0,)),
    Request('sawtooth', (200.0, 1000.0, 1.0)),
    Request('steps', (-1.0,)),
    Request('waveform', (0.0, 0.0, 1e-3, 100.0)),
    Request('position', (1e-7, 0.0, 0.0)),
    Request('preload', (0.4,)),
    Request('parameters', settings=(('contact.friction', 0.2), ('runner.mass', 0.012))),
    Request('load', (0.05, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Request('fault', settings=(('fault.dead_foot', 6),)),
    Request('fault', settings=(('fault.runner_stuck', True), ('fault.missed_steps', 0.5))),
    Request('clear_faults'),
    Request('enable_amplifier', (0.0,)),
    Request('reset'),
)
TYPES_KEPT = (
    (advance, 'observe_ideal'),
    (advance, 'observe_long'),
    (advance, 'observe'),
    (sensing, 'fill_times'),
    (interferometer, 'read_positions'),
    (load_cell.LoadCell, 'KERNEL'),
    (capacitive_probe.CapacitiveProbe, 'KERNEL'),
)


def parameters_of(name: str) -> Parameters:
    parameters = load_yaml(REALISTIC) if name == 'realistic' else Parameters()
    return parameters.updated(STANDS[name])


@pytest.fixture(scope='module')
def own_kernels(compiled_kernels: None) -> dict[str, Any]:
    """Return what each stand loads of the disk: by ``compile_for``, and later."""
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    done = run_process([sys.executable, OWN_KERNELS], env=environment, check=True)
    stands = map(json.loads, done.stdout.splitlines())
    return {name: own for stand in stands for name, own in stand.items()}


@pytest.mark.parametrize('name', STANDS)
def test_a_stand_compiles_nothing_after_its_own_kernels(name, own_kernels):
    own = own_kernels[name]
    assert own['late'] == []
    assert own['can_do_all'] == ('observe' in own['before'])
    assert own['can_do_all'] == (own['further'] == 0)


def test_an_ideal_stand_is_spared_the_kernels_of_short_steps(own_kernels):
    is_ideal = {name for name, own in own_kernels.items() if not own['can_do_all']}
    assert is_ideal == {'default', 'smooth', 'rough line', 'travelling', 'walls', 'lugre'}
    assert 'observe_ideal' in own_kernels['default']['before']


@pytest.mark.parametrize('name', STANDS)
def test_no_stand_compiles_anything_once_the_kernels_are_compiled(name, compiled_kernels):
    compiled: list[int] = []
    with compilation_reported(compiled.append):
        bench = Bench(parameters_of(name))
        results: Counter[Result] = Counter()
        for number, request in enumerate(REQUESTS, start=1):
            results.update(each.result for each in bench.update(number * MS, [request]).events)
    assert compiled == []
    assert abs(bench.ledger.residual_j) < 1.0
    # Coulomb's law has no feet of different force, and separate feet no such law; roughness that
    # travels keeps preload and friction.
    assert results[Result.INVALID_PARAMETER] <= {'coulomb': 1, 'travelling': 2}.get(name, 0)


@pytest.fixture
def signatures(monkeypatch) -> dict[str, set[Any]]:
    """Note with which types each entry point is called whose types are kept."""
    noted: dict[str, set[Any]] = defaultdict(set)

    def noting(entry: Any) -> Any:
        def call(*arguments: Any) -> Any:
            types = map(entry.__wrapped__.typeof_pyval, arguments)
            noted[entry.__name__].add(tuple(types))
            return entry(*arguments)

        return call

    for owner, name in TYPES_KEPT:
        entry = noting(getattr(owner, name))
        is_class = isinstance(owner, type)
        monkeypatch.setattr(owner, name, staticmethod(entry) if is_class else entry)
    return noted


def test_entry_points_with_kept_types_are_called_with_no_others(signatures, compiled_kernels):
    every_sensor = {row.switch: True for row in SENSORS if row.switch}
    for name in ('default', 'lugre', 'realistic'):
        bench = Bench(parameters_of(name).updated(every_sensor))
        for request in REQUESTS:
            bench.update(bench.time_ns + MS, [request])
        bench = Bench.restore(bench.save())
        for _ in range(2):
            bench.update_blocks(20)
    simulate(voltage_v=20.0, steps=2, record=False)
    sources = [path.read_text(encoding='utf-8') for path in PACKAGE.rglob('*.py')]
    assert len(signatures) == sum(each.count('\n@with_types_kept\n') for each in sources)
    assert {name: len(each) for name, each in signatures.items() if len(each) > 1} == {}


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
    assert lines == [f'compiling kernels, once: {done} of at most {kernels}' for done in (0, 1)]


def test_the_progress_is_not_reported_too_often():
    lines: list[str] = []
    tell = progress_reporter(lines.append)
    for done in range(KERNELS):
        tell(done)
    assert len(lines) == -(-KERNELS // REPORT_EVERY)
