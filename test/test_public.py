# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The public Python interface: its names, its documentation and examples, and what they give."""

import ast
import doctest
import json
import re
import sys
from collections.abc import Iterator
from inspect import Signature, signature
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap_records import rewritten
from pandas.testing import assert_frame_equal
from processes import run_process

import stickslip_ros
from stickslip_ros import (
    CompareOptions,
    FitOptions,
    Parameters,
    Run,
    SpringContact,
    StickSlipError,
    compare,
    fit,
    open_run,
    run_drive,
    simulate,
    sweep,
)
from stickslip_ros.interface.cdr import pack_float64, pack_stamped
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.cli.main import main
from stickslip_ros.message_types import FLOAT64, WRENCH_STAMPED
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.units import unit_of

PUBLIC = vars(stickslip_ros)['PUBLIC']
ROOT = Path(stickslip_ros.__file__).parent
STUB = ast.parse((ROOT / '__init__.pyi').read_text())
PAGE = ROOT.parent / 'docs' / 'reference' / 'python.md'
REFERENCE = PAGE.with_name('api.md')
AMPLITUDE_M, FREQUENCY_HZ, STEPS = 113.76725643485543e-9, 1153.3955451232346, 8
HEAVY = ('numpy', 'numba', 'matplotlib', 'pandas', 'rclpy')


@pytest.fixture(scope='module')
def run() -> Run:
    return simulate(Parameters(), amplitude_m=AMPLITUDE_M, frequency_hz=FREQUENCY_HZ, steps=STEPS)


def typed_names() -> list[str]:
    """Return the public names of the stub, imported under their name or declared."""
    imported = [
        each for line in STUB.body if isinstance(line, ast.ImportFrom) for each in line.names
    ]
    declared = [each for each in STUB.body if isinstance(each, ast.ClassDef | ast.FunctionDef)]
    return [each.name for each in imported if each.asname == each.name] + [
        each.name for each in declared
    ]


def reading_calls() -> Iterator[tuple[str, Signature]]:
    """Yield the public functions and methods that read their arguments, by name in the stub."""
    for name in PUBLIC:
        public = getattr(stickslip_ros, name)
        calls = {name: public} if not isinstance(public, type) else {
            f'{name}.{each}': call for each, call in vars(public).items()
        }  # fmt: skip
        for each, call in calls.items():
            if getattr(call, 'checks_arguments', False):
                yield each, signature(call)


def test_types_and_documentation_name_what_is_public():
    rows = [line.split('|') for line in PAGE.read_text().splitlines() if line.startswith('| `')]
    listed = re.findall(r'`(\w+)', ''.join(row[1] for row in rows))
    explained = re.findall(r'`(\w+)`', ''.join(row[2] for row in rows))
    assert sorted(typed_names()) == sorted(PUBLIC)
    assert set(listed) <= set(PUBLIC) <= {*listed, *explained}
    assert vars(stickslip_ros)['__all__'] == [*PUBLIC]
    assert {*dir(stickslip_ros)} == {*PUBLIC, '__version__'}
    assert sorted(re.findall(r'auto\w+:: (\w+)', REFERENCE.read_text())) == sorted(PUBLIC)


def is_typed(name: str, annotation: str) -> bool:
    """Return whether an argument is a quantity, with the unit of its name, that may be typed."""
    return bool(unit_of(name)) and 'float' in annotation and 'numpy' not in annotation


def test_the_types_of_public_calls_take_typed_quantities_and_mappings_where_the_calls_do():
    declared = {each.name: each for each in STUB.body if isinstance(each, ast.FunctionDef)}
    for group in (each for each in STUB.body if isinstance(each, ast.ClassDef)):
        methods = [each for each in group.body if isinstance(each, ast.FunctionDef)]
        declared |= {f'{group.name}.{each.name}': each for each in methods}
    seen = set()
    for name, form in reading_calls():
        kinds = {each: str(argument.annotation) for each, argument in form.parameters.items()}
        quantities = {each for each, kind in kinds.items() if is_typed(each, kind)}
        stands = {each for each, kind in kinds.items() if re.search(r'\bParameters\b', kind)}
        if name not in declared:
            assert not quantities | stands, f'{name} has no types of its own'
            continue
        seen.add(name)
        arguments = declared[name].args
        several = [arguments.vararg] if arguments.vararg else []
        given = [*arguments.args, *several, *arguments.kwonlyargs]
        types = {each.arg: ast.unparse(each.annotation or ast.Name('')) for each in given}
        assert [*types] == [*form.parameters], name
        assert {each for each in types if '_Quantit' in types[each]} - {'values'} == quantities
        assert {each for each in types if '_Stand' in types[each]} == stands, name
        texts = [each and ast.unparse(each) for each in arguments.kw_defaults]
        texts = [*map(ast.unparse, arguments.defaults), *filter(None, texts)]
        defaults = [each.default for each in form.parameters.values()]
        own = [each for each in defaults if each is not Signature.empty]
        assert len(texts) == len(own), name
        for text, default in zip(texts, own, strict=True):
            assert text == '...' or ast.literal_eval(text) == default, name
    assert seen == {*declared}


def test_typed_quantities_and_a_mapping_are_a_call_that_a_type_checker_takes():
    given: dict[str, object] = {'stand.preload': 0.25}
    run = simulate(given, amplitude_m='60nm', frequency_hz='500Hz', steps=2, record=False)
    assert run.result.amplitude_m == pytest.approx(60e-9)
    assert run_drive(given, '60nm', '0.5kHz', 2, load_n='1mN').preload_n == 0.25
    assert SpringContact(given, '200mN').move(5e-9, 0.1) > 0.0
    assert CompareOptions(window_s=('1ms', '3ms'), shift_s='1us').window_s == (1e-3, 3e-3)


def test_an_unknown_name_is_refused_as_usual():
    with pytest.raises(AttributeError, match="'stickslip_ros' has no attribute 'sweeep'"):
        stickslip_ros.__getattr__('sweeep')


def test_the_package_alone_imports_nothing_heavy():
    code = f'import stickslip_ros, sys; print([n for n in {HEAVY} if n in sys.modules])'
    done = run_process([sys.executable, '-c', code], check=True)
    assert done.stdout.strip() == '[]'


def test_a_run_is_that_of_the_command_line(run: Run, capsys: pytest.CaptureFixture[str]):
    amplitude, frequency = f'--amplitude={AMPLITUDE_M!r}', f'--frequency={FREQUENCY_HZ!r}'
    assert main(['simulate', amplitude, frequency, f'--steps={STEPS}', '--json']) == 0
    other = json.loads(capsys.readouterr().out)
    assert run.force_mean_n == other['force_mean_n']
    assert run.step_length_m == other['step_length_m']
    assert run.parameters == Parameters()


def test_a_run_that_is_not_recorded_has_a_result_and_no_file(run: Run, tmp_path: Path):
    given: Any = {'amplitude_m': AMPLITUDE_M, 'frequency_hz': FREQUENCY_HZ, 'steps': STEPS}
    silent = simulate(**given, record=False)
    assert silent.force_mean_n == run.force_mean_n
    assert 'generated force, mean of the last cycle' in silent._repr_html_()
    assert repr(silent).endswith(' mN; not recorded)')
    with pytest.raises(StickSlipError, match='the run was not recorded; simulate with'):
        silent.save(tmp_path / 'run.mcap')


@pytest.mark.parametrize('given', [{}, {'amplitude_m': 60e-9, 'voltage_v': 300.0}])
def test_a_run_has_one_wave(given: Any):
    with pytest.raises(StickSlipError, match=r'[02] of amplitude_m, .* are given; give one'):
        simulate(Parameters(), **given)


def test_the_table_of_a_run_has_every_sample_and_its_unit(run: Run):
    frame = run.frame
    assert set(frame) == {'voltage_v', 'foot_m', 'position_m', 'force_n'}
    assert frame.attrs['units'] == {
        'time_s': 's', 'voltage_v': 'V', 'foot_m': 'm', 'position_m': 'm', 'force_n': 'N'
    }  # fmt: skip
    trace = run.recording.trace()
    np.testing.assert_array_equal(frame['force_n'], trace['force'].value)
    np.testing.assert_array_equal(frame.index, trace['force'].time_s)
    assert not frame.isna().any(axis=None)


def test_a_table_is_a_stretch_of_the_frame(run, monkeypatch, tmp_path):
    monkeypatch.setattr('stickslip_ros.lab.measurements.recorded.STRETCH_BYTES', 20_000)
    run = open_run(rewritten(run.path, tmp_path / 'run.mcap', chunk_size=9000))
    assert_frame_equal(run.table(), run.frame)
    assert_frame_equal(run.table((0.001, 0.004)), run.frame.loc[0.001:0.004])


def test_a_run_that_is_too_long_is_read_by_stretches(run, tmp_path, monkeypatch):
    monkeypatch.setattr('stickslip_ros.recording.reader.TRACE_ROWS_MAX', 300)
    path = run.save(tmp_path / 'long.mcap')
    with pytest.raises(StickSlipError, match=r'rows of /trace, above the 300 .* --window'):
        _ = open_run(path).frame
    with pytest.raises(StickSlipError, match='--window'):
        compare(path, path)
    inside = compare(path, path, options=CompareOptions(window_s=(0.001, 0.003)))
    assert inside.quantities[0].agreement.points == len(open_run(path).table((0.001, 0.003)))


def test_a_table_of_topics_has_gaps_where_one_of_them_is_silent(tmp_path: Path):
    channels = [Channel('/voltage', FLOAT64, Qos(1)), Channel('/force', WRENCH_STAMPED, Qos(1))]
    path = tmp_path / 'run.mcap'
    with Recorder(path, channels) as recorder:
        for time_ns in range(0, 4_000_000, 1_000_000):
            recorder.put('/force', time_ns, pack_stamped(time_ns, '', (0.5, 0, 0, 0, 0, 0)))
            if time_ns == 2_000_000:
                recorder.put('/voltage', time_ns, pack_float64(150.0))
    frame = open_run(path).frame
    assert list(frame['force_n']) == [0.5] * 4
    np.testing.assert_array_equal(frame['voltage_v'], [np.nan, np.nan, 150.0, np.nan])


def test_a_saved_run_is_opened_again(run: Run, tmp_path: Path):
    path = run.save(tmp_path / 'run.mcap')
    again = open_run(path)
    assert_frame_equal(again.frame, run.frame)
    with pytest.raises(StickSlipError, match='it exists'):
        run.save(path)
    with pytest.raises(StickSlipError, match='opened, not simulated'):
        _ = again.force_mean_n


def test_a_simulated_file_lives_as_long_as_its_run():
    short = simulate(Parameters(), amplitude_m=AMPLITUDE_M, steps=1)
    path = short.path
    assert path.exists()
    del short
    assert not path.exists()


def test_a_sweep_is_a_table_of_drives_alone():
    stand = Parameters().updated({'contact.friction': 0.25})
    amplitudes_m = np.array([50e-9, 113.76725643485543e-9])
    table = sweep(stand, {'stand.preload': [0.1, 0.5], 'amplitude_m': amplitudes_m}, steps=STEPS)
    assert isinstance(table, pd.DataFrame)
    assert list(table['preload_n']) == [0.1, 0.1, 0.5, 0.5]
    for _, row in table.iterrows():
        there = stand.updated({'stand.preload': row['preload_n']})
        alone = run_drive(there, row['amplitude_m'], 1000.0, STEPS)
        assert row['force_mean_n'] == alone.force_mean_n
    assert table.attrs['parameters'] == stand.flat()
    words: Any = {
        'contact.profile': ['rough', 'smooth'],
        'amplitude_m': 60e-9,
        'frequency_hz': -500,
    }
    table = sweep(stand, words, steps=STEPS)
    assert list(table['contact.profile']) == ['rough', 'smooth']
    assert set(table['frequency_hz']) == {-500.0}


def test_comparisons_take_runs_files_and_parameters(run: Run, tmp_path: Path):
    comparison = compare(run, run.save(tmp_path / 'run.mcap'))
    assert all(each.agreement.largest == 0.0 for each in comparison.quantities)
    assert '<h2>the two sides</h2>' in comparison.save(tmp_path / 'page.html').read_text()
    table = tmp_path / 'forces.csv'
    force_n = run_drive(Parameters(), 100e-9, 1000.0, STEPS).force_mean_n
    table.write_text(f'preload_n,amplitude_m,force_n\n0.5,100e-9,{force_n!r}\n')
    against = compare(table, Parameters(), options=CompareOptions(steps=STEPS))
    assert against.quantities[0].agreement.largest == pytest.approx(0.0, abs=1e-12)


def tables_in_words_of_a_lab(folder: Path, stand: Parameters) -> list[Path]:
    """Write forces of a stand at two preloads, a file each, under headers that tell little."""
    paths = []
    for preload_n in (0.1, 0.5):
        there = stand.updated({'stand.preload': preload_n})
        forces_n = [run_drive(there, each, 1000.0, STEPS).force_mean_n for each in (70e-9, 110e-9)]
        rows = [f'70;{1e3 * forces_n[0]!r}', f'110;{1e3 * forces_n[1]!r}']
        paths.append(folder / f'{preload_n}.csv')
        paths[-1].write_text('\n'.join(['A;CH2', *rows]))
    return paths


def test_files_that_tell_little_are_compared_and_fitted_with_what_is_said_of_them(tmp_path: Path):
    stand = Parameters().updated({'contact.friction': 0.25})
    paths = tables_in_words_of_a_lab(tmp_path, stand)
    said: Any = {
        'headers': {'amplitude_m': 'A (nm)', 'force_n': 'CH2 (mN)'},
        'preloads_n': [0.1, 0.5],
    }
    comparison = compare(paths, stand, options=CompareOptions(steps=STEPS, **said))
    agreement = comparison.quantities[0].agreement
    assert agreement.points == 4
    assert agreement.largest == pytest.approx(0.0, abs=1e-12)
    points = fit(paths, ['contact.friction'], options=FitOptions(starts=1, **said)).experiments
    assert [one.settings['stand.preload'] for one in points] == [0.1, 0.1, 0.5, 0.5]
    for read in (
        lambda: compare(paths[0], stand, options=CompareOptions(**said)),
        lambda: fit(paths[0], 'contact.friction', options=FitOptions(**said)),
    ):
        with pytest.raises(StickSlipError, match='above the number of tables, 1'):
            read()


def test_notebooks_show_tables_and_no_markup_of_names(run: Run):
    shown = Parameters().updated({'stand.preload': 0.25, 'frame_id.stage': '<b>'})._repr_html_()
    assert '<td>stand.preload</td><td>0.25</td><td>N</td>' in shown
    assert '&lt;b&gt;' in shown
    assert 'generated force, mean of the last cycle' in run._repr_html_()


FINDER = doctest.DocTestFinder(recurse=False)
NAMES = {name: getattr(stickslip_ros, name) for name in dir(stickslip_ros) if name[0] != '_'}
EXAMPLES = {
    name: test
    for name, public in NAMES.items()
    for test in FINDER.find(public, name, globs=dict(NAMES))
    if test.examples
}


@pytest.mark.parametrize('name', EXAMPLES)
def test_an_example_gives_what_it_says(name: str, capsys: pytest.CaptureFixture[str]):
    failed, tried = doctest.DocTestRunner().run(EXAMPLES[name])
    assert (failed, tried) == (0, len(EXAMPLES[name].examples)), capsys.readouterr().out


def test_most_of_what_computes_has_an_example():
    assert {'simulate', 'run_drive', 'sweep', 'presliding', 'linearise', 'Bench'} <= {*EXAMPLES}
