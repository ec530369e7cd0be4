# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stages are files of parameters with a source and a range for each value, chosen by name."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from stickslip_ros import load_yaml, stage_file
from stickslip_ros.errors import StickSlipError, UnknownName
from stickslip_ros.lab.cli.chosen import chosen_parameters
from stickslip_ros.lab.cli.main import build_parser, main
from stickslip_ros.parameters import load_ranges
from stickslip_ros.parameters.stages import stage_files
from stickslip_ros.ros.start import with_stage

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / 'docs' / 'howto' / 'which_stage.md'
FILES = sorted((ROOT / 'config' / 'stages').iterdir())
NAMES = ['clamp', 'heavy', 'rod', 'three_balls', 'walker']
LISTED = f"stage 'screw' is not known; the stages are {', '.join(NAMES)}"

VALUE = re.compile(r'^((?: {6}# .*\n)*) {6}(\w+): (.+)$', re.MULTILINE)
"""A value of a group, and the comment right above it."""
FROM_TO = re.compile(r'; (\S+) to (\S+)$')
ONE_OF = re.compile(r'; (.+) or (\w+)$')


def is_in_range(value: Any, comment: str) -> bool:
    """Return whether a comment ends with a range, or with choices, that hold the value."""
    if found := ONE_OF.search(comment):
        return str(value).lower() in [*found[1].split(', '), found[2]]
    found = FROM_TO.search(comment)
    return found is not None and float(found[1]) <= value <= float(found[2])


def faults_of(text: str) -> list[str]:
    """Return the values of a stage that lack a source, or a range that holds them."""
    faults = []
    for above, name, written in VALUE.findall(text):
        comment = ' '.join(line.strip(' #') for line in above.splitlines())
        values = yaml.safe_load(f'[{written.strip("[]")}]')
        if not comment.startswith('assumed: ') and not re.search(r'https://\S+\.\S+', comment):
            faults.append(f'{name}: no source')
        if not all(is_in_range(each, comment) for each in values):
            faults.append(f'{name}: no range, or outside it')
    return faults


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.stem)
def test_every_value_of_a_stage_has_a_source_or_is_assumed_and_lies_in_its_range(file: Path):
    text = file.read_text(encoding='utf-8')
    groups = yaml.safe_load(text)['/**']['ros__parameters']
    assert len(VALUE.findall(text)) == sum(map(len, groups.values()))
    assert faults_of(text) == []


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.stem)
def test_the_ranges_that_a_fit_reads_are_those_of_the_comments(file: Path):
    text, told = file.read_text(encoding='utf-8'), dict[str, tuple[float, float]]()
    for group, body in re.findall(r'^ {4}(\w+):\n((?: {6}.*\n)+)', text, re.MULTILINE):
        for above, name, _ in VALUE.findall(body):
            comment = ' '.join(line.strip(' #') for line in above.splitlines())
            if found := FROM_TO.search(comment):
                told[f'{group}.{name}'] = float(found[1]), float(found[2])
    ranges, stand = load_ranges(file), load_yaml(stage_file(file.stem))
    assert {name.partition('[')[0]: each for name, each in ranges.items()} == told
    assert stand.ranges == ranges
    for name, (low, high) in ranges.items():
        assert low <= np.min(stand.value(name)) <= np.max(stand.value(name)) <= high


def test_a_given_value_has_no_range_any_more_wherever_it_was_given(tmp_path: Path):
    file = tmp_path / 'own.yaml'
    file.write_text('/**: {ros__parameters: {feet: {share: [1.0, 0.06]}}}')
    words = ['fit', 'x.csv', '--free', 'runner.mass', '--stage', 'clamp', '--params', str(file)]
    words += ['--set', 'contact.radius=5mm', '--preload', '8']
    stand = chosen_parameters(build_parser(words[:1]).parse_args(words))
    whole = load_ranges(stage_file('clamp'))
    assert whole.keys() - stand.ranges.keys() == {'feet.share[1]', 'contact.radius'}
    assert 'runner.mass' not in stand.updated({'runner.mass': 0.03}).ranges


@pytest.mark.parametrize(
    ('ranges', 'message'),
    [
        ('{runner.mas: [1.0, 2.0]}', 'did you mean runner.mass'),
        ('{runner.mass: [2.0, 1.0]}', 'write runner.mass: [LOW, HIGH]'),
        ('{runner.mass: 2.0}', 'not a low and a high number'),
    ],
)
def test_a_range_that_is_none_is_refused(ranges: str, message: str, tmp_path: Path):
    file = tmp_path / 'own.yaml'
    values = '{ros__parameters: {runner: {mass: 1.5}}}'
    file.write_text(f'/**: {values}\n/ranges: {{ros__parameters: {ranges}}}')
    with pytest.raises(StickSlipError, match=re.escape(message)):
        load_yaml(file)


def test_the_stages_are_those_of_the_folder_which_are_installed_and_explained(keywords):
    assert list(stage_files()) == [file.stem for file in FILES] == NAMES
    installed = dict(keywords['data_files'])['share/stickslip_ros/config/stages']
    assert installed == [f'config/stages/{file.name}' for file in FILES]
    page = PAGE.read_text(encoding='utf-8')
    assert 'stickslip drive --stage clamp\n' in page
    assert [name for name in NAMES if f'\n## {name}\n' not in page] == []


def test_an_unknown_stage_is_refused_with_the_names(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(UnknownName, match=re.escape(LISTED)):
        stage_file('screw')
    assert main(['simulate', '--stage', 'screw']) == 2
    assert capsys.readouterr().err == f'stickslip: {LISTED}\n'


def test_a_stage_comes_before_files_wherever_it_is_typed():
    words = ['drive', '--params', 'a.yaml', '--stage', 'rod', '--params', 'b.yaml']
    parsed = build_parser(words[:1]).parse_args(words)
    assert parsed.params == [stage_file('rod'), Path('a.yaml'), Path('b.yaml')]


def test_files_and_single_values_win_over_the_stage(tmp_path, capsys):
    file = tmp_path / 'own.yaml'
    file.write_text('/**: {ros__parameters: {runner: {mass: 0.04, damping: 9.0}}}')
    words = ['--set', 'runner.damping=8', '--params', str(file), '--stage', 'clamp', '--json']
    assert main(['parameters', *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told['runner.mass'], told['runner.damping']) == (0.04, 8.0)
    assert told['stand.preload'] == load_yaml(stage_file('clamp')).stand.preload


def test_the_executable_hands_the_file_of_its_stage_to_ros_before_other_words():
    file = str(stage_file('rod'))
    given = ['--ros-args', '--params-file', 'own.yaml']
    words = with_stage(['drive', '--stage', 'rod', *given])
    assert words == ['drive', '--ros-args', '--params-file', file, '--', *given]
    assert with_stage(['drive', *given, '--stage', 'rod']) == ['drive', *given, '--stage', 'rod']
    with pytest.raises(UnknownName, match="stage '' is not known"):
        with_stage(['drive', '--stage'])
