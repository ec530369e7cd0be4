# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Mistakes of a scientist in Python: what was meant is done, or the refusal says what to write."""

import inspect
import pickle
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

import stickslip_ros
from stickslip_ros import Parameters, Run, StickSlipError, simulate

AMPLITUDE_M = 113.76725643485543e-9
COLUMNS = {'preload_n': [0.5, 0.5], 'amplitude_m': [70e-9, 110e-9], 'force_n': [0.05, 0.1]}


@pytest.fixture(scope='module')
def names() -> dict[str, Any]:
    """Return the names that a mistake may use; ``parameters`` is a stand."""
    found = {name: getattr(stickslip_ros, name) for name in vars(stickslip_ros)['PUBLIC']}
    run = simulate(amplitude_m=AMPLITUDE_M, steps=3)
    stand = Parameters()
    found |= {'run': run, 'parameters': stand, 'stand': stand, 'columns': COLUMNS, 'np': np}
    return {**found, 'table': pd.DataFrame(COLUMNS), 'drive': found['linearise'](stand)}


# fmt: off
MEANT = {
    # units as they are typed to the shell, and numbers of other types
    "simulate(stand, amplitude_m='100nm', steps=3).result.amplitude_m": 1e-7,
    "simulate(stand, voltage_v='300V', steps=np.int64(2)).result.steps": 2,
    "simulate(stand, amplitude_m=1e-7, frequency_hz='0.5kHz', steps=2).result.frequency_hz": 500.0,
    "simulate(stand, amplitude_m=1e-7, steps='5').result.steps": 5,
    "run_drive(stand, '100nm', '500Hz', '3', load_n='10mN').steps": 3,
    "presliding(stand, normal_force_n='100mN').indentation.normal_force_n": 0.1,
    "linearise(stand, at_voltage_v='0.1kV').at_voltage_v": 100.0,
    "FitOptions(preloads_n='250mN').preloads_n": (0.25,),
    "FitOptions(preloads_n=[0.1, '0.5N'], window_s=['2ms', 4e-3]).window_s": (2e-3, 4e-3),
    "CompareOptions(shift_s='2ms').shift_s": 2e-3,
    "Request('voltage', 5.0).values": (5.0,),
    "Request('voltage', '10V').values": (10.0,),
    "Request('sawtooth', (300, '0.5kHz', 10)).values": (300, 500.0, 10),
    "Request('waveform', ['0s', '0V', '1ms', '0.1kV']).values": (0.0, 0.0, 1e-3, 100.0),
    # mappings as parameters and as a table
    "simulate({'stand.preload': '250mN'}, amplitude_m=1e-7, steps=2).parameters.stand.preload":
        0.25,
    "Bench({'stand.preload': 0.25}).parameters.stand.preload": 0.25,
    "compare(columns, {'contact.hurst': 0.7}, options=CompareOptions(steps=5)).axis":
        'amplitude_m',
    "len(fit(columns, 'contact.friction', options=FitOptions(starts=1, steps=5)).experiments)": 2,
    "len(measure_response(stand, ['1kHz', 2e3]).frequency_hz)": 2,
}
REFUSED = {
    # arguments
    'simulate(stand, 1e-7)': 'did you mean one of parameters, amplitude_m, voltage_v',
    'simulate(stand, amplitude=1e-7)': 'did you mean amplitude_m?',
    'simulate(stand, amplitude_m=1e-7, frequency=500)': 'did you mean frequency_hz?',
    'simulate(stand, amplitude_m=1e-7, frequncy_hz=500)': 'did you mean frequency_hz?',
    'simulate(stand, amplitude_m=1e-7, n_steps=5)': 'did you mean steps?',
    'simulate(stand, amplitude_m=1e-7, preload=0.25)': "updated({'stand.preload': 0.25})",
    'simulate(stand, amplitude_m=1e-7, preload_n=0.25)': "updated({'stand.preload': 0.25})",
    "simulate(stand, amplitude_m=1e-7, **{'stand.preload': .25})": "({'stand.preload': 0.25})",
    'presliding(stand, 0.1)': 'did you mean one of parameters, normal_force_n?',
    'presliding(stand)': "missing a required .*argument: 'normal_force_n'",
    'run_drive(stand)': "missing a required argument: 'amplitude_m'",
    'force_onset_m(stand)': "missing a required argument: 'frequency_hz'",
    'FitOptions(start=3)': 'did you mean starts?',
    "Free('contact.friction', bounds=(0.1, 0.5))": 'name, start, low, high, known',
    'fit(run)': 'did you mean one of experiments, free, parameters',
    # parameters
    'Parameters(preload=0.25)': "Parameters().updated({'stand.preload': 0.25})",
    'Parameters(stand_preload=0.25)': "Parameters().updated({'stand.preload': 0.25})",
    "Parameters({'stand.preload': 0.25})": "Parameters().updated({'stand.preload': 0.25})",
    'Parameters(friction=0.3)': "Parameters().updated({'contact.friction': 0.3})",
    "Parameters(stand={'preload': 0.25})": "Parameters().updated({'stand.preload': 0.25})",
    "stand.updated({'preload': 0.25})": 'did you mean stand.preload',
    "stand.updated({'stand': {'preload': 0.25}})": 'did you mean .*stand.preload',
    'stand.updated({0: 0.25})': "'0' is not known",
    "stand.updated({'stand.preload': [0.1, 0.5]})": 'not a finite number',
    "setattr(stand.stand, 'preload', 0.2)": "parameters.updated({'stand.preload': 0.2})",
    "setattr(stand.stand, 'prelaod', 0.2)": 'did you mean stand.preload',
    'simulate(table, amplitude_m=1e-7)': '<DataFrame> is not Parameters; write .* fit tables',
    'simulate(1e-7)': "is not Parameters; write Parameters().updated({'stand",
    "simulate('config/realistic.yaml', amplitude_m=1e-7)": 'load_yaml reads files',
    'draw_stand(table)': 'is not Parameters or Run',
    'compare(table, stand, draws=100)': 'draws 100 is not Parameters',
    # numbers
    "simulate(stand, amplitude_m='100nN')": "'100nN' is not a number in nm, um, mm or m; .*60nm",
    'simulate(stand, amplitude_m=100)': '100 nm is 1e-07 m',
    'simulate(stand, amplitude_m=[1e-7, 2e-7])': 'not a finite number; give a number such as',
    'simulate(stand, amplitude_m=1e-7, steps=5.5)': 'steps 5.5 is not a whole number',
    'simulate(stand, amplitude_m=1e-7, record=5)': 'record 5 is not str or Path or bool',
    "simulate(stand, waveform={'t': [0, 1]})": 'not a finite number',
    "Request('voltage', '10nm')": "'10nm' is not a number in mV, V or kV",
    # names of parameters to fit or to sweep
    "fit(run, 'contact.fricton')": 'did you mean contact.friction',
    "fit(run, {'contact.friction': (0.1, 0.5)})": 'is not str or Free or Sequence',
    'Free(0.3)': 'name 0.3 is not a text',
    "sweep(stand, {'amplitude': [6e-8]})": 'give amplitude_m, the stroke in m',
    'sweep(stand, amplitude_m=[6e-8])': 'did you mean one of parameters, values, steps',
    "FitOptions(window_s='2ms')": "write window_s=('2ms', '4ms')",
    "sweep(stand, {'amplitude_m': 6e-8, 'preload': 0.1})": 'did you mean stand.preload',
    # files and tables
    "open_run('nope.mcap')": 'nope.mcap: it cannot be opened .*check the name',
    'open_run(5)': 'data 5 is not a table .*give a path, a Run, a DataFrame or',
    'open_run(table)': 'is by amplitude and has no times; use compare or fit',
    "load_yaml('nope.yaml')": 'nope.yaml: cannot be read .*check the path',
    "load_yaml({'stand.preload': 0.25})": 'is not str or Path',
    "fit('nope.csv', 'contact.friction')": 'nope.csv: cannot be read .*check the path',
    "fit(3, 'contact.friction')": '3 is not a table .*give a path, a Run, a DataFrame or',
    'compare(np.eye(3), stand)': "columns have names; write {'time_s': rows",
    'stand.updated(stand_preload=0.2)': "updated({'stand.preload': 0.2})",
    'compare(stand, columns)': 'is not a table',
    "compare({'time_s': [0, 1], 'position_m': [0]}, stand)": 'columns of one length',
    # results
    "run.plot('position_m')": "start_s 'position_m' is not a number in us, ms or s",
    'run.position_m': "did you mean run.frame['position_m']",
    "run.save('x.docx')": 'ends with .mcap; end its name so',
    "simulate(voltage_v=300.0, steps=1, record='x.docx')": 'ends with .mcap; end its name so',
    "compare(run, run).save('x.docx')": 'ends with .html; end its name so',
    'run.save(run.path)': 'it exists',
}
# fmt: on


@pytest.mark.parametrize('written', MEANT)
def test_what_is_meant_is_done(written: str, names: dict[str, Any]):
    assert eval(written, names) == pytest.approx(MEANT[written])


@pytest.mark.parametrize('written', REFUSED)
def test_a_mistake_is_answered_with_what_to_write(written: str, names: dict[str, Any]):
    with pytest.raises(StickSlipError) as refusal:
        eval(written, names)
    words = re.escape(REFUSED[written]).replace(r'\.\*', '.*').replace(r'\ ', ' ')
    text = str(refusal.value)
    assert re.search(words, text, re.DOTALL), text
    if right := re.search(r'(?:did you mean|write) ((?:parameters = )?[\w.]+\(.*\))', text):
        call = right[1].removeprefix('parameters = ')
        eval(call, {**names, 'free': 'contact.friction', 'experiments': COLUMNS})


def test_a_missing_folder_is_named_and_not_made(names: dict[str, Any], tmp_path: Path):
    run, path = names['run'], tmp_path / 'no' / 'such' / 'run.mcap'
    why = f'{path.parents[1]}: is a folder that does not exist; make {path.parent}'
    for write in (
        lambda: run.save(path),
        lambda: simulate(amplitude_m=1e-7, steps=2, record=path),
        lambda: names['drive'].save(path.with_suffix('.html')),
    ):
        with pytest.raises(StickSlipError, match=re.escape(why)):
            write()
    assert not [*tmp_path.iterdir()]
    path.parent.mkdir(parents=True)
    assert run.save(path) == path


def test_no_text_of_a_run_shows_its_temporary_file(names: dict[str, Any]):
    run, compare = names['run'], names['compare']
    comparison = compare(run, run)
    shown = [repr(run), run._repr_html_(), repr(run.result), comparison._repr_html_()]
    shown += [str(run.frame.attrs), run.table().attrs['source']]
    assert not [text for text in shown if str(run.path.parent) in text]
    assert repr(run).endswith('keep it with save(path))')


def test_the_axes_of_a_plotted_table_are_labelled(names: dict[str, Any]):
    mpl.use('Agg')
    frame = names['run'].frame
    assert frame.plot().axes[0].get_xlabel() == 'time_s'
    position = frame.plot.line(y=['force_n', 'position_m'])
    assert position.axes[0].get_ylabel() == 'force_n, position_m'
    both = frame.plot(y='foot_m', ylabel='mine', ax=position)
    assert both is position
    assert both.axes[0].get_ylabel() == 'mine'
    assert len(both.axes[0].lines) == 3
    assert len(names['run'].table().plot(subplots=True).axes) == len(frame.columns)


RESULTS = {
    'ComparisonReport', 'DriveRun', 'Fit', 'LinearDrive', 'MeasuredResponse', 'Output',
    'Presliding', 'StickSlipError', 'ZeroAmplitude',
}  # fmt: skip
"""Public classes that users get and do not make."""


@pytest.mark.parametrize('name', sorted({*vars(stickslip_ros)['PUBLIC']} - RESULTS))
def test_every_public_name_reads_its_arguments(name: str):
    public = getattr(stickslip_ros, name)
    if isinstance(public, type):
        calls = vars(public).items()
        methods = [each for each, call in calls if hasattr(call, 'checks_arguments')]
        assert '__init__' in methods
    else:
        assert public.checks_arguments


def test_public_names_keep_signature_documentation_and_place():
    assert pickle.loads(pickle.dumps(simulate)) is simulate
    kind = inspect.signature(Run).parameters['path'].kind
    assert kind is inspect.Parameter.POSITIONAL_OR_KEYWORD
    assert simulate.__doc__.strip().startswith('Drive the whole stand')
