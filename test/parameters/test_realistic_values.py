"""config/realistic.yaml is a ROS parameter file whose every value exists and is called assumed."""

from pathlib import Path

import yaml

from stickslip_ros.parameters import specs

PATH = Path(__file__).parents[2] / 'config' / 'realistic.yaml'
INDENT_OF_GROUP, INDENT_OF_VALUE = 4, 6


def written() -> dict[str, object]:
    """Give the values of the file by their full names."""
    groups = yaml.safe_load(PATH.read_text())['/**']['ros__parameters']
    return {
        f'{group}.{name}': value for group, each in groups.items() for name, value in each.items()
    }


def comments() -> dict[str, str]:
    """Give, for every line with a value, the last comment above it within its group."""
    found: dict[str, str] = {}
    group = comment = ''
    for line in PATH.read_text().splitlines():
        text = line.strip()
        indent = len(line) - len(line.lstrip())
        if indent == INDENT_OF_GROUP:
            group, comment = text.rstrip(':'), ''
        elif text.startswith('#'):
            comment = text
        elif indent == INDENT_OF_VALUE:
            found[f'{group}.{text.partition(":")[0]}'] = comment
    return found


def test_every_name_is_a_parameter():
    assert written().keys() <= specs().keys()


def test_every_value_stands_below_a_comment_that_calls_it_assumed():
    told = comments()
    assert told.keys() == written().keys()
    assert [name for name, comment in told.items() if 'assumed' not in comment] == []
