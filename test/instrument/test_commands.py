# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Requests: each is accepted within its limits, and refused beyond them with a reason."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.drive.records import ENDLESS, Wave
from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.instrument.checks import STEPS_MAX
from stickslip_ros.instrument.commands import COMMANDS, Request, check_request
from stickslip_ros.parameters import Parameters

ABOVE_300_V = "above the amplifier's 300 V; lower it or raise amplifier.voltage_max"
BELOW_0_V = "below the amplifier's 0 V; raise it or lower amplifier.voltage_min"
ABOVE_20_KHZ = "above the amplifier's 20000 Hz; lower it or raise amplifier.frequency_max"
BEYOND_10_N = 'beyond the 10 N that the stand allows; lower it or raise stand.load_limit'
BIPOLAR = {'amplifier.voltage_min': -100.0, 'amplifier.voltage_max': 200.0}


def _refusal(name, values, kind, stand):
    with pytest.raises(kind) as caught:
        check_request(Request(name, values), stand)
    return str(caught.value)


@pytest.mark.parametrize('voltage_v', [0.0, 12.5, 300.0])
def test_a_voltage_within_the_range_is_a_level(voltage_v, stand):
    wave = check_request(Request('voltage', (voltage_v,)), stand)
    assert (wave.start_v, wave.cycles) == (voltage_v, 0)


@pytest.mark.parametrize(
    ('values', 'start_v', 'rise_v', 'period_s', 'cycles'),
    [
        ((300.0, 1000.0, 7.0), 0.0, 300.0, 1e-3, 7),
        ((300.0, -1000.0, 7.0), 300.0, -300.0, 1e-3, 7),
        ((1e-3, 20e3, 0.0), 0.0, 1e-3, 5e-5, ENDLESS),
        ((300.0, 0.5, float(STEPS_MAX)), 0.0, 300.0, 2.0, STEPS_MAX),
    ],
)
def test_a_sawtooth_within_the_limits_is_a_wave(values, start_v, rise_v, period_s, cycles, stand):
    wave = check_request(Request('sawtooth', values), stand)
    assert wave[:4] == (start_v, rise_v, period_s, cycles)


def test_a_sawtooth_begins_at_the_lower_end_of_the_range(stand):
    bipolar = stand.updated(BIPOLAR)
    assert check_request(Request('sawtooth', (50.0, 1.0, 1.0)), bipolar).start_v == -100.0
    assert check_request(Request('sawtooth', (50.0, -1.0, 1.0)), bipolar).start_v == -50.0
    assert check_request(Request('sawtooth', (300.0, 1.0, 1.0)), bipolar).rise_v == 300.0


def test_load_stop_and_reset_are_accepted(stand):
    assert check_request(Request('load', (-10.0, 0.0, -0.0, 0.0, 0.0, 0.0)), stand) == -10.0
    assert check_request(Request('stop'), stand) is None
    assert check_request(Request('reset'), stand) is None


@pytest.mark.parametrize('frame_id', ['', 'left/stage_base'])
def test_a_target_is_taken_in_the_frame_of_the_stage_or_in_none(frame_id, stand):
    left = stand.updated({'frame_id.stage': 'left/stage_base'})
    request = Request('position', (2e-6, 0.0, 0.0), frame_id=frame_id)
    assert check_request(request, left) == 2e-6


@pytest.mark.parametrize(
    ('request_', 'own'),
    [
        (Request('position', (0.0,) * 3, frame_id='runner'), 'stage_base'),
        (Request('load', (0.0,) * 6, frame_id='stage_base'), 'runner'),
        (Request('load', (0.0,) * 6, frame_id='/runner'), 'runner'),
    ],
)
def test_a_vector_in_a_frame_that_is_not_the_drives_is_refused(request_, own, stand):
    with pytest.raises(OutOfRange) as caught:
        check_request(request_, stand)
    assert str(caught.value) == (
        f"{request_.name} frame '{request_.frame_id}' is not {own}, the frame of the drive; "
        'transform it, leave the frame empty, or change frame_id.*'
    )


@pytest.mark.parametrize(
    ('name', 'values', 'message'),
    [
        ('voltage', (301.0,), f'301 V is {ABOVE_300_V}'),
        ('voltage', (-1.0,), f'-1 V is {BELOW_0_V}'),
        ('sawtooth', (301.0, 1.0, 1.0), f'301 V is {ABOVE_300_V}'),
        ('sawtooth', (0.0, 1e3, 1.0), 'amplitude 0 V is not above 0 V; raise it; a'),
        ('sawtooth', (-5.0, 1e3, 1.0), 'amplitude -5 V is not above 0 V; raise it; a'),
        ('sawtooth', (300.0, 0.0, 1.0), 'frequency 0 Hz is not a frequency; give steps per'),
        ('sawtooth', (300.0, 2.1e4, 1.0), f'frequency 21000 Hz is {ABOVE_20_KHZ}'),
        ('sawtooth', (300.0, -2.1e4, 1.0), f'frequency -21000 Hz is {ABOVE_20_KHZ}'),
        ('sawtooth', (300.0, 1e3, 1.5), 'steps 1.5 is not a whole number from 0 to 2147483647; '),
        ('sawtooth', (300.0, 1e3, -1.0), 'steps -1 is not a whole number from 0 to 2147483647; '),
        ('sawtooth', (300.0, 1e3, STEPS_MAX + 1.0), 'steps 2.14748e+09 is not a whole number'),
        ('load', (10.1, 0.0, 0.0, 0.0, 0.0, 0.0), f'load force.x 10.1 N is {BEYOND_10_N}'),
        ('load', (-10.1, 0.0, 0.0, 0.0, 0.0, 0.0), f'load force.x -10.1 N is {BEYOND_10_N}'),
        ('load', (1.0, 2.0, 0.0, 0.0, 0.0, 0.0), 'load force.y 2 N is not 0; set it to 0: '),
        ('load', (1.0, 0.0, 0.0, 0.0, 0.0, 3.0), 'load torque.z 3 N m is not 0; set it to 0: '),
    ],
)  # fmt: skip
def test_a_number_beyond_its_limit_is_refused_with_value_limit_unit_and_mend(
    name, values, message, stand
):
    assert message in _refusal(name, values, OutOfRange, stand)


def test_a_frequency_that_leaves_no_ramp_is_refused(stand):
    slow = stand.updated({'amplifier.slew_rate': 1e6})
    message = _refusal('sawtooth', (300.0, 2000.0, 1.0), OutOfRange, slow)
    assert 'above the 1667 Hz that amplifier.slew_rate allows at this amplitude' in message
    assert isinstance(check_request(Request('sawtooth', (250.0, 2000.0, 1.0)), slow), Wave)


@pytest.mark.parametrize(
    ('name', 'values', 'message'),
    [
        ('voltage', (), 'voltage [] is not a list of 1 numbers; send [voltage V]'),
        ('sawtooth', (1.0, 2.0), 'is not a list of 3 numbers; send [amplitude V, frequency Hz'),
        ('load', (1.0,), 'is not a list of 6 numbers; send [force.x N, force.y N'),
        ('stop', (1.0,), 'stop [1.0] is not empty'),
        ('reset', (0.0,) * 100, 'is not empty'),
        ('voltage', (math.nan,), 'nan is not a finite number; send a number'),
        ('sawtooth', (300.0, math.inf, 1.0), 'inf is not a finite number; send a number'),
        ('load', (0.0, 0.0, 0.0, 0.0, 0.0, -math.inf), 'is not a finite number'),
    ],
)
def test_a_request_of_the_wrong_form_is_refused(name, values, message, stand):
    assert message in _refusal(name, values, WrongKind, stand)


def test_an_unknown_command_is_refused_with_those_that_are_known(stand):
    message = _refusal('fly', (), UnknownName, stand)
    assert message == f"command 'fly' is not known; use {', '.join(COMMANDS)}"


@given(
    name=st.sampled_from(list(COMMANDS)) | st.text(max_size=10),
    values=st.lists(st.floats(), max_size=7).map(tuple),
)
def test_no_numbers_whatever_raise_anything_but_a_refusal(name, values):
    try:
        check_request(Request(name, values), Parameters())
    except StickSlipError as refusal:
        text = str(refusal)
    else:
        text = ''
        assert all(map(math.isfinite, values))
    assert text == '' or '; ' in text


@given(st.floats(), st.floats(), st.floats() | st.integers(-3, 2**32).map(float))
def test_a_sawtooth_that_is_accepted_stays_within_all_limits(voltage_v, frequency_hz, steps):
    parameters = Parameters().updated(BIPOLAR)
    try:
        wave = check_request(Request('sawtooth', (voltage_v, frequency_hz, steps)), parameters)
    except StickSlipError:
        return
    assert min(wave.start_v, wave.start_v + wave.rise_v) >= -100.0
    assert max(wave.start_v, wave.start_v + wave.rise_v) <= 200.0
    assert wave.period_s >= 1.0 / 20e3
    assert wave.period_s >= 2.0 * abs(wave.rise_v) / 150e6 * (1.0 - 1e-12)
    assert wave.cycles == (int(steps) or ENDLESS)
