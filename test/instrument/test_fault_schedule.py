# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A schedule of faults is read strictly, and gives each entry once when its time has come."""

from pathlib import Path

import pytest

from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.fault_schedule import (
    FAULTS,
    FaultSchedule,
    parse_schedule,
    read_schedule,
)
from stickslip_ros.parameters import Parameters

FEET = Parameters().feet
SECOND_NS = 1_000_000_000
TEXT = """
- {at: 1.0, clear: true}
- {at: 0.5, set: {fault.interferometer: freeze, dead_foot: 2}}
- {at: 1.0, set: {missed_steps: 1}}
- {at: 0, set: {command_delay: 1e-3}}
"""


def test_entries_come_once_each_in_the_order_of_time_then_of_the_file():
    schedule = parse_schedule(TEXT, 'file', FEET)
    assert schedule.due(-1) == []
    assert schedule.due(0) == [Request('fault', settings=(('fault.command_delay', 1e-3),))]
    assert schedule.due(SECOND_NS // 2 - 1) == []
    assert schedule.due(SECOND_NS // 2) == [
        Request('fault', settings=(('fault.interferometer', 'freeze'), ('fault.dead_foot', 2)))
    ]
    assert schedule.due(2 * SECOND_NS) == [
        Request('clear_faults'),
        Request('fault', settings=(('fault.missed_steps', 1.0),)),
    ]
    assert schedule.due(10**30) == []


def test_values_have_the_declared_kind():
    [request] = parse_schedule(
        '[{at: 0, set: {runner_stuck: true, load_cell_offset: 1}}]', 'f', FEET
    ).due(0)
    assert [type(value) for _, value in request.settings] == [bool, float]


def test_without_entries_nothing_is_ever_due():
    assert FaultSchedule().due(10**30) == []


def test_every_fault_can_be_scheduled_but_not_the_schedule():
    assert {f'fault.{name}' for name in vars(Parameters().fault)} - set(FAULTS) == {
        'fault.schedule'
    }


def test_a_file_is_read(tmp_path: Path):
    path = tmp_path / 'faults.yaml'
    path.write_text(TEXT)
    assert len(read_schedule(path, FEET).due(10**30)) == 4


@pytest.mark.parametrize(
    ('text', 'refusal', 'message'),
    [
        ('', RecordingError, 'f.yaml: holds no entry; write - {at: 0.5, set: '),
        ('# nothing', RecordingError, 'f.yaml: holds no entry'),
        ('[]', RecordingError, 'f.yaml: holds no entry'),
        ('{at: 1}', WrongKind, 'is not a list of entries; write'),
        ('much', WrongKind, "f.yaml 'much' is not a list of entries"),
        ('- {at: 1', RecordingError, 'f.yaml: is not YAML ('),
        ('- {at: 1.0, at: 2.0, clear: true}', RecordingError, "line 1: 'at' is already in line 1"),
        ('- {at: 1:30, clear: true}', RecordingError, 'YAML reads 1:30 as 90, in base 60'),
        (
            '- {at: 1, set: {fault.dead_foot: 1, dead_foot: 2}}',
            WrongKind,
            'is not a table with each fault once',
        ),
        ('- 3', WrongKind, 'f.yaml: entry 1 3 is not a time with either set or clear; write'),
        ('- {at: 1}', WrongKind, 'f.yaml: entry 1 '),
        ('- {at: 1, set: {dead_foot: 1}, clear: true}', WrongKind, 'f.yaml: entry 1 '),
        ('- {at: 1, when: 2}', WrongKind, 'f.yaml: entry 1 '),
        (
            '- {at: 0, clear: true}\n- {at: -0.1, clear: true}',
            OutOfRange,
            'f.yaml: entry 2: at -0.1 s is below 0 s; give seconds since the configuration',
        ),
        (
            '- {at: soon, clear: true}',
            WrongKind,
            (
                "f.yaml: entry 1: at 'soon' is not a number in us, ms or s; "
                'give a quantity such as 2ms or 2e-3'
            ),
        ),
        ('- {at: .nan, clear: true}', WrongKind, 'entry 1: at nan is not a finite number'),
        ('- {at: .inf, clear: true}', WrongKind, 'entry 1: at inf is not a finite number'),
        ('- {at: true, clear: true}', WrongKind, 'entry 1: at True is not a finite number'),
        ('- {at: [1], clear: true}', WrongKind, 'entry 1: at [1] is not a finite number'),
        ('- {at: 1, clear: false}', WrongKind, 'entry 1: clear False is not true'),
        ('- {at: 1, set: {}}', WrongKind, 'entry 1: set {} is not a table of faults'),
        ('- {at: 1, set: freeze}', WrongKind, 'is not a table of faults'),
        (
            '- {at: 1, set: {dead_feet: 1}}',
            UnknownName,
            ("f.yaml: entry 1: fault 'dead_feet' is not known; did you mean fault.dead_foot?"),
        ),
        ('- {at: 1, set: {schedule: x.yaml}}', UnknownName, "fault 'schedule' is not known"),
        ('- {at: 1, set: {stand.preload: 1}}', UnknownName, "'stand.preload' is not known"),
        (
            '- {at: 1, set: {dead_foot: 7}}',
            OutOfRange,
            'f.yaml: entry 1: fault.dead_foot 7 is above the number of feet, 6; lower it',
        ),
        (
            '- {at: 1, set: {interferometer: broken}}',
            OutOfRange,
            "fault.interferometer 'broken' is not one of the choices; use none, freeze, dropout",
        ),
        ('- {at: 1, set: {missed_steps: .nan}}', WrongKind, 'is not a finite number'),
    ],
)
def test_a_bad_schedule_is_refused_with_file_entry_value_and_mend(text, refusal, message):
    with pytest.raises(refusal) as caught:
        parse_schedule(text, 'f.yaml', FEET)
    assert message in str(caught.value)
    assert 'f.yaml' in str(caught.value)


@pytest.mark.parametrize('kind', ['missing', 'folder', 'binary'])
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, kind: str):
    path = tmp_path / kind
    if kind == 'folder':
        path.mkdir()
    elif kind == 'binary':
        path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(RecordingError, match=kind):
        read_schedule(path, FEET)
