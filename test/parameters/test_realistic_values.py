# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stands nearer to hardware are ROS parameter files whose every value exists, called assumed."""

from pathlib import Path

import pytest
import yaml

from stickslip_ros.parameters import specs

CONFIG = Path(__file__).parents[2] / 'config'
PATHS = [CONFIG / 'realistic.yaml', CONFIG / 'coupled.yaml']
INDENT_OF_GROUP, INDENT_OF_VALUE = 4, 6


def written(path: Path) -> dict[str, object]:
    """Give the values of the file by their full names."""
    groups = yaml.safe_load(path.read_text())['/**']['ros__parameters']
    return {
        f'{group}.{name}': value for group, each in groups.items() for name, value in each.items()
    }


def comments(path: Path) -> dict[str, str]:
    """Give, for every line with a value, the comment above it within its group."""
    found: dict[str, str] = {}
    group = comment = ''
    goes_on = False  # whether the line before was a comment too
    for line in path.read_text().splitlines():
        text = line.strip()
        indent = len(line) - len(line.lstrip())
        if indent == INDENT_OF_GROUP:
            group, comment = text.rstrip(':'), ''
        elif text.startswith('#'):
            comment = f'{comment} {text}' if goes_on else text
        elif indent == INDENT_OF_VALUE:
            found[f'{group}.{text.partition(":")[0]}'] = comment
        goes_on = text.startswith('#')
    return found


@pytest.mark.parametrize('path', PATHS, ids=lambda path: path.name)
def test_every_name_is_a_parameter(path: Path):
    assert written(path).keys() <= specs().keys()


@pytest.mark.parametrize('path', PATHS, ids=lambda path: path.name)
def test_every_value_stands_below_a_comment_that_calls_it_assumed(path: Path):
    found = comments(path)
    assert found.keys() == written(path).keys()
    assert [name for name, comment in found.items() if 'assumed' not in comment] == []
