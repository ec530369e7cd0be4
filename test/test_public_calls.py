# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Every public name is called once, every verb is run once, and so are the examples of README.

``make wheel`` runs this with the newest of every dependency, so it needs no more than a user has.

"""

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from itertools import dropwhile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from pages import DOCS, blocks_of, commands_of
from processes import finish, start_process
from rig_recording import write_a_rig

import stickslip_ros
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.cli.verbs import VERBS
from stickslip_ros.lab.figures.plotting import StyledFigure

README = DOCS.parent / 'README.md'
s: Any = stickslip_ros
"""Without types: mappings stand for parameters here."""
FREE = {'load_cell.contact': 'absent'}
WAVE = [(0.0, 0.0), (0.9e-3, 300.0), (1e-3, 0.0)]
SHORT: Any = {'starts': 1, 'window_s': (4e-3, 12e-3)}


@cache
def run() -> Any:
    return s.simulate(FREE, waveform=WAVE, steps=5)


@cache
def fit() -> Any:
    return s.fit('run.csv', s.Free('contact.friction', low=0.1), options=s.FitOptions(**SHORT))


@cache
def compare() -> Any:
    return s.compare('run.csv', 'run.mcap', options=s.CompareOptions(window_s=(2e-3, 9e-3)))


@cache
def measured() -> Any:
    return s.measure_response(s.Parameters(), [1e3, 2e3])


def output() -> Any:
    bench = s.Bench(s.Parameters())
    return bench.update(bench.time_ns + 1_000_000, [s.Request('voltage', (20.0,))])


CALLS: dict[str, Callable[[], object]] = {
    'Bench': output,
    'CompareOptions': lambda: compare().plot(),
    'ComparisonReport': lambda: compare().save('comparison.html'),
    'DriveRun': lambda: s.run_drive({}, 1e-7, 1000.0).force_mean_n,
    'Fit': lambda: fit().save('fitted.html'),
    'FitOptions': fit,
    'Free': lambda: s.Free('runner.mass', low='1g', high='10g'),
    'LinearDrive': lambda: s.linearise({}).response([1e3, 2e3]),
    'MeasuredResponse': lambda: measured().plot(),
    'Output': lambda: output().readings.position_m,
    'Parameters': lambda: s.Parameters().updated({'stand.preload': '250mN'}),
    'Presliding': lambda: s.presliding({}, normal_force_n=0.2).__dict__,
    'Request': output,
    'Run': lambda: [run().plot(), run().frame.describe(), run().table((0.0, 1e-3))],
    'SpringContact': lambda: s.SpringContact({}, 0.2).move(1e-8, 0.2),
    'StickSlipError': lambda: str(s.StickSlipError('above the limit')),
    'ZeroAmplitude': lambda: s.zero_amplitude({}, frequency_hz=200.0).zero_amplitude_m,
    'compare': compare,
    'draw_stand': lambda: s.draw_stand({}),
    'fit': fit,
    'force_onset_m': lambda: s.force_onset_m({}, 1000.0),
    'linearise': lambda: s.linearise({}).matrix([1e3]),
    'load_yaml': lambda: s.load_yaml(s.stage_file('clamp')),
    'measure_response': measured,
    'open_run': lambda: s.open_run('run.mcap').frame,
    'presliding': lambda: s.presliding({}, normal_force_n=0.2),
    'robot_description': lambda: s.robot_description({}),
    'run_drive': lambda: s.run_drive({}, 1e-7, 1000.0),
    'simulate': run,
    'stage_file': lambda: s.stage_file('rod'),
    'sweep': lambda: s.sweep({}, {'stand.preload': [0.1, 0.2], 'amplitude_m': [6e-8]}).describe(),
    'zero_amplitude': lambda: s.zero_amplitude({}, frequency_hz=200.0),
}
LINES = {
    'contact': '--normal-force 0.2',
    'simulate': '--voltage 100 --steps 5 -o other.mcap',
    'sweep': '--preload 0.1,0.5 --amplitude 60nm,90nm -o force.parquet',
    'zero-amplitude': '--frequency 200Hz',
    'optimise': 'force --frequency 500 --evaluations 2 --workers 1 -o wave.csv',
    'bode': '--frequency 1kHz,2kHz -o bode.csv --figure bode.png',
    'compile': '',
    'import': 'run.csv -o again.csv',
    'compare': 'run.csv run.mcap -o comparison.html',
    'fit': 'run.csv --free contact.friction --starts 1 --window 8ms@4ms -o fitted.json',
    'info': 'run.mcap',
    'plot': 'run.mcap -o plot.png',
    'draw': '-o stand.svg',
    'export': 'run.mcap -o exported.csv',
    'recover': 'run.mcap',
    'replay': 'run.mcap',
    'demo': '-o demo',
    'parameters': '',
    'interface': '',
    'figures': '--only fig2 --points 5 -o figures',
    'validate': '-o validation',
}
SERVED = {
    'drive': ('--ros-args -p sim.block:=0.01', 'drive'),
    'twin': ('', 'twin'),
    'panel': ('run.mcap --port 0', 'http'),
}
"""Verbs that run until Ctrl-C, and a word of the line by which they say that they do."""


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None) -> Path:
    """Give a folder with a recording and a table of it."""
    folder = tmp_path_factory.mktemp('calls')
    recording, table = folder / 'run.mcap', folder / 'run.csv'
    assert main(['simulate', '--voltage', '100', '--steps', '20', '-o', str(recording)]) == 0
    assert main(['export', str(recording), '-o', str(table)]) == 0
    for name in ('demo', 'figures', 'validation', 'runs'):
        (folder / name).mkdir()
    return folder


@pytest.fixture(autouse=True)
def _there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(folder)
    monkeypatch.setenv('MPLBACKEND', 'agg')
    yield
    plt.close('all')


def test_no_name_and_no_verb_is_left_out():
    assert CALLS.keys() == vars(s)['PUBLIC'].keys()
    assert LINES.keys() | SERVED.keys() | {'command'} == VERBS.keys()


@pytest.mark.parametrize('name', CALLS)
def test_a_public_name_does_its_work(name: str):
    assert CALLS[name]() is not None or name in {'Fit', 'ComparisonReport'}  # which save


def test_every_result_with_a_plot_returns_a_figure_that_only_its_user_shows():
    drawn = run()
    results = [drawn, drawn.frame, drawn.table(), fit(), compare(), s.linearise({}), measured()]
    classes = {name for name in vars(s)['PUBLIC'] if hasattr(getattr(s, name), 'plot')}
    assert classes == {type(each).__name__ for each in results} - {'DataFrame'}
    figures = [each.plot() for each in results]
    assert {type(each) for each in figures} == {StyledFigure}
    for each in figures:
        assert each._repr_png_().startswith(b'\x89PNG')  # in a notebook
    assert not plt.get_fignums()


@pytest.mark.parametrize('verb', LINES)
def test_a_verb_does_its_work(verb, ros_domain, quiet_ros, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    assert main([verb, *LINES[verb].split()]) == 0


def started(words: list[str], said: str, ros_domain: int) -> 'subprocess.Popen[str]':
    """Start a verb that serves until Ctrl-C; return it when it has said a word."""
    process = start_process(
        [sys.executable, '-m', 'stickslip_ros', *words],
        env={**os.environ, 'ROS_DOMAIN_ID': str(ros_domain)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    lines = []
    for line in process.stdout or ():
        lines.append(line)
        if said in line:
            return process
    raise AssertionError(lines)


def stop(process: 'subprocess.Popen[str]') -> int:
    """End a process by Ctrl-C; return its status."""
    process.send_signal(signal.SIGINT)
    finish(process)
    return int(process.returncode)


@pytest.mark.parametrize('verb', SERVED)
def test_a_verb_serves_until_it_is_stopped(verb, ros_domain, quiet_ros, monkeypatch):
    words, said = SERVED[verb]
    process = started([verb, *words.split()], said, ros_domain)
    if verb == 'drive':
        monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
        assert main(['command', 'voltage', '10V', '--timeout', '300s']) == 0
    assert stop(process) == (130 if verb == 'panel' else 0)


def test_the_examples_of_readme_run_as_they_stand(folder: Path, ros_domain: int, quiet_ros: None):
    write_a_rig(folder / 'rig.mcap')
    [table] = blocks_of(DOCS / 'howto' / 'compare.md', 'csv')
    (folder / table.file).write_text(table.text, 'utf-8')
    for example in blocks_of(README, 'python'):
        exec(compile(example.text, 'README.md', 'exec'), {})
    commands = [command for block in blocks_of(README, 'sh') for command in commands_of(block)]
    words = [shlex.split(each, comments=True) for each in commands]
    program = re.compile(r'stickslip(_ros)?')
    ours = [[*dropwhile(lambda word: not program.fullmatch(word), each)][1:] for each in words]
    ours = [each for each in ours if each]
    assert [each[0] for each in ours] == ['simulate', 'simulate', 'compare', 'fit', 'twin']
    for each in ours:
        if each[0] == 'twin':
            assert stop(started(each, 'twin', ros_domain)) == 0
        else:
            assert main(each) == 0, each
