# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every verb explains itself, speaks JSON, and refuses with a message and status 2."""

import argparse
import inspect
import json
import os
import re
import shlex
import sys
from functools import cache
from inspect import signature
from pathlib import Path
from typing import Any

import pytest
import yaml
from processes import run_process

import stickslip_ros
from stickslip_ros import FitOptions, Free, simulate
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.cli.bode import POINTS
from stickslip_ros.lab.cli.chosen import chosen_for
from stickslip_ros.lab.cli.drive import ros_arguments
from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.lab.cli.verbs import VERBS
from stickslip_ros.lab.comparison.by_amplitude import MODEL
from stickslip_ros.lab.design.objectives import WaveGoal
from stickslip_ros.lab.fitting.free import FITTED
from stickslip_ros.lab.paper.make import FIGURES
from stickslip_ros.lab.runs.sawtooth_run import STEADY_STEPS_MAX
from stickslip_ros.lab.runs.sweep import STEADY_RULE
from stickslip_ros.lab.runs.zero_amplitude import FIT_POINTS, STEP_MIN_M

NEEDED = {'contact': ('--normal-force', '0.1'), 'simulate': ('--voltage', '100')}
COMMAND = 'import sys; from stickslip_ros.lab.cli.start import stickslip; sys.exit(stickslip())'
SLOW = ('numba', 'scipy', 'matplotlib', 'rich', 'numpy', 'yaml', 'rclpy')
WITH_PARAMETERS = ('contact', 'simulate', 'drive', 'demo', 'parameters')
ROOT = Path(__file__).resolve().parents[3]


@cache
def parsers() -> dict[str, argparse.ArgumentParser]:
    """Give the parser of each verb."""
    [verbs] = [
        action
        for action in build_parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    ]
    return dict(verbs.choices)


NAMES = list(parsers())


@pytest.mark.parametrize('words', ['--help', 'contact --normal-force 0.2', 'contact'])
def test_the_package_as_a_module_is_the_command(words: str):
    module, command = (
        run_process([*start, *words.split()])
        for start in ([sys.executable, '-m', 'stickslip_ros'], [sys.executable, '-c', COMMAND])
    )
    assert module.stdout or module.stderr.startswith('stickslip: ')
    assert (module.returncode, module.stdout, module.stderr) == (
        command.returncode,
        command.stdout,
        command.stderr,
    )


IMPORTS = """
import sys
from stickslip_ros.lab.cli.main import main
for line, spared in {lines}.items():
    try:
        main(line.split())
    except SystemExit:
        pass
    assert not [each for each in spared if each in sys.modules], line
"""
SPARED = 'matplotlib', 'rclpy', 'pandas', 'pint', 'scipy.stats'
LINES = {
    **{f'{verb} --help': SLOW for verb in ('', 'simulate', 'fit', 'drive', 'validate')},
    'simulate --ampltude 60nm': SLOW,
    'contact --normal-force 0.1': SPARED,
    'simulate --voltage 1V': SPARED,
    'compare a.csv b.csv': SPARED,
    'fit a.csv --free contact.friction': SPARED,
}
"""Command lines, those that need least first, and modules that they do not import."""


def test_a_verb_imports_no_more_than_it_needs():
    run_process([sys.executable, '-c', IMPORTS.format(lines=LINES)], check=True)


def test_help_names_every_verb(capsys: Any):
    with pytest.raises(SystemExit) as ended:
        main(['--help'])
    shown = capsys.readouterr().out
    assert ended.value.code == 0
    assert all(re.search(rf'^  {name}\s', shown, re.MULTILINE) for name in NAMES)
    assert 'Exit status: 0 done, 1 a check failed,\n2 refused' in shown


@pytest.mark.parametrize('verb', NAMES)
def test_help_of_a_verb_explains_every_option_and_json_is_one(capsys: Any, verb: str):
    with pytest.raises(SystemExit) as ended:
        main([verb, '--help'])
    shown = capsys.readouterr().out
    assert ended.value.code == 0
    assert '--json' in shown
    for action in parsers()[verb]._actions:
        assert action.help
        for option in action.option_strings:
            assert option in shown
            assert '_' not in option


def test_version(capsys: Any):
    with pytest.raises(SystemExit) as ended:
        main(['--version'])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f'{stickslip_ros.__version__}\n'


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ([], "the following arguments are required: VERB; 'stickslip --help' explains it"),
        (['dance'], "verb 'dance' is not known; 'stickslip --help' explains it"),
        (['simulat'], "verb 'simulat' is not known; did you mean simulate?"),
        (['info'], "arguments are required: FILE; 'stickslip info --help' explains it"),
        (['parameters', '--bogus'], "--bogus; 'stickslip parameters --help' explains it"),
        (['simulate', '--ampltude=60nm'], '--ampltude; did you mean --amplitude?'),
        (['panel', '--namespace', 'a*'], "'a*' is not made of letters, digits and _; give"),
        (['command', 'stop', '--node', '/1'], "--node '/1' is not made of letters"),
        (['contact', '--normal-force', '0.1', 'nm'], "--normal-force '0.1nm' is not a number in"),
        (['simulate', '--amplitude', '60nm', '--frequency', '1,000'], 'write 1000 or 1.000'),
        (['simulate', '--amplitude', '60nm', '--steps', '1.5'], "--steps '1.5' is not a whole"),
        (['sweep', '--amplitude', '60,5nm', '-o', 'x.csv'], 'with a decimal point, 60.5nm'),
        (['sweep', '--amplitude', '1:160,5nm:3', '-o', 'x.csv'], 'write 160.5nm'),
        (['figures', '--points', '1e0', '--only', 'fig7'], 'points 1 is below 2'),
        (['sweep', '--amplitude', '60'], 'did you mean 60 nm?'),
        (['draw', '--stage', 'nothing'], "stage 'nothing' is not known"),
    ],
)
def test_an_unknown_command_line_ends_in_a_line_with_what_may_be_meant(capsys, words, said):
    assert main(words) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith('stickslip: ')
    assert said in line


@pytest.mark.parametrize('words', [[], *([name] for name in NAMES)], ids=str)
def test_help_fits_a_narrow_terminal(capsys, monkeypatch, words):
    monkeypatch.setenv('COLUMNS', '80')
    with pytest.raises(SystemExit):
        main([*words, '--help'])
    assert max(map(len, capsys.readouterr().out.splitlines())) < 80


def test_one_spelling_of_an_option_is_one_thing():
    same = {'--preload', '--amplitude', '--frequency', '--steps', '--output'}
    same |= {'--rate', '--load'}
    texts: dict[str, set[str]] = {}
    for parser in parsers().values():
        for action in parser._actions:
            for flag in action.option_strings:
                texts.setdefault(flag, set()).add(action.help)
    several = {flag for flag, each in texts.items() if len(each) > 1}
    assert several == same | {'-o'}


@pytest.mark.parametrize(
    ('verb', 'owner', 'names'),
    [
        ('simulate', simulate, ('amplitude_m', 'voltage_v', 'frequency_hz', 'steps')),
        ('fit', FitOptions, tuple(signature(FitOptions).parameters)),
        ('fit', Free, ('start', 'known')),
        ('optimise', WaveGoal, ('load_n', 'speed_m_per_s')),
    ],
)
def test_an_option_has_the_default_and_the_words_of_its_argument_or_field(verb, owner, names):
    options = {each.dest: each for each in reversed(parsers()[verb]._actions)}
    owners = owner.mro()[:-1] if isinstance(owner, type) else [owner]
    sources = [inspect.getsource(each) for each in owners]
    said = ' '.join(' '.join(sources).lower().split())
    for name in names:
        shown, _, default = (options[name].help or '').replace('%%', '%').partition(' (default: ')
        words = re.split(r', as |: 2ms@|; may be|, with commas|, m/s', shown.lower())[0]
        assert words in said
        assert not options[name].default
        expected = signature(owner).parameters[name].default
        if isinstance(expected, int | float) and expected:
            assert float(re.sub('[A-Za-z/]+\\)', '', default).rstrip(')')) == expected


def test_a_record_gets_what_is_typed_and_else_its_defaults():
    words = 'fit a.csv --free contact.friction'
    assert chosen_for(FitOptions, build_parser().parse_args(words.split())) == {}
    words += ' --frequency 2kHz --window 2ms@1s --preload 100mN --preload 0.2N,300mN --starts 3'
    words += ' --map force_n=F --commands b.csv --drift 1nm/s --start runner.mass=3g'
    parsed = build_parser().parse_args(words.split())
    assert FitOptions(**chosen_for(FitOptions, parsed)) == FitOptions(
        frequency_hz=2000.0,
        window_s=(1.0, 1.002),
        preloads_n=[0.1, 0.2, 0.3],
        starts=3,
        headers={'force_n': 'F'},
        commands=Path('b.csv'),
        drift_m_per_s=1e-9,
    )
    assert parsed.start == {'runner.mass': '3g'}


def test_help_tells_the_numbers_of_the_package(capsys: Any):
    told = {name: ' '.join(parser.format_help().split()) for name, parser in parsers().items()}
    assert f'at {FIT_POINTS} amplitudes' in told['zero-amplitude']
    assert f'above {STEP_MIN_M:g} m.' in told['zero-amplitude']
    assert f'{STEADY_RULE}; --steps' in told['sweep']
    assert f'default: {POINTS} around the resonance' in told['bode']
    assert f'at most {STEADY_STEPS_MAX}' in told['simulate']
    assert f'The word {MODEL} for B' in told['compare']
    assert f'Quantities of {", ".join(FITTED)} may be freed' in told['fit']
    assert f'Names: {", ".join(FIGURES)}.' in told['figures']


def test_units_are_exact_to_the_last_bit_also_behind_a_blank(capsys: Any):
    told = []
    for words in (
        '--amplitude 60 nm --preload 250mN --slew 150V/us --frequency=-1kHz',
        '--amplitude 60e-9 --preload 0.25 --slew 150e6 --frequency -1000',
    ):
        assert main(['simulate', *words.split(), '--steps', '3', '--json']) == 0
        result = json.loads(capsys.readouterr().out)
        told.append({name: each for name, each in result.items() if 'wall' not in name})
        told[-1].pop('real_time_factor')
    assert told[0] == told[1]
    assert told[0]['amplitude_m'] == 60e-9


@pytest.mark.parametrize('verb', WITH_PARAMETERS)
def test_a_bad_assignment_is_refused_by_every_verb(capsys: Any, verb: str):
    assert main([verb, *NEEDED.get(verb, ()), '--set', 'stand.preload=250 mN s']) == 2
    out, err = capsys.readouterr()
    assert out == ''
    [line] = err.splitlines()
    assert line.startswith(
        "stickslip: stand.preload '250 mN s' is not a number in uN, mN, N or kN"
    )


def test_the_parameters_are_those_of_the_file_in_config(capsys: Any):
    assert main(['parameters']) == 0
    expected = (ROOT / 'config/test_stand.yaml').read_text(encoding='utf-8')
    assert capsys.readouterr().out == expected


def test_the_interface_is_the_page_in_docs(capsys: Any):
    assert main(['interface']) == 0
    expected = (ROOT / 'docs/reference/interface.md').read_text(encoding='utf-8')
    assert capsys.readouterr().out == expected


def drive_arguments(*words: str) -> list[str]:
    parsed, rest = build_parser(['drive']).parse_known_args(['drive', *words])
    parsed.ros_arguments = rest
    return ros_arguments(parsed)


def test_the_node_gets_the_parameter_file_then_the_assignments():
    words = drive_arguments('--params', 'a.yaml', '--set', 'stand.preload=0.3')
    assert ' '.join(words) == 'stickslip --ros-args --params-file a.yaml -p stand.preload:=0.3'


@pytest.mark.parametrize('text', ['12', '', 'true', '1e3', 'a: b.mcap', "it's.mcap", '~'])
def test_the_node_gets_a_text_as_a_text_whatever_it_looks_like(text: str):
    [*_, word] = drive_arguments('--set', f'record.name={text}')
    name, _, value = word.partition(':=')
    assert name == 'record.name'
    assert yaml.safe_load(value) == text


READING = {
    'compare': ['{}', 'model'],
    'fit': ['{}', '--free', 'contact.friction'],
    'info': ['{}'],
    'plot': ['{}'],
    'recover': ['{}'],
    'replay': ['{}', '-o', 'new.mcap'],
    'parameters': ['--params', '{}'],
    'simulate': ['--voltage', '10', '-o', 'new.mcap', '--set', 'record.experiment={}'],
}
"""Words that have each verb read a file."""


@pytest.mark.parametrize('verb', READING)
@pytest.mark.parametrize('path', ['', '..', '/dev/full', '/dev/zero', 'pipe.parquet'])
def test_what_is_no_file_is_refused_in_one_line(capsys, tmp_path, monkeypatch, verb, path):
    monkeypatch.chdir(tmp_path)
    if path.startswith('pipe'):
        os.mkfifo(path)
    if verb == 'simulate' and not path:
        return  # no experiment
    assert main([verb, *(word.format(path) for word in READING[verb])]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith('stickslip: ')
    assert ';' in line


WRITING = {
    'simulate': (['--voltage', '10', '-o'], 'simulate'),
    'replay': (['voltage.csv', '-o'], 'replay_input'),
    'sweep': (['--amplitude', '1e-9', '-o'], 'run_sweep'),
    'fit': (['points.csv', '--free', 'contact.friction', '-o'], 'fit'),
    'compare': (['points.csv', 'model', '--output'], 'compare'),
    'figures': (['--output'], 'make_tables'),
    'validate': (['--output'], 'validate'),
}
"""Words that have each verb write, and the work that it would do before."""
SUFFIXES = {'sweep': '.csv', 'fit': '.json', 'compare': '.html'}


@pytest.mark.parametrize('verb', WRITING)
@pytest.mark.parametrize('place', ['{}', 'taken/new{}', '/dev/null', '/proc/new/new{}', '-'])
def test_what_cannot_be_written_is_refused_before_the_work(
    capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str, place: str
):
    words, work = WRITING[verb]
    path = place.format(SUFFIXES.get(verb, ''))
    monkeypatch.chdir(tmp_path)
    Path('taken').write_text('')
    Path('points.csv').write_text('preload_n,amplitude_m,force_n\n' + '0.5,1e-7,0.1\n' * 3)
    monkeypatch.setattr(f'stickslip_ros.lab.cli.{VERBS[verb].module}.{work}', None)
    if path.startswith('.'):
        Path(path).mkdir()
    assert main([verb, *words, path]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert any(
        each in line for each in ('choose another', 'end it', 'end its name', 'give a path')
    )
    assert not Path('-').exists()


LONG = 'x' * 1_000_000 + '; do this'


def test_a_refusal_that_quotes_megabytes_keeps_its_beginning_and_its_end():
    for error in (StickSlipError(LONG), OutOfRange(LONG, 1.0, 'm', 'above 0 m', LONG)):
        assert len(str(error)) < 2100
        assert str(error).endswith('; do this')


OPTIMISE = 'optimise --evaluations 6 --knots 6 -o wave.csv'
FIT = 'fit points.csv --free contact.friction'
WISHES = {
    'bode --figure bode.gif': "kind of picture '.gif' is not known",
    'bode --set contact.law=dahl': 'contact.law',
    'compare points.csv points.csv --set contact.friction=0.2': 'is without effect on files; ',
    'compare points.csv model --shift nan': "--shift 'nan' is not a number in us, ms or s",
    'compare points.csv model --set amplifier.voltage_max=100': 'm is above the 5.33333e-08 m',
    'contact --normal-force 0': 'normal force 0 N is not above 0 N',
    'figures --only fig9': "figure 'fig9' is not known; use fig2, fig6a, fig6b, fig7",
    f'{FIT} --free contact.law': "free parameter 'contact.law' is not a quantity",
    f'{FIT} -o fit.txt': "output 'fit.txt' is not a .json, .yaml or .html file",
    'import points.csv -o clean.txt': "output 'clean.txt' is not a .csv file; end its name so",
    'import points.csv --map foot_m=force_n': '--map foot_m= is without effect on an',
    f'{OPTIMISE} beauty': "'beauty' is not",
    f'{OPTIMISE} speed --frequency 1:2:3': 'frequency',
    f'{OPTIMISE} speed --set contact.friction=2e9': 'contact.friction 2e+09 is above',
    f'{OPTIMISE} speed -o wave.mcap': 'wave.mcap',
    'plot a.mcap --width 89': '--width 89 m is wider than a page; write 89mm for millimetres',
    'plot a.mcap --window 3ms@30': "window '30' is without a unit",
    'simulate --amplitude 60mN': 'is not a number in nm, um, mm or m; give a quantity such',
    'simulate --amplitude 30m': 'is above the 1.6e-07 m that the amplifier reaches; lower it; 30',
    'simulate --voltage 300 --steps -1': '2147483647; give a whole number; 0 runs until stopped',
    'sweep --amplitude 20,60nm -o a.csv': "amplitude '20' is without a unit, but others have",
    'sweep --amplitude 0:160e-9 -o a.csv': "'0:160e-9' is not start:stop:count; write",
    'sweep --amplitude 1nm --workers -1 -o a.csv': 'number of workers -1 is not from 0 to 1024',
}
"""Command lines, and what a refusal says."""


@pytest.mark.parametrize('typed', WISHES)
def test_a_wish_that_cannot_be_is_refused_in_a_line_and_leaves_nothing(
    typed: str, capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    Path('points.csv').write_text('preload_n,amplitude_m,force_n\n' + '0.5,1e-7,0.1\n' * 3)
    assert main(shlex.split(typed)) == 2
    out, err = capsys.readouterr()
    *_, line = err.splitlines()  # compare and fit say first what they have read
    assert out == ''
    assert line.startswith('stickslip: ')
    assert WISHES[typed] in line
    assert [each.name for each in tmp_path.iterdir()] == ['points.csv']


def test_the_node_takes_further_words_only_behind_ros_args(capsys: pytest.CaptureFixture[str]):
    assert main(['drive', '--frobnicate']) == 2
    assert 'unrecognized arguments: --frobnicate' in capsys.readouterr().err
