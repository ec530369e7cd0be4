# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters as a ROS parameter file: what is written is read back, the rest is refused."""

from itertools import pairwise
from pathlib import Path

import pytest
import yaml
from allowed_values import allowed_values
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, UnknownName, WrongKind
from stickslip_ros.lab.cli.reference import HEADING
from stickslip_ros.parameters import (
    Parameters,
    describe,
    dump_yaml,
    format_value,
    load_yaml,
    parse_yaml,
    spec_of,
    specs,
)

STAND_FILE = Path(__file__).resolve().parents[2] / 'config/test_stand.yaml'


def _under_node(body: str, node: str = '/**') -> str:
    return f'{node}:\n  ros__parameters:\n{body}'


@given(allowed_values())
def test_any_parameters_survive_being_written_and_read(values):
    parameters = Parameters().updated(values)
    assert parse_yaml(dump_yaml(parameters, 'A heading'), 'text') == parameters


@pytest.mark.parametrize('name', ["it's a run", 'back\\slash', 'grün', ' run ', '#1', 'null', '5'])
def test_a_file_name_survives_being_written_and_read(name):
    parameters = Parameters().updated({'record.name': name})
    assert parse_yaml(dump_yaml(parameters, ''), 'text') == parameters


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float_is_written_so_that_yaml_1_1_reads_a_float_of_the_same_bits(number):
    read = yaml.safe_load(format_value(number))
    assert type(read) is float
    assert read.hex() == number.hex()


def test_switches_and_whole_numbers_are_written_as_ros_reads_them():
    assert [format_value(value) for value in (True, False, 7, 'text')] == [
        'true',
        'false',
        '7',
        "'text'",
    ]


def test_the_file_of_the_test_stand_holds_the_defaults():
    text = STAND_FILE.read_text(encoding='utf-8')
    assert text == dump_yaml(Parameters(), HEADING)
    assert load_yaml(STAND_FILE) == load_yaml(str(STAND_FILE)) == Parameters()


def test_of_several_files_each_outweighs_those_before_it(tmp_path):
    below, above = tmp_path / 'below.yaml', tmp_path / 'above.yaml'
    below.write_text('/**: {ros__parameters: {stand: {preload: 0.2}, frame: {mass: 0.1}}}')
    above.write_text('/**: {ros__parameters: {stand: {preload: 0.3}}}')
    wanted = {'stand.preload': 0.3, 'frame.mass': 0.1}
    assert load_yaml(below, above).changed() == wanted
    assert load_yaml(above, below).changed() == {**wanted, 'stand.preload': 0.2}


def test_every_parameter_is_written_with_its_description_above_it():
    lines = dump_yaml(Parameters(), '').splitlines()
    for name in specs():
        comment = f'# {describe(spec_of(name))}'
        leaf = name.rpartition('.')[2]
        assert any(
            above.strip() == comment and below.strip().startswith(f'{leaf}: ')
            for above, below in pairwise(lines)
        )


def test_a_description_gives_unit_bounds_and_source():
    preload = describe(spec_of('stand.preload'))
    assert preload.endswith('in the paper [N]; 0.001 to 100 (Section 2)')
    compression = describe(spec_of('record.compression'))
    assert compression.endswith('of the chunks; zstd | lz4 | none (assumed)')


def test_a_description_without_limits():
    preload = describe(spec_of('stand.preload'), limits=False)
    assert preload.endswith('in the paper [N] (Section 2)')
    compression = describe(spec_of('record.compression'), limits=False)
    assert compression == 'compression of the chunks (assumed)'


def test_names_that_a_file_leaves_out_keep_their_defaults():
    read = parse_yaml(_under_node('    stand:\n      preload: 0.25\n'), 'text')
    assert read.changed() == {'stand.preload': 0.25}
    assert parse_yaml('', 'text') == Parameters()


def test_a_node_name_and_dotted_names_are_read_too():
    read = parse_yaml(_under_node('    stand.preload: 0.25\n', '/stand/stickslip_drive'), 'text')
    assert read.stand.preload == 0.25


def test_a_number_that_yaml_1_1_takes_for_a_text_is_read_as_a_number():
    read = parse_yaml(_under_node('    sim:\n      dt: 1e-7\n'), 'text')
    assert read.sim.dt == 1e-7


@pytest.mark.parametrize(
    ('text', 'kind', 'message'),
    [
        ('a: [', RecordingError, 'run.yaml: is not YAML'),
        ('a: \x07', RecordingError, 'run.yaml: is not YAML'),
        ('just a text', WrongKind, "run.yaml 'just a text' is not a table of names"),
        ('- 1\n- 2\n', WrongKind, 'is not a table of names'),
        ('stand:\n  preload: 1.0\n', UnknownName, 'needs ros__parameters: right below'),
        ('/**:\n  ros__parameters: 5\n', WrongKind, 'is not a table of names'),
        ('/**:\n  ros__parameters: {}\n  more: {}\n', UnknownName, "section '/**' is not known"),
        (_under_node('    stand: 5\n'), UnknownName, "parameter 'stand' is not known"),
        (_under_node('    stand:\n      colour: 5\n'), UnknownName, 'stand.colour'),
        (_under_node('    stand:\n      preload: [1]\n'), WrongKind, 'stand.preload [1] is not'),
        (_under_node('    stand:\n      preload: 1000.0\n'), OutOfRange, 'above the maximum 100'),
    ],
)
def test_a_foreign_text_is_refused(text, kind, message):
    with pytest.raises(kind) as caught:
        parse_yaml(text, 'run.yaml')
    assert message in str(caught.value)


@pytest.mark.parametrize(
    'text',
    [
        _under_node('    record:\n      name: 2020-99-99\n'),
        _under_node(f'    stand:\n      preload: {"1" * 400}\n'),
        '/**:\n  ros__parameters: &all {stand: *all}\n',
    ],
    ids=['impossible date', 'endless number', 'table inside itself'],
)
def test_a_text_on_which_the_reader_stumbles_is_refused_too(text):
    with pytest.raises(StickSlipError):
        parse_yaml(text, 'run.yaml')


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            _under_node('    stand:\n      preload: 0.1\n    stand:\n      preload: 0.2\n'),
            "run.yaml: line 5: 'stand' is already in line 3; keep one of the two",
        ),
        (
            _under_node('    stand: {preload: 0.1, preload: 0.2}\n'),
            "line 3: 'preload' is already in line 3; keep one of the two",
        ),
        ('/**: {}\n/**: {}\n', "line 2: '/**' is already in line 1; keep one of the two"),
        (
            _under_node('    stand.preload: 0.1\n    stand:\n      preload: 0.1\n'),
            'run.yaml: gives stand.preload twice; keep one of the two',
        ),
        (
            _under_node('    sim:\n      seed: 1:30\n'),
            "line 4: YAML reads 1:30 as 90, in base 60; write 90, or '1:30' for a text",
        ),
        (
            _under_node('    stand:\n      preload: 1:30.5\n'),
            "YAML reads 1:30.5 as 90.5, in base 60; write 90.5, or '1:30.5' for a text",
        ),
        (
            _under_node('    sim: &x {seed: 1}\n    stand: *x\n'),
            'line 4: has the alias *x; write out what it stands for',
        ),
        (
            _under_node('', 'a/stickslip_drive') + _under_node('', '/b/stickslip_drive'),
            'for several drives: /a/stickslip_drive and /b/stickslip_drive; keep one, or /**',
        ),
        (
            '/other: {ros__parameters: {stand: {preload: 0.2}}}\n/a: {b: {ros__parameters: {}}}\n',
            'has no section of a drive, only of /other and /a/b; name it /stickslip_drive, or /**',
        ),
    ],
)
def test_what_is_said_twice_or_read_otherwise_than_it_looks_is_refused(text, message):
    with pytest.raises(RecordingError) as caught:
        parse_yaml(text, 'run.yaml')
    assert message in str(caught.value)


def test_a_text_in_quotes_is_a_text():
    assert parse_yaml(_under_node("    record: {name: '1:30'}\n"), '').record.name == '1:30'


SHARED = '{ros__parameters: {stand: {preload: 0.1}, sim: {seed: 7}}}'
OWN = '{ros__parameters: {stand: {preload: 0.2}}}'


def test_later_sections_override_as_in_ros():
    shared, own = f'/**: {SHARED}\n', f'/left/stickslip_drive: {OWN}\n'
    both = {'stand.preload': 0.2, 'sim.seed': 7}
    assert parse_yaml(shared + own, 'run.yaml').changed() == both
    assert parse_yaml(own + shared, 'run.yaml').changed() == both | {'stand.preload': 0.1}


@pytest.mark.parametrize(
    ('sections', 'is_taken'),
    [
        (f'left: {{stickslip_drive: {OWN}}}', True),
        (f'"**": {{stickslip_drive: {OWN}}}', True),
        (f'/*: {OWN}', False),  # of the namespace /
        (f'/*/stickslip_drive: {OWN}', True),
        (f'/left/*: {OWN}', True),
        (f'/left/**: {OWN}', True),
        (f'/right/*: {OWN}', False),
        (f'/**/left/*: {OWN}', True),
        (f'/left/other: {OWN}', False),
        (f'"/left/stickslip_driv.": {OWN}', False),
        ('controllers: {manager: {ros__parameters: {update_rate: 100, stand: 5}}}', False),
    ],
)
def test_of_a_file_of_many_nodes_only_the_sections_of_the_drive_are_taken(sections, is_taken):
    own = '/left/stickslip_drive: {ros__parameters: {sim.seed: 8}}'
    read = parse_yaml(f'/**: {SHARED}\n{own}\n{sections}', 'run.yaml').changed()
    assert read == {'stand.preload': 0.2 if is_taken else 0.1, 'sim.seed': 8}


@pytest.mark.parametrize('name', ['/*', '/left/**', '/**/stickslip_drive', 'stickslip_drive'])
def test_a_drive_that_only_wildcards_name_may_be_in_any_namespace(name: str):
    read = parse_yaml(f'"{name}": {OWN}\n/other: {SHARED}\n', 'run.yaml')
    assert read.changed() == {'stand.preload': 0.2}


def test_a_file_that_never_ends_is_refused():
    with pytest.raises(RecordingError, match='is a device or a pipe, not a file; copy it to a'):
        load_yaml(Path('/dev/zero'))


def test_a_file_that_would_take_minutes_is_refused():
    with pytest.raises(
        RecordingError, match='5000000 characters of YAML, above the limit of 4000000'
    ):
        parse_yaml('x: 1\n' * 1_000_000, 'long.yaml')


def test_a_file_that_names_nothing_is_refused(tmp_path):
    path = tmp_path / 'stand.yaml'
    path.write_text('# nothing\n', encoding='utf-8')
    with pytest.raises(RecordingError, match=r'stand\.yaml: names no parameter; compare it'):
        load_yaml(path)
