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
        {'sent_ns': 1_800_000_000_123_456_789},
        {'position_m': 1.5e-6, 'force_n': -0.25},
        {'tag': 'left', 'step_m': 0.0},
        {'step_m': -9.4e-8},
    ],
)
def test_an_event_comes_back_from_its_text(more: dict[str, Any]):
    text = Event(**{**vars(EVENT), **more}).to_json()
    assert read_event(text) == json.loads(text)
    assert json.loads(text).items() >= more.items()
    assert json.loads(text).keys() == json.loads(EVENT.to_json()).keys() | more.keys()


def test_an_event_has_its_stamp_in_the_time_of_all_streams():
    content = json.loads(EVENT.to_json(1_800_000_000_000_000_000))
    assert (content['time_ns'], content['stamp_ns']) == (5, 1_800_000_000_000_000_005)


def test_of_an_event_of_version_1_0_0_the_stamp_is_that_of_its_sender():
    content = json.loads(EVENT.to_json())
    old = {k: v for k, v in content.items() if k not in {'stamp_ns', 'position_m', 'force_n'}}
    assert read_event(json.dumps(old)) == old
    assert read_event(json.dumps({**old, 'stamp_ns': 7})) == {**old, 'sent_ns': 7}


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
        ('sent_ns', 1.5),
        ('position_m', '1'),
        ('force_n', float('nan')),
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
