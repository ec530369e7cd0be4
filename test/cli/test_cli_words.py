"""Every verb explains itself, speaks JSON, and refuses with a message and status 2."""

import argparse
import contextlib
import inspect
import json
import os
import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml

import stickslip_ros
from stickslip_ros.cli.bode import POINTS
from stickslip_ros.cli.chosen import to_numbers
from stickslip_ros.cli.demo import TOLERANCE_M
from stickslip_ros.cli.drive import ros_arguments
from stickslip_ros.cli.main import build_parser, main
from stickslip_ros.cli.verbs import VERBS
from stickslip_ros.comparison.by_amplitude import MODEL
from stickslip_ros.errors import StickSlipError
from stickslip_ros.fitting.free import FITTED_GROUPS
from stickslip_ros.paper.make import FIGURES
from stickslip_ros.parameters import ControllerParameters, Parameters, load_yaml, specs
from stickslip_ros.runs.sawtooth_run import STEADY_STEPS_MAX
from stickslip_ros.runs.sweep import STEADY_RULE
from stickslip_ros.runs.zero_amplitude import FIT_POINTS, STEP_MIN_M
from stickslip_ros.testing.positioning import LOAD_N, TARGETS_M
from stickslip_ros.units import NM

NEEDED = {'contact': ('--normal-force', '0.1'), 'simulate': ('--voltage', '100')}
SLOW = ('numba', 'scipy', 'matplotlib', 'rich', 'numpy', 'yaml', 'rclpy')
WITH_PARAMETERS = ('contact', 'simulate', 'drive', 'demo', 'parameters')
ROOT = Path(__file__).resolve().parents[2]


def parsers() -> dict[str, argparse.ArgumentParser]:
    """Give the parser of each verb."""
    [verbs] = [
        action
        for action in build_parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    ]
    return dict(verbs.choices)


NAMES = list(parsers())


@pytest.mark.parametrize(
    ('words', 'spared'),
    [
        ((), SLOW),
        *(((name, '--help'), SLOW) for name in ('simulate', 'fit', 'drive', 'validate')),
        (('simulate', '--ampltude', '60nm'), SLOW),
        (('contact', '--normal-force', '0.1'), ('numba', 'scipy', 'matplotlib', 'rclpy')),
        (('simulate', '--voltage', '1V'), ('matplotlib', 'rclpy', 'pandas', 'pint')),
        (('compare', 'a.csv', 'b.csv'), ('rclpy', 'pandas', 'pint')),
    ],
)
def test_a_verb_imports_no_more_than_it_needs(words: tuple[str, ...], spared: tuple[str, ...]):
    program = (
        'import sys; from stickslip_ros.cli.main import main\n'
        f'try: main({list(words or ["--help"])})\n'
        'except SystemExit: pass\n'
        f'print([each for each in {spared} if each in sys.modules])'
    )
    told = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=True, timeout=60.0
    )
    assert told.stdout.splitlines()[-1] == '[]'


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


def test_version(capsys: Any):
    with pytest.raises(SystemExit) as ended:
        main(['--version'])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f'{stickslip_ros.__version__}\n'


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ([], 'the following arguments are required: VERB'),
        (['dance'], "error: verb 'dance' is not known\n"),
        (['simulat'], "error: verb 'simulat' is not known; did you mean simulate?"),
        (['info'], 'the following arguments are required: FILE'),
        (['parameters', '--bogus'], 'unrecognized arguments: --bogus\n'),
        (['simulate', '--ampltude=60nm'], '--ampltude; did you mean --amplitude?'),
        (['sweep', '--preload', '1', '--ouput', 'a.csv'], '--ouput; did you mean --output?'),
    ],
)
def test_an_unknown_command_line_ends_with_usage_and_what_may_be_meant(
    capsys: Any, words: list[str], said: str
):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    shown = capsys.readouterr().err
    assert shown.startswith('usage: stickslip')
    assert said in shown


@pytest.mark.parametrize('words', [[], *([name] for name in NAMES)], ids=str)
def test_help_fits_a_narrow_terminal(
    capsys: Any, monkeypatch: pytest.MonkeyPatch, words: list[str]
):
    monkeypatch.setenv('COLUMNS', '80')
    with pytest.raises(SystemExit):
        main([*words, '--help'])
    assert max(map(len, capsys.readouterr().out.splitlines())) < 80


def test_one_spelling_of_an_option_is_one_thing():
    same = {'--preload', '--amplitude', '--frequency', '--steps', '--output'}
    same |= {'--load', '--seed'}
    texts: dict[str, set[str]] = {}
    for parser in parsers().values():
        for action in parser._actions:
            for flag in action.option_strings:
                texts.setdefault(flag, set()).add(action.help)
    several = {flag for flag, each in texts.items() if len(each) > 1}
    assert several == same | {'-o'}


@pytest.mark.parametrize(
    ('verb', 'name', 'arguments'),
    [
        ('simulate', 'simulate', ('amplitude_m', 'voltage_v', 'frequency_hz', 'steps')),
        ('sweep', 'sweep', ('steps',)),
        ('zero-amplitude', 'zero_amplitude', ('frequency_hz', 'steps')),
        ('fit', 'fit', ('frequency_hz', 'steps', 'starts', 'seed')),
    ],
)
def test_an_option_has_the_default_and_the_words_of_the_argument_of_its_function(
    verb: str, name: str, arguments: tuple[str, ...]
):
    function = getattr(stickslip_ros, name)
    options, said = parsers()[verb]._option_string_actions, function.__doc__.lower().split()
    for argument in arguments:
        option = options[f'--{argument.partition("_")[0]}']
        default = inspect.signature(function).parameters[argument].default
        words = (option.help or '').partition(' (default')[0].lower().split()
        assert option.default == default
        assert ' '.join(words) in ' '.join(said)


def test_help_tells_the_numbers_of_the_package(capsys: Any):
    told = {name: ' '.join(parser.format_help().split()) for name, parser in parsers().items()}
    assert f'at {FIT_POINTS} amplitudes' in told['zero-amplitude']
    assert f'above {STEP_MIN_M:g} m.' in told['zero-amplitude']
    assert f'{STEADY_RULE}; --steps' in told['sweep']
    assert f'default: {POINTS} around the resonance' in told['bode']
    assert f'at most {STEADY_STEPS_MAX}' in told['simulate']
    assert f'The word {MODEL} for B' in told['compare']
    assert f'Quantities of {", ".join(FITTED_GROUPS)} may be freed' in told['fit']
    assert f'Names: {", ".join(FIGURES)}.' in told['figures']
    assert f'within {TOLERANCE_M * NM:g} nm' in told['positioning']
    parse = build_parser().parse_args
    targets = parse(['positioning']).target
    assert to_numbers('--target', targets, 'm') == list(TARGETS_M)
    assert parse(['positioning']).load == LOAD_N


@pytest.mark.parametrize(
    ('words', 'changed'),
    [
        (['--set', 'stand.preload=250mN'], {'stand.preload': 0.25}),
        (['--set', 'load_cell.stiffness=0.2 N/um'], {'load_cell.stiffness': 0.2e6}),
        (['--set', 'amplifier.slew_rate=100V/us'], {'amplifier.slew_rate': 100e6}),
        (['--set', 'runner.mass=4g'], {'runner.mass': 4e-3}),
        (['--set', 'runner.damping=80N*s/m'], {'runner.damping': 80.0}),
        (['--set', 'contact.radius=1000µm'], {'contact.radius': 1e-3}),
        (['--set', 'contact.young_runner=200GPa'], {'contact.young_runner': 200e9}),
        (['--set', 'stand.preload_rate=2/s'], None),
        (['--set', 'record.chunk_size=2MB'], {'record.chunk_size': 2_000_000}),
        (
            ['--set', 'interferometer.noise_density=2pm/sqrt(Hz)'],
            {'interferometer.noise_density': 2e-12},
        ),
        (['--set', 'contact.prefactor=5e-4m^(1-H)'], {'contact.prefactor': 5e-4}),
        (['--set', 'contact.prefactor=5mm^(1-H)'], None),
        (['--set', 'contact.friction=0.2m'], None),
        (['--set', 'stand.preload=250 mN s'], None),
        (['--set', 'stand.preload=250NM'], None),
    ],
)
def test_a_parameter_takes_its_unit_with_a_prefix(
    capsys: Any, words: list[str], changed: dict[str, float] | None
):
    if changed is None:
        assert main(['parameters', *words]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert 'is not a finite number' in line
        assert '; give one such as ' in line
        return
    assert main(['parameters', *words, '--json']) == 0
    assert json.loads(capsys.readouterr().out) == Parameters().flat() | changed


def test_units_are_exact_to_the_last_bit(capsys: Any):
    told = []
    for words in (
        ['--amplitude', '60nm', '--preload', '250mN', '--slew', '150V/us', '--frequency=-1kHz'],
        ['--amplitude', '60e-9', '--preload', '0.25', '--slew', '150e6', '--frequency', '-1000'],
    ):
        assert main(['simulate', *words, '--steps', '3', '--json']) == 0
        result = json.loads(capsys.readouterr().out)
        told.append({name: each for name, each in result.items() if 'wall' not in name})
        told[-1].pop('real_time_factor')
    assert told[0] == told[1]
    assert told[0]['amplitude_m'] == 60e-9


@pytest.mark.parametrize('verb', WITH_PARAMETERS)
@pytest.mark.parametrize(
    ('assignment', 'message'),
    [
        (
            'stand.prelaod=0.3',
            "parameter 'stand.prelaod' is not known; did you mean stand.preload",
        ),
        ('stand.preload=much', "stand.preload 'much' is not a finite number"),
        ('stand.preload=1000', 'stand.preload 1000 N is above the maximum 100 N; lower it'),
        ('stand.preload', "--set 'stand.preload' is not an assignment"),
        ('sim.seed=1.5', "sim.seed '1.5' is not a whole number"),
        ('autostart=perhaps', "autostart 'perhaps' is not true or false"),
        ('contact.profile=polished', "contact.profile 'polished' is not one of the choices"),
    ],
)
def test_a_bad_assignment_is_refused_by_every_verb(
    capsys: Any, verb: str, assignment: str, message: str
):
    assert main([verb, *NEEDED.get(verb, ()), '--set', assignment]) == 2
    out, err = capsys.readouterr()
    assert out == ''
    [line] = err.splitlines()
    assert line.startswith(f'stickslip: {message}')


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (None, 'cannot be read (No such file or directory); check the path'),
        ('{', 'is not YAML'),
        ('- 1\n', 'is not a table of names'),
        ('/**:\n  stand:\n    preload: 1.0\n', 'needs ros__parameters: right below'),
        ('/**:\n  ros__parameters:\n    stand:\n      prelaod: 1.0\n', 'did you mean'),
    ],
)
def test_a_bad_parameter_file_is_refused(
    capsys: Any, tmp_path: Path, text: str | None, message: str
):
    file = tmp_path / 'odd.yaml'
    if text is not None:
        file.write_text(text, encoding='utf-8')
    assert main(['parameters', '--params', str(file)]) == 2
    assert message in capsys.readouterr().err


def test_the_parameters_are_those_of_the_file_in_config(capsys: Any):
    assert main(['parameters']) == 0
    expected = (ROOT / 'config/test_stand.yaml').read_text(encoding='utf-8')
    assert capsys.readouterr().out == expected


def test_the_interface_is_the_page_in_docs(capsys: Any):
    assert main(['interface']) == 0
    expected = (ROOT / 'docs/reference/interface.md').read_text(encoding='utf-8')
    assert capsys.readouterr().out == expected


def test_the_interface_as_json_names_every_topic(capsys: Any):
    assert main(['interface', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['position'] == 'geometry_msgs/msg/PointStamped'
    assert told['command/sawtooth'] == 'std_msgs/msg/Float64MultiArray'
    page = (ROOT / 'docs/reference/interface.md').read_text(encoding='utf-8')
    assert all(f'| `{name}` | {kind} |' in page for name, kind in told.items())


def test_code_config_and_json_name_the_same_parameters(capsys: Any):
    names = list(specs())
    document = yaml.safe_load((ROOT / 'config/test_stand.yaml').read_text(encoding='utf-8'))
    groups = document['/**']['ros__parameters']
    in_config = [
        name
        for group, leaves in groups.items()
        for name in (
            [f'{group}.{leaf}' for leaf in leaves] if isinstance(leaves, dict) else [group]
        )
    ]
    text = (ROOT / 'docs/reference/interface.md').read_text(encoding='utf-8')
    section = text.partition('## Parameters')[2]
    of_controller = [line.split('`')[1] for line in section.splitlines() if line[:3] == '| `']
    main(['parameters', '--json'])
    in_json = list(json.loads(capsys.readouterr().out))
    assert in_config == in_json == names
    assert of_controller == [field.name for field in fields(ControllerParameters)]


def test_the_file_in_config_is_the_default():
    assert load_yaml(ROOT / 'config/test_stand.yaml') == Parameters()


def other_values(name: str) -> dict[str, Any]:
    """Give values that fit together, of which that of one parameter is not the default."""
    spec = specs()[name]
    default: Any = spec.default
    candidates: list[Any] = [*spec.choices, 'abc']
    if spec.kind is bool:
        candidates = [not default]
    elif spec.kind is not str:
        candidates = [default * 2, default + 1, default * 0.5, spec.minimum, spec.maximum]
    for value in candidates:
        for others in ({}, {'contact.prefactor': 0.0}, {'load_cell.range': 1.0}):
            values = {name: value, **others}
            with contextlib.suppress(StickSlipError):
                if Parameters().updated(values).flat()[name] != default:
                    return values
    raise AssertionError(f'no other value of {name} fits')


@pytest.mark.parametrize('name', list(specs()))
def test_every_parameter_can_be_set_and_read_back_as_yaml(capsys: Any, tmp_path: Path, name: str):
    values = other_values(name)
    words = [word for each, value in values.items() for word in ('--set', f'{each}={value}')]
    assert main(['parameters', *words]) == 0
    file = tmp_path / 'written.yaml'
    file.write_text(capsys.readouterr().out, encoding='utf-8')
    assert load_yaml(file) == Parameters().updated(values)
    assert name in load_yaml(file).changed()


@pytest.mark.parametrize('text', ["it's here", 'a: b', '"quoted"', '#1', ' ', 'yes', '1e3', 'µ'])
def test_a_text_survives_the_parameter_file(capsys: Any, tmp_path: Path, text: str):
    assert main(['parameters', '--set', f'record.directory=/{text}']) == 0
    file = tmp_path / 'written.yaml'
    file.write_text(capsys.readouterr().out, encoding='utf-8')
    assert load_yaml(file).record.directory == f'/{text}'.strip()


def drive_arguments(*words: str) -> list[str]:
    parsed, rest = build_parser().parse_known_args(['drive', *words])
    parsed.ros_arguments = rest
    return ros_arguments(parsed)


def test_the_node_gets_the_parameter_file_then_the_assignments():
    words = drive_arguments('--params', 'a.yaml', '--set', 'stand.preload=0.3')
    assert words == [
        'stickslip',
        '--ros-args',
        '--params-file',
        'a.yaml',
        '-p',
        'stand.preload:=0.3',
    ]


def test_the_node_gets_further_ros_arguments_first():
    words = drive_arguments('--set', 'sim.seed=2', '--ros-args', '-r', '__ns:=/left')
    assert words[:4] == ['stickslip', '--ros-args', '-r', '__ns:=/left']
    assert words[4:] == ['--ros-args', '-p', 'sim.seed:=2']


@pytest.mark.parametrize('text', ['12', '', 'true', '1e3', 'a: b.mcap', "it's.mcap", '~'])
def test_the_node_gets_a_text_as_a_text_whatever_it_looks_like(text: str):
    [*_, word] = drive_arguments('--set', f'record.name={text}')
    name, _, value = word.partition(':=')
    assert name == 'record.name'
    assert yaml.safe_load(value) == text


@pytest.mark.parametrize(
    ('assignment', 'value'),
    [('sim.seed=7', 7), ('record.on_start=TRUE', True), ('runner.mass=1', 1)],
)
def test_the_node_gets_numbers_and_switches_as_such(assignment: str, value: Any):
    [*_, word] = drive_arguments('--set', assignment)
    assert yaml.safe_load(word.partition(':=')[2]) == value


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
@pytest.mark.parametrize(
    'path', ['', '.', '..', '/', '/dev/full', '/dev/zero', 'pipe', 'pipe.parquet']
)
def test_what_is_no_file_is_refused_in_one_line(
    capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str, path: str
):
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
@pytest.mark.parametrize('place', ['{}', 'taken/new{}', '/dev/null', '/proc/new/new{}'])
def test_what_cannot_be_written_is_refused_before_the_work(
    capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str, place: str
):
    words, work = WRITING[verb]
    path = place.format(SUFFIXES.get(verb, ''))
    monkeypatch.chdir(tmp_path)
    Path('taken').write_text('')
    Path('points.csv').write_text('preload_n,amplitude_m,force_n\n' + '0.5,1e-7,0.1\n' * 3)
    monkeypatch.setattr(f'stickslip_ros.cli.{VERBS[verb].module}.{work}', None)
    if path.startswith('.'):
        Path(path).mkdir()
    assert main([verb, *words, path]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert 'choose another' in line or 'end its name so' in line or 'give a path' in line


def test_a_long_value_is_quoted_in_part(capsys: Any, tmp_path: Path):
    file = tmp_path / 'nothing.csv'
    file.write_text(f'{"x" * 40_000},b\n1,2\n')
    assert main(['compare', str(file), 'model']) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert len(line) < 600 + len(str(file))
    assert '...' in line


def test_a_negative_frequency_in_e_notation_goes_backwards(capsys: pytest.CaptureFixture[str]):
    words = ['simulate', '--amplitude', '160e-9', '--frequency', '-1e3', '--steps', '5', '--json']
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)['force_mean_n'] < 0.0


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (
            ['simulate', '--amplitude', '60mN'],
            "--amplitude '60mN' is not a finite number in m; give one such as 60nm or 60e-9",
        ),
        (
            ['simulate', '--amplitude', '60nm', '--preload', '1m'],
            "stand.preload '1m' is not a finite number in N",
        ),
        (
            ['simulate', '--amplitude', '30m'],
            'amplitude 30 m is above the 1.6e-07 m that the amplifier reaches; lower it; 30 nm is',
        ),
        (
            ['sweep', '--amplitude', '20,60nm', '-o', 'a.csv'],
            "amplitude '20' is without a unit, which others have; write all as 60nm or 60e-9",
        ),
        (
            ['sweep', '--amplitude', '20:160nm:8', '-o', 'a.csv'],
            "amplitude '20' is without a unit, which others have",
        ),
        (
            ['fit', 'points.csv', '--free', 'runner.mass', '--bounds', 'runner.mass=1:5g'],
            "bounds of runner.mass '1' is without a unit, which others have",
        ),
        (['plot', 'a.mcap', '--window', '3ms@30'], "window '30' is without a unit"),
        (['simulate', '--amplitude', '-100nm'], 'amplitude -1e-07 m is below the minimum 0 m'),
        (['simulate', '--amplitude', '-1e-7'], 'amplitude -1e-07 m is below the minimum 0 m'),
        (['contact', '--normal-force', '-1e-3'], 'normal force -0.001 N is not above 0 N'),
        (['contact', '--normal-force', 'inf'], "--normal-force 'inf' is not a finite number in N"),
        (['contact', '--normal-force', '1e9'], 'beyond the radius of the sphere'),
    ],
)
def test_a_number_out_of_range_is_refused_in_the_unit_in_which_it_was_given(
    words: list[str],
    said: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.chdir(tmp_path)
    Path('points.csv').write_text('preload_n,amplitude_m,force_n\n' + '0.5,1e-7,0.1\n' * 3)
    assert main(words) == 2
    assert said in capsys.readouterr().err


def test_the_node_takes_further_words_only_behind_ros_args(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit):
        main(['drive', '--frobnicate'])
    assert 'unrecognized arguments: --frobnicate' in capsys.readouterr().err
