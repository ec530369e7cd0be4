"""What the page is told of a drive, from what was heard of it; no ROS, no browser."""

import json
import struct
from typing import Any

import numpy as np
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import COMMANDS as COMMAND_ROWS
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import COMMAND_TOPICS, SERVICES
from stickslip_ros.panel import model as panel_model
from stickslip_ros.panel.controls import read_fault, read_numbers, sheet, shown_parameters
from stickslip_ros.panel.model import Model, parsed_event
from stickslip_ros.parameters import spec_of, specs

DRIVE = '/stickslip_drive'


def block(start_s: float, seconds: float = 0.01) -> np.ndarray:
    """Give samples at rest: 1 um, 2 mN, 30 V."""
    time_s = start_s + np.arange(round(50e3 * seconds)) / 50e3
    return np.column_stack([time_s, *(np.full(len(time_s), v) for v in (30.0, 16e-9, 1e-6, 2e-3))])


def opened(frame: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Read a picture as the page does."""
    [size] = struct.unpack('<I', frame[:4])
    head, at, curves = json.loads(frame[4 : 4 + size]), 4 + size, {}
    for name, count, _ in head['curves']:
        curves[name] = np.frombuffer(frame, '<f4', 2 * count, at).reshape(2, count)
        at += 8 * count
    assert at == len(frame)
    return head, curves


def an_event(**changes: Any) -> dict[str, Any]:
    fields = {'message': '', 'result': 'DONE', 'command': 'steps', 'number': 1, 'steps': 4}
    return {**fields, 'time_ns': 5, **changes}


@pytest.fixture
def model() -> Model:
    """Give a model of a drive that runs."""
    model = Model(DRIVE)
    model.is_there, model.lifecycle = True, 'active'
    model.take_trace(block(0.0))
    return model


def test_a_picture_has_figures_and_curves(model: Model):
    head, curves = opened(model.frame())
    assert head['time_s'] == pytest.approx(0.00998)
    assert head['figures'] == pytest.approx({'position': 1e-6, 'force': 2e-3, 'voltage': 30.0})
    assert curves.keys() == {'position', 'force', 'foot', 'runner', 'voltage'}
    assert curves['voltage'][1].tolist() == [30.0] * curves['voltage'].shape[1]


def test_a_picture_is_made_once_until_there_is_news(model: Model):
    assert model.frame() is not None
    assert model.frame() is None
    model.take_trace(block(0.01))
    assert model.frame() is not None
    model.choose({'cycles': 5})
    assert model.frame() is not None
    assert model.state()['view']['cycles'] == 5


@pytest.mark.parametrize(
    'choice', [{'cycles': 4}, {'span_s': 'x'}, {'triggers': 1}, {'cycles': []}]
)
def test_a_choice_that_is_not_offered_is_passed_over(model: Model, choice: dict[str, Any]):
    before = dict(model.state()['view'])
    model.choose(choice)
    assert model.state()['view'] == before


def test_a_lost_reading_is_no_figure(model: Model):
    lost = block(0.01)
    lost[:, 3] = np.nan
    model.take_trace(lost)
    head, _ = opened(model.frame())
    assert head['figures']['position'] is None
    assert head['figures']['force'] == pytest.approx(2e-3)


def test_what_was_before_a_new_start_of_time_is_forgotten(model: Model):
    model.take_trace(block(50.0))
    model.take_trace(block(0.0))
    head, curves = opened(model.frame())
    assert head['time_s'] == pytest.approx(0.00998)
    assert curves['position'].shape[1] == 2


def test_conditions_are_told_apart(model: Model, monkeypatch: pytest.MonkeyPatch):
    def time(level: int, paused: str) -> None:
        model.take_part('time', level, 'real-time factor 0.5 instead of 1', {'paused': paused})

    assert model.condition()[0] == 'running'
    time(2, 'false')
    assert model.condition() == ('late', 'real-time factor 0.5 instead of 1')
    time(0, 'true')
    assert model.condition()[0] == 'paused'
    model.take_pause(is_paused=False)
    assert model.condition()[0] == 'running'
    monkeypatch.setattr(panel_model, 'monotonic', lambda: 1e9)
    assert model.condition()[0] == 'waiting'
    model.lifecycle = 'inactive'
    assert model.condition()[0] == 'inactive'
    model.lifecycle = ''
    assert model.condition()[0] == 'silent'
    model.is_there = False
    assert model.condition() == ('absent', f'no drive {DRIVE} in this ROS domain; waiting for it')


def test_a_refusal_stands_beside_its_control_and_in_the_list(model: Model):
    refused = an_event(command='voltage', result='INVALID_PARAMETER', message='320 V is too much')
    model.take_event(refused)
    model.take_event(an_event())
    told = model.state()
    assert told['notes']['voltage']['text'] == 'INVALID_PARAMETER: 320 V is too much'
    assert told['notes']['voltage']['bad']
    assert told['notes']['steps'] == {'text': 'DONE', 'bad': False, 'number': 2}
    assert told['events'] == [refused, an_event()]


def test_of_events_the_last_are_kept(model: Model):
    for number in range(1000):
        model.take_event(an_event(number=number))
    assert [each['number'] for each in model.state()['events']] == list(range(940, 1000))


@pytest.mark.parametrize('text', ['', 'no JSON', '[]', '{"result": "DONE"}', '7'])
def test_a_text_that_is_no_event_of_ours_is_none(text: str):
    assert parsed_event(text) is None


def test_another_drive_begins_with_nothing(model: Model):
    model.note('voltage', 'refused', bad=True)
    model.take_status(7)
    model.forget('/left/stickslip_drive')
    told = model.state()
    assert (told['drive'], told['bits'], told['notes']) == ('/left/stickslip_drive', 0, {})
    assert opened(model.frame())[1] == {}


def test_every_command_service_fault_and_bit_has_a_control_by_itself():
    told = sheet()
    assert [each['name'] for each in told['commands']] == [
        name for name, row in COMMAND_ROWS.items() if row.has_topic and name != 'joint'
    ]
    assert len(told['services']) == len(SERVICES)
    assert {each['name'] for each in told['faults']} == {
        name for name, spec in specs().items() if spec.live
    }
    assert [each['bit'] for each in told['bits']] == [int(bit) for bit in Status]
    assert json.loads(json.dumps(told))


def test_limits_and_first_values_name_parameters_that_there_are():
    told = [number for each in sheet()['commands'] for number in each['numbers']]
    named = {
        value.removeprefix('-')
        for number in told
        for value in (number['low'], number['high'], number['start'])
        if isinstance(value, str)
    }
    assert named <= set(shown_parameters())
    assert all(spec_of(name).kind is float for name in named)


def topic(name: str) -> Any:
    return next(each for each in COMMAND_TOPICS if each.request == name)


def test_numbers_of_the_page_are_those_that_somebody_chooses():
    assert read_numbers(topic('position'), [1e-6]) == [1e-6]
    assert read_numbers(topic('sawtooth'), [300, '500', 0]) == [300.0, 500.0, 0.0]
    assert read_numbers(topic('waveform'), [0, 1, 2, 3]) == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('voltage', None),
        ('voltage', []),
        ('voltage', ['much']),
        ('voltage', [[1]]),
        ('voltage', [1, 2]),
        ('waveform', [1, 2, 3]),
        ('waveform', []),
        ('steps', [1.5]),
        ('steps', [float('nan')]),
        ('steps', [float('inf')]),
        ('steps', [2.0**31]),
        ('load', [1, 0, 0, 0, 0, 0]),
    ],
)
def test_numbers_that_no_message_can_carry_are_refused(name: str, values: Any):
    with pytest.raises(StickSlipError, match=name):
        read_numbers(topic(name), values)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('fault.schedule', '/etc/passwd'),
        ('sim.seed', 3),
        (None, 3),
        (['fault.dead_foot'], 3),
        ('fault.dead_foot', 7),
        ('fault.interferometer', 'broken'),
    ],
)
def test_nothing_but_a_fault_can_be_set(name: Any, value: Any):
    with pytest.raises(StickSlipError):
        read_fault(name, value)
    assert read_fault('fault.dead_foot', 3) == ('fault.dead_foot', 3)
