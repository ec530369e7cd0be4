# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The client of a drive: hears it, commands it, and finds it again; real nodes, real DDS."""

import json
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, String
from test_model import opened

from stickslip_ros.instrument.reports import Status
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.cli.panel import NICENESS
from stickslip_ros.lab.panel import server
from stickslip_ros.lab.panel.link import Link
from stickslip_ros.lab.panel.model import APPLY, PANEL
from stickslip_ros.parameters import load_yaml
from stickslip_ros.testing import Stand

Wait = Callable[[Callable[[dict[str, Any]], object]], None]
BLOCK_S = 0.01
"""Longer than the default, so that a drive in real time costs less."""
BAD = "'x' is not a number; give a number in V, such as 120.5"
ACTIVE = ('running', 'late', 'waiting')
"""Words for a drive that is active, on a machine that may be busy."""


def word(told: dict[str, Any]) -> str:
    return str(told['condition']['word'])


def note(told: dict[str, Any], control: str) -> dict[str, Any]:
    return dict(told['notes'].get(control, {'text': '', 'bad': False}))


def recorder(told: dict[str, Any]) -> dict[str, str]:
    """Return the diagnostics of the recorder."""
    return dict(told['parts'].get('recorder', {}).get('values', {}))


def faults(told: dict[str, Any]) -> dict[str, str]:
    """Return the diagnostics of faults."""
    return dict(told['parts'].get('faults', {}).get('values', {}))


def applied(values: dict[str, str]) -> dict[str, Any]:
    """Return what the page wishes when Apply is pressed."""
    return {'do': 'apply', 'name': APPLY, 'values': values}


@pytest.fixture
def stand(start_drive: Callable[..., Stand]) -> Stand:
    """Give a drive that nobody waits for."""
    return start_drive({'sim.block': BLOCK_S}, wait=False)


def test_commands_are_carried_out_and_refusals_come_back(stand: Stand, link: Link, wait: Wait):
    wait(lambda told: word(told) in ACTIVE and told['parameters'])
    assert link.state()['parameters']['amplifier.voltage_max'] == 300.0
    link.do({'do': 'command', 'name': 'steps', 'values': [3]})
    wait(lambda told: note(told, 'steps')['text'] == 'DONE')
    assert link.state()['events'][-1]['steps'] == 3
    link.do({'do': 'command', 'name': 'voltage', 'values': [400]})
    wait(lambda told: note(told, 'voltage')['bad'])
    assert "above the amplifier's 300 V" in note(link.state(), 'voltage')['text']
    link.do({'do': 'command', 'name': 'voltage', 'values': ['x']})
    wait(lambda told: note(told, 'voltage')['text'] == BAD)
    link.do({'do': 'command', 'name': 'voltage', 'values': [150]})
    wait(lambda told: note(told, 'voltage')['text'] == 'DONE')

    def jogs(told: dict[str, Any]) -> bool:
        """Renew a jog, as the page does; return whether the drive carries it out."""
        link.do({'do': 'command', 'name': 'jog', 'values': [200]})
        return bool(told['bits'] & Status.MOVING)

    wait(jogs)
    link.do({'do': 'command', 'name': 'jog', 'values': [0]})
    wait(lambda told: note(told, 'jog')['text'].startswith('DONE'))
    wait(lambda told: not told['bits'] & Status.MOVING)


@pytest.mark.parametrize(
    ('line', 'why'),
    [
        ('grant 1 1', "command 'grant' is not known; use voltage, "),
        ('stop now', "stop number 'now' is not one of its numbers; stop takes no numbers"),
        ('stop', 'not asked: no drive /stickslip_drive in this ROS domain'),
        ('load 5V', "load force.x '5V' is not a number in uN, mN, N or kN"),
    ],
)
def test_a_line_that_is_no_command_is_refused_beside_its_script(
    link: Link, wait: Wait, line: str, why: str
):
    link.do({'do': 'line', 'name': 'script', 'text': line})
    wait(lambda told: why in note(told, 'script')['text'])


def test_a_command_is_not_sent_to_a_silent_drive_and_that_is_told(
    stand: Stand, link: Link, wait: Wait
):
    wait(lambda told: word(told) in ACTIVE)
    goes_on = Event()
    try:
        stand.drive.executor.create_task(goes_on.wait)
        wait(lambda told: word(told) == 'silent')
        link.do({'do': 'line', 'name': 'script', 'text': 'steps 3'})
        wait(lambda told: 'not sent: /stickslip_drive does' in note(told, 'script')['text'])
    finally:
        goes_on.set()
    wait(lambda told: word(told) in ACTIVE)


def test_services_are_called_and_answer(stand: Stand, link: Link, wait: Wait):
    wait(lambda told: word(told) in ACTIVE)
    link.do({'do': 'service', 'name': 'set_paused', 'wanted': True})
    wait(lambda told: word(told) == 'paused')
    wait(lambda told: note(told, 'set_paused')['text'].startswith('paused at'))
    link.do({'do': 'service', 'name': 'step_simulation', 'wanted': True})
    wait(lambda told: note(told, 'step_simulation')['text'].startswith('advanced to'))
    link.do({'do': 'service', 'name': 'set_paused', 'wanted': False})
    wait(lambda told: word(told) in ACTIVE)
    link.do({'do': 'service', 'name': 'set_recording', 'wanted': False})
    wait(lambda told: 'not recording' in note(told, 'set_recording')['text'])
    link.do({'do': 'service', 'name': 'set_recording', 'wanted': True})
    wait(lambda told: float(recorder(told).get('size_bytes', 0)) > 0)
    assert recorder(link.state()).keys() >= {'file', 'length_s', 'dropped'}
    link.do({'do': 'service', 'name': 'set_recording', 'wanted': False})
    wait(lambda told: not recorder(told).get('file'))
    link.do({'do': 'service', 'name': 'enable_amplifier', 'wanted': False})
    wait(lambda told: not told['bits'] & Status.AMPLIFIER_ENABLED)
    link.do({'do': 'command', 'name': 'steps', 'values': [1]})
    wait(lambda told: 'AMPLIFIER_DISABLED' in note(told, 'steps')['text'])


def test_faults_and_states_are_switched(stand: Stand, link: Link, wait: Wait):
    wait(lambda told: word(told) in ACTIVE)
    for name, value in (('interferometer', 'dropout'), ('runner_stuck', True)):
        link.do({'do': 'set', 'name': f'fault.{name}', 'value': value})
        wait(lambda told: faults(told).get(name) == str(value))  # noqa: B023 - at once
    assert link.state()['parts']['faults']['message'] == 'interferometer, runner_stuck'
    link.do({'do': 'set', 'name': 'fault.dead_foot', 'value': 9})
    wait(lambda told: 'above the number of feet, 6' in note(told, 'fault.dead_foot')['text'])
    link.do({'do': 'service', 'name': 'clear_faults', 'wanted': True})
    wait(lambda told: not told['bits'] & Status.FAULT and not faults(told))
    for contact in ('absent', 'attached'):
        link.do({'do': 'lifecycle', 'name': 'lifecycle', 'transition': 'deactivate'})
        wait(lambda told: word(told) == 'inactive')
        link.do({'do': 'command', 'name': 'voltage', 'values': [1]})
        wait(lambda told: 'the node is inactive' in note(told, 'voltage')['text'])
        link.do(applied({'load_cell.contact': contact}))
        wait(lambda told: note(told, APPLY)['text'] == 'applied')
        link.do({'do': 'lifecycle', 'name': 'lifecycle', 'transition': 'configure'})
        wait(lambda told: note(told, 'lifecycle')['bad'])
        link.do({'do': 'lifecycle', 'name': 'lifecycle', 'transition': 'activate'})
        wait(lambda told: word(told) in ACTIVE)
        link.do({'do': 'command', 'name': 'steps', 'values': [1]})
        wait(lambda told: note(told, 'steps')['text'] == 'DONE')


def test_parameters_are_applied_through_the_lifecycle_and_a_refusal_changes_nothing(
    start_drive: Callable[..., Stand], link: Link, wait: Wait, tmp_path: Path
):
    (tmp_path / 'no_folder').touch()
    given = {'sim.block': BLOCK_S, 'record.directory': str(tmp_path / 'no_folder')}
    stand = start_drive(given, wait=False)
    wait(lambda told: word(told) in ACTIVE and told['parameters'])
    bench = stand.drive.session.bench
    link.do(applied({'contact.friction': '0,25', 'runner.mass': '12 g'}))
    wait(lambda told: note(told, APPLY)['text'] == 'applied')
    wait(lambda told: told['changed'].get('runner.mass') == '0.012')
    assert stand.drive.session.bench is bench
    link.do(applied({'contact.radius': '0,4 mm', 'runner.mass': '13 g'}))
    wait(lambda told: note(told, APPLY)['text'] == 'applied; the drive began anew')
    wait(lambda told: told['changed'].get('runner.mass') == '0.013')
    drive = stand.drive.session.parameters
    assert (drive.contact.friction, drive.contact.radius) == (0.25, 0.4e-3)

    for values, why in (
        ({'contact.friction': '-3'}, 'contact.friction -3 is below the minimum 0.001'),
        ({'contact.friction': '3 kg'}, "contact.friction '3 kg' is not a finite number"),
        ({'limits.soft_min': '3 um', 'limits.soft_max': '2 um'}, 'is above limits.soft_max'),
    ):
        link.do(applied(values))
        wait(lambda told: why in note(told, APPLY)['text'])  # noqa: B023 - at once
        assert stand.drive.session.parameters == drive
    link.do(applied({'record.on_start': 'true'}))  # found when it is activated
    wait(lambda told: note(told, APPLY)['text'].endswith('; nothing is changed'))
    assert 'not activated' in note(link.state(), APPLY)['text']
    wait(lambda told: word(told) in ACTIVE)
    assert stand.drive.session.parameters == drive

    session = stand.drive.session
    link.do(applied({'limits.soft_max': '2 um', 'step.amplitude': '0,1 kV'}))
    wait(lambda told: note(told, APPLY)['text'] == 'applied')
    wait(lambda told: told['changed'].get('limits.soft_max') == '2000')
    assert stand.drive.session is session  # all live: the drive goes on
    link.do({'do': 'command', 'name': 'position', 'values': ['3 um']})
    wait(lambda told: 'RANGE_LIMIT_REACHED' in note(told, 'position')['text'])
    file = tmp_path / 'saved.yaml'
    file.write_text(link.settings())
    assert load_yaml(file) == session.parameters.updated(
        {'limits.soft_max': 2e-6, 'step.amplitude': 100.0}
    )
    stand.operator.set_parameter('closed_loop.velocity', 1e-6)
    wait(lambda told: told['changed'].get('closed_loop.velocity') == '1')


def test_a_twin_in_the_namespace_of_the_drive_is_heard(stand: Stand, link: Link, wait: Wait):
    kinds = {'position': PointStamped, 'residual': PointStamped}
    kinds |= {'steps': Float64MultiArray, 'parameters': Float64MultiArray}
    twin = {
        key: stand.operator.node.create_publisher(kind, f'/twin/{key}', 1000)
        for key, kind in kinds.items()
    }
    fit, window = 't[s],contact.friction,contact.friction_sigma', 't[s],steps'
    heard: dict[str, Any] = {}
    curves: set[str] = set()

    def publish(key: str, labels: str, row: list[float]) -> None:
        message = Float64MultiArray(data=[float(each) for each in row])
        message.layout.dim = [
            MultiArrayDimension(label='row', size=1, stride=len(row)),
            MultiArrayDimension(label=labels, size=len(row), stride=len(row)),
        ]
        twin[key].publish(message)

    def is_heard(_: Any) -> bool:
        """Publish a window and a fit; return whether the panel has heard all topics."""
        for at_ms in range(5):
            for key in ('position', 'residual'):
                message = PointStamped()
                message.header.stamp.sec, message.header.stamp.nanosec = 7, at_ms * 1_000_000
                twin[key].publish(message)
        publish('parameters', fit, [7.2, 0.24, 0.003])
        publish('steps', window, [7.2, 99])
        frame = link.twin_frame()
        if frame is not None:
            head, shown = opened(frame)
            heard.update(head['twin'])
            curves.update(shown)
        return curves >= {'twin_rig', 'twin_residual'} and heard['fits'] and heard['window']

    wait(is_heard)
    assert heard['fits'] == [['contact.friction', '0.24 ± 0.003 ']]
    assert heard['window']['steps'] == 99.0


def test_lines_are_services_too_and_have_units_with_blanks_and_commas(
    stand: Stand, link: Link, wait: Wait
):
    wait(lambda told: word(told) in ACTIVE)
    for line, name in (
        ('sawtooth 100 V 0,1 kHz 0', ''),
        ('stop', 'stop'),
        ('tare', 'tare_force'),
        ('zero_position', 'zero_position'),
        ('position 0,5 um', 'position'),
        ('reset', 'reset'),
        ('enable 0', 'enable_amplifier'),
        ('enable_amplifier 1', 'enable_amplifier'),
    ):
        count = sum(each['command'] == name for each in link.state()['events'])
        link.do({'do': 'line', 'name': 'script', 'text': line})
        if not name:
            wait(lambda told: told['bits'] & Status.MOVING)
            continue
        wait(lambda told: sum(e['command'] == name for e in told['events']) > count)  # noqa: B023
    assert [each['result'] for each in link.state()['events'][1:]] == ['DONE'] * 7
    assert not note(link.state(), 'script')['bad']


HOSTILE: tuple[dict[str, Any], ...] = (
    {},
    {'do': 'line', 'text': ['steps', 3]},
    {'do': 'line', 'name': 'script', 'text': 'steps 3000000000'},
    {'do': 'command'},
    {'do': 'command', 'name': 'grant', 'values': [1, 1]},
    {'do': 'command', 'name': 'steps', 'values': [1.5]},
    {'do': 'command', 'name': 'waveform', 'values': [0, 0, 1, 5], 'cycles': 99_999_999_999},
    {'do': 'command', 'name': 'voltage', 'values': [10**308]},
    {'do': 'service', 'name': 'change_state'},
    {'do': 'lifecycle', 'name': 'lifecycle', 'transition': 'shutdown'},
    {'do': 'set', 'name': 'sim.seed', 'value': 2},
    {'do': 'attach', 'drive': ['x']},
    {'do': 'view', 'cycles': {}},
)


def test_stop_is_heard_after_every_wish_and_every_text_that_makes_no_sense(
    stand: Stand, link: Link, wait: Wait
):
    wait(lambda told: word(told) in ACTIVE)
    link.do({'do': 'command', 'name': 'sawtooth', 'values': [100, 100, 0]})
    wait(lambda told: told['bits'] & Status.MOVING)
    event = {'result': 'DONE', 'command': 'reset', 'number': 1, 'steps': 0, 'time_ns': 0}
    publisher = stand.operator.node.create_publisher(String, 'stickslip_drive/event', 100)
    stand.operator.spin_until(lambda: publisher.get_subscription_count() > 1, 'the panel')

    def has_heard(told: dict[str, Any]) -> bool:
        """Return whether the panel hears the publisher; what comes before it does is lost."""
        publisher.publish(String(data=json.dumps({**event, 'message': 'the first'})))
        return any(each['message'] == 'the first' for each in told['events'])

    wait(has_heard)
    for message in (7, 'x' * 20_000, None):
        publisher.publish(String(data=json.dumps({**event, 'message': message})))
    publisher.publish(String(data=f'{{"message": {"[" * 1500}{"]" * 1500}}}'))
    publisher.publish(String(data=json.dumps({**event, 'message': 'the last'})))
    for wish in HOSTILE:
        link.do(wish)
    wait(lambda told: 'is not a whole number' in note(told, 'script')['text'])
    wait(lambda told: 'is not a whole number' in note(told, 'steps')['text'])
    wait(lambda told: 'cycles 99999999999' in note(told, 'waveform')['text'])
    wait(lambda told: any(each['message'] == 'the last' for each in told['events']))
    assert {type(each['message']) for each in link.state()['events']} == {str}
    link.do({'do': 'service', 'name': 'stop'})
    wait(lambda told: not told['bits'] & Status.MOVING)


def test_what_nobody_has_foreseen_is_said_above_the_page_and_stop_is_still_heard(
    stand: Stand, link: Link, wait: Wait, monkeypatch: pytest.MonkeyPatch
):
    wait(lambda told: word(told) in ACTIVE)
    monkeypatch.setitem(link._acts, 'divide', lambda _: 1 / 0)
    link.do({'do': 'divide'})
    wait(lambda told: 'ZeroDivisionError' in note(told, PANEL)['text'])
    monkeypatch.setattr(link.model, 'take_part', None)
    wait(lambda told: "TypeError: 'NoneType' object" in note(told, PANEL)['text'])
    link.do({'do': 'service', 'name': 'stop'})
    wait(lambda told: told['events'] and told['events'][-1]['command'] == 'stop')


def test_a_drive_that_comes_later_is_found_and_missed_when_it_goes(
    start_drive: Callable[..., Stand], link: Link, wait: Wait
):
    wait(lambda told: word(told) == 'absent')
    drive = start_drive(wait=False)
    wait(lambda told: word(told) in ACTIVE and link.frame())
    drive.close()
    wait(lambda told: word(told) == 'absent')


def test_the_only_drive_of_the_namespace_is_shown_whatever_its_name(
    start_drive: Callable[..., Stand], link: Link, wait: Wait
):
    start_drive(namespace='/left', wait=False)
    wait(lambda told: len(told['drives']) == 2)
    assert word(link.state()) == 'absent'
    start_drive(remaps=['__node:=other'], wait=False)
    wait(lambda told: told['drive'] == '/other' and word(told) in ACTIVE)


def test_one_of_two_drives_is_chosen(start_drive: Callable[..., Stand], link: Link, wait: Wait):
    for side in ('/left', '/right'):
        start_drive(namespace=side, wait=False)
    wait(lambda told: len(told['drives']) == 3)
    link.do({'do': 'attach', 'drive': '/right/stickslip_drive'})
    wait(lambda told: told['drive'] == '/right/stickslip_drive' and word(told) in ACTIVE)
    link.do({'do': 'command', 'name': 'steps', 'values': [1]})
    wait(lambda told: note(told, 'steps')['text'] == 'DONE')


def test_the_verb_serves_the_panel_of_a_namespace_and_lets_its_drive_go_first(
    ros_domain: int, monkeypatch: pytest.MonkeyPatch
):
    served: list[str] = []
    nice: list[int] = []

    def serve(source: Link, sheet: Any, *_: Any) -> None:
        served.append(source.model.drive)
        assert sheet['kind'] == 'drive'
        source.close()

    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    monkeypatch.setattr(server, 'serve', serve)
    monkeypatch.setattr('os.nice', nice.append)
    assert main(['panel', '--namespace', 'stage/x']) == 0
    assert (served, nice) == (['/stage/x/stickslip_drive'], [NICENESS])
