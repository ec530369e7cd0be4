# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""An event is read as it was written; a foreign text is no event."""

import json
from typing import Any

import pytest

from stickslip_ros.instrument.reports import EVENT_MAX, Event, Result, read_event

EVENT = Event(5, 1, 'steps', Result.ABORTED, 4, 'stopped by command 2')
NESTED = f'{{"message": {"[" * 1500}{"]" * 1500}}}'


@pytest.mark.parametrize(
    'more',
    [
        {},
        {'stamp_ns': 1_800_000_000_123_456_789},
        {'tag': 'left', 'step_m': 0.0},
        {'step_m': -9.4e-8},
    ],
)
def test_an_event_comes_back_from_its_text(more: dict[str, Any]):
    text = Event(**{**vars(EVENT), **more}).to_json()
    assert read_event(text) == json.loads(text)
    assert json.loads(text).items() >= more.items()
    assert json.loads(text).keys() == json.loads(EVENT.to_json()).keys() | more.keys()


@pytest.mark.parametrize(
    'text',
    ['', 'no JSON', '[]', '7', '"message"', 'null', '{"result": "DONE"}', '[' * 5000, NESTED],
)
def test_a_text_that_is_no_event_is_none(text: str):
    assert read_event(text) is None


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('message', 7),
        ('message', 'x' * EVENT_MAX),
        ('result', None),
        ('command', ['steps']),
        ('number', '1'),
        ('number', True),
        ('steps', 1.5),
        ('time_ns', float('nan')),
        ('time_ns', 10**400),
        ('stamp_ns', {}),
        ('tag', 7),
        ('step_m', 1),
        ('step_m', float('nan')),
    ],
)
def test_an_event_with_a_field_of_another_kind_is_none(name: str, value: Any):
    assert read_event(json.dumps({**json.loads(EVENT.to_json()), name: value})) is None


def test_of_an_event_nothing_is_kept_that_it_does_not_have():
    content = json.loads(EVENT.to_json())
    assert read_event(json.dumps({**content, 'more': [[]]})) == content
