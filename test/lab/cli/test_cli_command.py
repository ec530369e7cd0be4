# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip command``: a command of the table goes to a drive, and its end comes back."""

import json
from typing import Any

import pytest
from waiting import wait_until

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import COMMANDS, typed_command
from stickslip_ros.interface.requests import typed_numbers
from stickslip_ros.lab.cli.command import ends
from stickslip_ros.lab.cli.main import main

FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0, 'sim.block': 0.01}
"""A free runner; a drive in real time costs less with long blocks."""


@pytest.fixture
def drive_in_domain(quiet_ros, start_drive, ros_domain, monkeypatch) -> Any:
    """Give an active drive where the command line looks for one."""
    stand = start_drive(FREE)
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    return stand


def test_a_sawtooth_is_carried_out_to_its_end(drive_in_domain: Any, capsys: Any):
    assert main(['command', 'sawtooth', '300V', '500', '20', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told['command'], told['result'], told['steps']) == ('sawtooth', 'DONE', 20)
    assert 1e-6 < told['position_m'] < 4e-6
    assert main(['command', 'sawtooth', 'steps=10', 'amplitude=300V', 'frequency=-1kHz']) == 0
    assert 'sawtooth: DONE at ' in capsys.readouterr().out
    assert drive_in_domain.drive.session.bench.time_ns > 0


def test_services_and_vectors_too(drive_in_domain: Any, capsys: Any):
    typed = {'load -10 mN': 'load', 'zero': 'zero_position', 'enable_amplifier 0': ''}
    for words, name in typed.items():
        assert main(['command', *words.split()]) == 0
        assert capsys.readouterr().out.startswith(f'{name or words.split()[0]}: DONE')
    bench = drive_in_domain.drive.session.bench
    assert bench.stand.load_n == -0.01
    assert main(['command', 'voltage', '10V']) == 2
    assert 'voltage: AMPLIFIER_DISABLED at ' in capsys.readouterr().err


def test_what_the_drive_refuses_is_refused_with_its_reason(drive_in_domain: Any, capsys: Any):
    assert main(['command', 'voltage', '301']) == 2
    told = capsys.readouterr().err
    assert told.startswith('stickslip: voltage: INVALID_PARAMETER at ')
    assert "above the amplifier's 300 V" in told
    assert main(['command', 'sawtooth', '300', '500', '0', '--no-wait']) == 0
    assert main(['command', 'sawtooth', '300', '500', '5']) == 0  # replaces the one without end
    assert 'sawtooth: DONE' in capsys.readouterr().out
    drive_in_domain.operator.change_state('deactivate')
    assert main(['command', 'stop']) == 2
    assert '/stickslip_drive is inactive, not active; activate it first' in capsys.readouterr().err


def test_without_a_drive_that_is_said(quiet_ros, ros_domain, monkeypatch, capsys):
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    assert main(['command', 'stop', '--namespace', 'left/', '--timeout', '200ms']) == 2
    assert capsys.readouterr().err == (
        f'stickslip: no drive in namespace /left has answered within 0.2 s in domain '
        f'{ros_domain}; start one: stickslip drive; or name its --namespace\n'
    )


def test_a_drive_of_any_name_is_found_and_of_several_the_named_one(
    quiet_ros: None,
    start_drive: Any,
    ros_domain: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Any,
):
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros_domain))
    first = start_drive(FREE, remaps=['__node:=first'], wait=False)
    assert main(['command', 'load', '10mN']) == 0
    assert first.drive.session.bench.stand.load_n == 0.01
    second = start_drive(FREE, remaps=['__node:=second'], namespace='/left', wait=False)
    assert main(['command', 'zero', '--namespace', 'left', '--node', 'second']) == 0
    assert second.drive.session.bench.time_ns > 0

    def refused(*words: str) -> str:
        """Return the refusal of a command, if it is refused."""
        capsys.readouterr()
        return capsys.readouterr().err if main(['command', 'stop', *words]) == 2 else ''

    missing = f'no drive /second has answered within 1 s in domain {ros_domain}; seen: '
    seen = f'{missing}/first, /left/second; choose by --namespace and --node\n'
    elsewhere = '--node', 'second', '--timeout', '1s'
    wait_until(lambda: seen in refused(*elsewhere), 'a refusal that lists both drives')
    start_drive(FREE, remaps=['__node:=third'], wait=False)
    several = 'namespace / has 2 drives: /first, /third; choose by --node\n'
    wait_until(lambda: several in refused(), 'a refusal of two drives in a namespace')


def test_a_command_is_known_by_its_first_word(capsys: Any):
    short = {'zero': 'zero_position', 'tare': 'tare_force', 'enable': 'enable_amplifier'}
    for name in (*COMMANDS, *short):
        if name in short or COMMANDS[name].interface:
            assert typed_command(name) is COMMANDS[short.get(name, name)]


@pytest.mark.parametrize(
    ('name', 'words', 'told'),
    [
        ('sawtooth', ['300', '500'], r'takes .*, steps; nothing is given for steps$'),
        ('waveform', ['0s', '0V', '1ms'], r'row after row; nothing is given for voltage$'),
        ('sawtooth', ['300', '500', '1.5'], r"sawtooth steps '1.5' is not a whole number"),
        ('steps', ['x'], r"^steps 'x' is not a whole number; give an integer such as 42$"),
        ('enable_amplifier', ['2'], r"enable_amplifier wanted '2' is not 0 or 1; give 1 for on"),
        ('sawtooth', ['300', '500', '1', '2'], "sawtooth number '2' is not one of its numbers"),
        ('sawtooth', ['500Hz', '300V', '1'], r'sawtooth amplitude .*500Hz'),
    ],
)
def test_numbers_that_do_not_fit_are_refused(name: str, words: list[str], told: str):
    with pytest.raises(StickSlipError, match=told):
        typed_numbers(COMMANDS[name], words)


@pytest.mark.parametrize(
    ('typed', 'told'),
    [
        ('steps 1.5', "steps '1.5' is not a whole number"),
        ('steps 3000000000', 'steps 3e+09 is not a whole number from -2147483648'),
        (f'waveform 0 0 1 0 --cycles {"9" * 11}', 'cycles 99999999999 is not a whole number from'),
        ('voltage 10V --cycles 3', '--cycles 3 is not for voltage; leave it out'),
    ],
)
def test_what_no_message_holds_is_refused_without_a_drive(typed, told, monkeypatch, capsys):
    monkeypatch.setattr('stickslip_ros.lab.cli.command.open_context', None)  # nobody is asked
    assert main(['command', *typed.split()]) == 2
    assert told in capsys.readouterr().err


def test_numbers_are_read_in_order_and_by_name():
    assert typed_numbers(COMMANDS['position'], ['x=-2um']) == [-2e-6, 0.0, 0.0]
    assert typed_numbers(COMMANDS['waveform'], ['0', '0', '2ms', '30V']) == [0.0, 0.0, 2e-3, 30.0]
    joint = typed_numbers(COMMANDS['joint'], ['velocity=20um/s'])
    assert joint[0] != joint[0]
    assert joint[1] == pytest.approx(20e-6)
    assert typed_numbers(COMMANDS['enable_amplifier'], ['1']) == [1.0]


def test_the_end_of_what_was_replaced_is_not_that_of_ones_own_command():
    replaced = {'command': 'steps', 'number': 1, 'message': 'replaced by command 2'}
    mine = {'command': 'steps', 'number': 2, 'message': ''}
    refused = {'command': 'steps', 'number': 2, 'message': 'above 3'}
    stopped = {'command': 'steps', 'number': 2, 'message': 'stopped by command 3'}
    assert ends([replaced], 'steps', is_moving=True) == []
    assert ends([replaced, mine], 'steps', is_moving=True) == [mine]
    assert ends([refused], 'steps', is_moving=True) == [refused]
    assert ends([replaced, stopped], 'steps', is_moving=True) == [stopped]
    assert ends([stopped], 'steps', is_moving=False) == [stopped]
