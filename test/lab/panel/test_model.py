# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the page is told of a drive, from what was heard of it; no ROS, no browser."""

import json
import math
import struct
from typing import Any

import numpy as np
import pytest
from test_curves import sawtooth_samples

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.instrument.commands import COMMANDS as COMMAND_ROWS
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import SERVICES
from stickslip_ros.lab.panel.controls import NUMBER_FIELDS, read_parameter, sheet
from stickslip_ros.lab.panel.curves import SAMPLE_COLUMNS
from stickslip_ros.lab.panel.model import PANEL, RANGE, Model
from stickslip_ros.lab.panel.settings import read_settings
from stickslip_ros.parameters import Parameters, is_fault, spec_of, specs

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
    figures = {'position': 1e-6, 'force': 2e-3, 'voltage': 30.0, 'velocity': 0.0}
    assert head['figures'] == pytest.approx(figures, abs=1e-18)
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


@pytest.mark.parametrize('choice', [{'cycles': 4}, {'span_s': 'x'}, {'cycles': []}])
def test_a_choice_that_is_not_offered_is_passed_over(model: Model, choice: dict[str, Any]):
    before = dict(model.state()['view'])
    model.choose(choice)
    assert model.state()['view'] == before


@pytest.mark.parametrize('velocity_m_per_s', [50e-6, -1e-3])
def test_the_velocity_is_the_slope_of_the_position(model: Model, velocity_m_per_s: float):
    moving = block(0.01, 0.3)
    moving[:, 3] = 5e-3 + velocity_m_per_s * moving[:, 0] + 4e-9 * np.sin(3e3 * moving[:, 0])
    model.take_trace(moving)
    head, _ = opened(model.frame())
    assert head['figures']['velocity'] == pytest.approx(velocity_m_per_s, rel=1e-2)
    moving[-1, 3] = np.nan
    moving[:, 0] += 0.3
    model.take_trace(moving)
    assert opened(model.frame())[0]['figures']['velocity'] is None


def test_a_target_is_told_as_long_as_closed_loop_goes_there(model: Model):
    model.take_sent('position', 5e-7)
    assert model.state()['target_m'] is None
    model.take_status(Status.CLOSED_LOOP)
    assert model.state()['target_m'] == 5e-7
    model.take_event(an_event(command='position', result='ABORTED'))  # of the target before
    assert model.state()['target_m'] == 5e-7
    model.take_sent('position', 9e-3)
    refusal = an_event(command='position', result='INVALID_PARAMETER', number=3)
    model.take_event(refusal | {'message': 'x 0.009 m is too far'})
    model.take_event(an_event(command='position', number=2))  # of the first target
    told = model.state()
    assert told['target_m'] == 5e-7
    assert told['notes']['position']['text'] == 'INVALID_PARAMETER: x 9000000 nm is too far'
    model.take_sent('position', float('nan'))
    assert model.state()['target_m'] is None


@pytest.mark.parametrize('stamps_ns', [(0, 0, 0, 0), (1, 2, 3, 4)])
def test_each_refusal_is_of_its_own_request_however_soon_the_next_one_comes(
    model: Model, stamps_ns: tuple[int, ...]
):
    model.take_status(Status.CLOSED_LOOP)
    for x_m, stamp_ns in zip((5e-7, 9e-3, 8e-3, 6e-7), stamps_ns, strict=True):
        model.take_sent('position', x_m, stamp_ns)
    for number, x_m in ((2, 9e-3), (3, 8e-3)):
        refused = an_event(command='position', number=number, result='INVALID_PARAMETER')
        stamp = {'sent_ns': stamps_ns[number - 1]} if stamps_ns[0] else {}
        model.take_event(
            refused | stamp | {'message': f'position x {x_m:g} m is outside 0 to 6e-07 m'}
        )
        assert model.state()['target_m'] == 6e-7
    model.take_event(refused | {'message': 'the amplifier is off', 'sent_ns': stamps_ns[3]})
    assert model.state()['target_m'] == 5e-7

    model.take_parameters(Parameters().flat())
    for preload_n in (0.25, 9.0, 8.0):
        model.take_sent('preload', preload_n)
    model.take_event(an_event(command='preload'))  # of the first
    for preload_n in (9.0, 8.0):
        refused = an_event(command='preload', result='INVALID_PARAMETER')
        model.take_event(refused | {'message': f'preload {preload_n:g} N is above'})
    assert '= 250 mN' in model.drawing()


def test_a_preload_that_is_stopped_midway_is_shown_as_such(model: Model):
    model.take_sent('preload', 0.9)
    stopped = an_event(command='preload', result='ABORTED', message='reset by command 2')
    model.take_event(stopped)
    told = model.state()
    text = 'ABORTED: stopped midway, reset by command 2'
    assert told['notes']['preload'] == {'text': text, 'bad': True, 'number': 1}
    assert told['events'][-1]['message'] == 'stopped midway, reset by command 2'


def test_a_preload_that_a_command_has_set_is_drawn_and_saved_until_a_reset(model: Model):
    model.take_parameters(Parameters().flat())
    assert '= 500 mN' in model.drawing()
    for preload_n, result in ((0.25, 'DONE'), (9.0, 'INVALID_PARAMETER')):
        model.take_sent('preload', preload_n)
        model.take_event(an_event(command='preload', result=result))
    assert '= 250 mN' in model.drawing()
    assert 'preload: 0.25' in model.settings()
    model.take_event(an_event(command='reset'))
    assert '= 500 mN' in model.drawing()


def test_a_film_does_not_reach_back_beyond_a_new_zero_of_position(model: Model):
    model.take_parameters(Parameters().flat())
    model.take_trace(sawtooth_samples(0.2, 100.0, 0.1), SAMPLE_COLUMNS)
    assert 'magnified' in model.drawing()
    model.take_event(an_event(command='zero_position', time_ns=290_000_000))
    assert 'magnified' not in model.drawing()


def test_what_was_before_a_new_start_of_time_is_forgotten(model: Model):
    model.take_trace(block(50.0))
    model.take_trace(block(0.0))
    head, curves = opened(model.frame())
    assert head['time_s'] == pytest.approx(0.00998)
    assert curves['position'].shape[1] == 2


def test_conditions_are_told_apart(model: Model):
    def time(level: int, paused: str) -> None:
        model.take_part('time', level, 'real-time factor 0.5 instead of 1', {'paused': paused})

    assert model.condition()[0] == 'running'
    time(2, 'false')
    assert model.condition() == ('late', 'real-time factor 0.5 instead of 1')
    time(0, 'true')
    assert model.condition()[0] == 'paused'
    model.take_pause(is_paused=False)
    assert model.condition()[0] == 'running'
    model.count_silence(2.2)
    why = 'the drive waits for grants, or is held up'
    assert model.condition() == ('waiting', f'no data for 2 s: {why}')
    model.lifecycle = 'inactive'
    assert model.condition()[0] == 'inactive'
    model.lifecycle = ''
    model.take_trace(block(1.0))
    model.count_silence(1.0)
    assert model.condition() == ('silent', f'{DRIVE} does not answer; waiting for it')
    model.count_silence(1.2)
    gone = 'no data for 2 s, its process may be gone; waiting for it'
    assert model.condition() == ('silent', f'{DRIVE} does not answer: {gone}')
    model.is_there = False
    assert model.condition() == ('absent', f'no drive {DRIVE} in this ROS domain: {gone}')
    model.take_trace(block(2.0))
    assert model.condition()[0] == 'foreign'  # as of a bag that plays
    model.count_silence(2.0)
    assert model.condition()[0] == 'absent'
    model.forget()  # one that has not been heard yet
    absent = f'no drive {DRIVE} in this ROS domain; waiting for it'
    assert model.condition() == ('absent', absent)
    model.drives = ['/a/b', '/c']
    assert model.condition() == ('absent', f'{absent} (seen: /a/b, /c)')


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


def test_notes_of_names_that_no_control_has_are_one_above_the_page_and_short(model: Model):
    for number in range(100):
        model.note(f'invented {number}', 'x' * 100_000, bad=True)
        model.take_part(f'invented {number}', 2, '', {})
    told = model.state()
    assert told['notes'].keys() == {PANEL}
    assert told['notes'][PANEL]['number'] == 100
    assert told['parts'] == {}
    assert len(json.dumps(told)) < 2000


def test_what_is_heard_of_a_twin_is_a_picture_of_its_own_once_and_for_each_new_page(model: Model):
    assert model.twin_frame() is not None  # which says that there is none
    assert (model.frame() is not None, model.frame()) == (True, None)
    assert model.twin_frame() is None
    model.take_twin_row('parameters', ['t[s]', 'runner.mass', 'runner.mass_sigma'], [1, 2, 0.1])
    head, curves = opened(model.twin_frame())
    assert head['twin']['fits'] == [['runner.mass', '2 ± 0.1 kg']]
    assert set(curves) == {'runner.mass', 'runner.mass low', 'runner.mass high'}
    assert (model.twin_frame(), model.frame()) == (None, None)
    model.choose({})
    assert opened(model.twin_frame())[0] == head


@pytest.mark.parametrize(
    'times_s', [[], [0.1, 0.05], [0.1, math.nan, 0.2], [math.inf], [-1.0], [0.1, 1e300]]
)
def test_a_trace_without_rising_times_is_refused_and_the_picture_stays(model, times_s):
    model.take_trace(block(0.0))
    before = model.frame()
    with pytest.raises(WrongKind, match=r't\[s\] of a trace .* is not a list that rises from 0'):
        model.take_trace(np.array(times_s)[:, None], ['t'])
    with pytest.raises(WrongKind, match='rises'):
        model.take_trace(np.zeros((3, 1)), ['voltage'])
    model.choose({})
    assert model.frame() == before


def test_a_lost_reading_and_numbers_that_no_picture_can_hold_are_gaps(model: Model):
    for odd in (math.nan, math.inf, 1e300):
        moving = block(0.0)
        moving[:, 3] = odd
        model.take_trace(moving)
        figures = opened(model.frame())[0]['figures']
        assert figures['position'] is None
        assert figures['force'] == pytest.approx(2e-3)


def test_another_drive_begins_with_nothing(model: Model):
    model.note('voltage', 'refused', bad=True)
    model.take_status(7)
    model.forget('/left/stickslip_drive')
    told = model.state()
    assert (told['drive'], told['bits'], told['notes']) == ('/left/stickslip_drive', 0, {})
    assert opened(model.frame())[1] == {}
    assert opened(model.twin_frame())[0]['twin']['fits'] == []


def test_every_command_service_fault_and_bit_has_a_control_by_itself():
    told = sheet()
    assert [each['name'] for each in told['commands']] == [
        name for name, row in COMMAND_ROWS.items() if row.has_topic and name != 'joint'
    ]
    assert len(told['services']) == len(SERVICES)
    assert set(told['faults']) == set(filter(is_fault, specs()))
    assert [each['bit'] for each in told['bits']] == [int(bit) for bit in Status]
    assert json.loads(json.dumps(told))


def test_limits_and_first_values_name_parameters_that_there_are():
    named = {
        str(each).removeprefix('-')
        for field in NUMBER_FIELDS.values()
        for each in (field.low, field.high, field.start)
        if isinstance(each, str)
    }
    assert all(spec_of(name).kind is float for name in named - {RANGE})


def test_the_amplitude_of_a_bipolar_amplifier_goes_up_to_its_range(model: Model):
    wide = {'amplifier.voltage_min': -200.0, 'amplifier.voltage_max': 200.0}
    model.take_parameters(Parameters().flat() | wide)
    assert model.state()['parameters'][RANGE] == 400.0


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('fault.schedule', '/etc/passwd'),
        ('sim.seed', 3),
        (None, 3),
        ('fault.dead_foot', 13),
        ('fault.interferometer', 'broken'),
        ('load_cell.contact', 'absent'),
    ],
)
def test_nothing_but_a_live_parameter_can_be_set_at_once(name: Any, value: Any):
    with pytest.raises(StickSlipError):
        read_parameter(name, value)
    assert read_parameter('fault.dead_foot', '3') == ('fault.dead_foot', 3)
    assert read_parameter('limits.soft_max', '2 um') == ('limits.soft_max', 2e-6)


def test_the_page_names_no_file_or_folder_of_a_drive():
    for name in ('record.directory', 'fault.schedule', 'sim.checkpoint'):
        with pytest.raises(StickSlipError, match='start the drive with it'):
            read_settings({name: '/etc/passwd'})
