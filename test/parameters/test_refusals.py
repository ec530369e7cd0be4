# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Refusals of an update of parameters, and their messages."""

import math

import pytest
from allowed_values import NUMBERS
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.parameters import Parameters, parse_assignments, specs
from stickslip_ros.parameters.physics_groups import PAPER_PREFACTOR

AGAINST = '; if the piezo moves against its voltage, set feet.gain below 0'
BEYOND = 1e-6
"""How far outside its bound a value is put, relative to it: more than the digits of :g hide."""


def _refusal(values, kind=OutOfRange):
    with pytest.raises(kind) as caught:
        Parameters().updated(values)
    return str(caught.value)


@pytest.mark.parametrize(
    ('name', 'suggestion'),
    [
        ('stand.preloads', 'did you mean stand.preload'),
        ('preload', 'did you mean stand.preload'),
        ('sim.time_step', 'did you mean'),
        ('sim', 'did you mean'),
        ('qqqq', 'see docs/reference/parameters.md'),
        ('', 'see docs/reference/parameters.md'),
    ],
)
def test_an_unknown_name_is_refused_with_a_suggestion(name, suggestion):
    message = _refusal({name: 1.0}, UnknownName)
    assert message.startswith(f'parameter {name!r} is not known')
    assert suggestion in message


@pytest.mark.parametrize(
    ('name', 'value', 'expected'),
    [
        ('stand.preload', 'much', 'a number in uN, mN, N or kN'),
        ('stand.preload', None, 'a finite number'),
        ('stand.preload', [1.0], 'a finite number'),
        ('stand.preload', True, 'a finite number'),
        ('stand.preload', math.nan, 'a finite number'),
        ('stand.preload', math.inf, 'a finite number'),
        ('stand.preload', '-inf', 'a number in uN, mN, N or kN'),
        ('sim.seed', 1.5, 'a whole number'),
        ('sim.seed', True, 'a whole number'),
        ('sim.seed', '1.5e0', 'a whole number'),
        ('sim.seed', math.nan, 'a whole number'),
        ('autostart', 1, 'true or false'),
        ('autostart', 'yes', 'true or false'),
        ('contact.profile', 3, 'a text'),
        ('record.name', None, 'a text'),
        ('feet.count', (), 'an array of at least one'),
        ('feet.count', 2.5, 'a whole number'),
        ('feet.gain', True, 'a finite number'),
    ],
)
def test_a_value_of_the_wrong_kind_is_refused(name, value, expected):
    message = _refusal({name: value}, WrongKind)
    assert message.startswith(f'{name} {value!r} is not {expected}; ')


@pytest.mark.parametrize('value', ['', '/stage_base', 'stage\n', 'stage#1'])
def test_a_frame_that_tf2_would_not_take_or_that_has_a_tag_is_refused(value):
    message = _refusal({'frame_id.stage': value}, WrongKind)
    assert message.startswith(f'frame_id.stage {value!r} is not a name of a frame; write one such')


@pytest.mark.parametrize('value', ['', 'a\tb'])
def test_a_joint_without_a_name_is_refused(value):
    message = _refusal({'sim.joint_name': value}, WrongKind)
    assert message.startswith(f'sim.joint_name {value!r} is not a name of a joint; write one such')


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_no_quantity_takes_what_is_not_finite(value):
    for name in NUMBERS:
        assert f'{name} {value} is not a finite number' in _refusal({name: value}, WrongKind)


def test_a_whole_number_too_large_for_a_float_is_refused():
    _refusal({'stand.preload': 10**400}, StickSlipError)


@pytest.mark.parametrize(
    ('side', 'word', 'hint'), [('below', 'minimum', 'raise it'), ('above', 'maximum', 'lower it')]
)
def test_bounds_are_inside_and_beyond_the_message_gives_value_limit_unit_and_mend(
    side, word, hint
):
    for name, spec in NUMBERS.items():
        bound = getattr(spec, word)
        assert spec.check(name, bound) == bound
        excess = max(BEYOND * abs(bound), 1e-12)
        value = bound - excess if side == 'below' else bound + excess
        unit = f' {spec.unit}' if spec.unit else ''
        message = f'{name} {value:.6g}{unit} is {side} the {word} {bound:g}{unit}; {hint}'
        against = AGAINST if (side, name) == ('below', 'actuator.gain') else ''
        assert _refusal({name: value}) == message + against


@given(st.sampled_from(sorted(specs())), st.floats() | st.text() | st.booleans() | st.none())
def test_whatever_the_value_only_a_refusal_of_the_package_is_raised(name, value):
    try:
        after = Parameters().updated({name: value})
    except StickSlipError:
        return
    spec = specs()[name]
    kept = after.flat()[name]
    assert type(kept) is spec.kind
    assert spec.check(name, kept) == kept


@pytest.mark.parametrize(
    ('name', 'typed', 'told'),
    [
        ('stand.preload', '250', 'above the maximum 100 N; lower it; did you mean 250 mN?'),
        ('amplifier.slew_rate', '150', 'raise it; did you mean 150 V/us?'),
        ('runner.mass', '30', 'did you mean 30 g?'),
        ('stand.preload', '0,25', "'0,25' is not a number in uN, mN, N or kN; write 0.25"),
        ('contact.friction', '0,3', "'0,3' is not a finite number; write 0.3"),
    ],
)
def test_a_number_with_another_unit_or_a_decimal_comma_is_answered_with_what_is_meant(
    name, typed, told
):
    assert told in _refusal({name: typed}, StickSlipError)


def test_a_whole_number_may_have_a_power_of_ten():
    assert Parameters().updated({'sim.seed': '1e3'}).flat()['sim.seed'] == 1000


def test_a_word_that_is_no_choice_is_refused_with_the_choices():
    message = _refusal({'record.compression': 'zip'})
    assert message == "record.compression 'zip' is not one of the choices; use zstd, lz4, none"


def test_a_whole_number_beyond_its_bound_is_refused():
    assert 'above the maximum 2.14748e+09; lower it' in _refusal({'sim.seed': 2**31})
    assert 'below the minimum 1024 B; raise it' in _refusal({'record.chunk_size': 1})


@pytest.mark.parametrize('share', [1e-9, 0.99])
@pytest.mark.parametrize('name', [name for name, spec in specs().items() if spec.least])
def test_a_part_is_off_or_large_enough_to_be_computed(name, share):
    spec = specs()[name]
    least = f'between 0 and {spec.least:g} {spec.unit}'.rstrip()
    assert f'is {least}; raise it, or set it to 0' in _refusal({name: share * spec.least})
    stand = Parameters().updated({'actuator.resonance': 1e5, name: spec.least})
    assert stand.value(f'{name}[0]' if spec.is_array else name) == spec.least


LINE = {'contact.profile': 'rough_line'}
TRAVELS = {**LINE, 'contact.travel': 1.0}
VOLTS = {'amplifier.voltage_min': 100.0, 'amplifier.voltage_initial': 150.0}
TWELVE = {'feet.count': 12, 'feet.share': 0.1}


@pytest.mark.parametrize(
    ('values', 'message', 'remedy'),
    [
        (
            {'contact.rms_height': 2e-6},
            'is without effect while contact.prefactor is 0.00044478 m^(1-H); set contact.pre',
            {'contact.prefactor': 0.0},
        ),
        (
            {**LINE, 'contact.rms_height': 2e-6, 'contact.prefactor': 1e-3},
            'contact.prefactor 0.001 m^(1-H) is without effect on a rough line',
            {'contact.prefactor': PAPER_PREFACTOR},
        ),
        *(
            ({'contact.law': law, name: 0.1}, f'{name} 0.1 is without effect under', {name: 0.0})
            for name, law in zip(
                ('contact.loss_factor', 'contact.friction_rate', 'contact.friction_ageing'),
                ('epm', 'dahl', 'coulomb'),
                strict=True,
            )
        ),
        (
            {'contact.friction_rate': 0.1, 'contact.friction_cutoff': 1e-7},
            'not above 0, by friction_rate',
            {'contact.friction': 1.0},
        ),
        ({'contact.travel': 1.0}, 'contact.travel 1 is used only on a rough line', LINE),
        ({**TRAVELS, 'contact.law': 'lugre'}, 'under the law mdr', {'contact.law': 'mdr'}),
        (
            {**TRAVELS, 'contact.friction_ageing': 0.01},
            'a rough line of constant friction',
            {'contact.friction_ageing': 0.0},
        ),
        (
            {**TRAVELS, 'stand.preload_end': 0.6},
            'stand.preload_end 0.6 N is a ramp',
            {'contact.travel': 0.0},
        ),
        (
            {'actuator.mass': 3.6e-5, 'actuator.resonance': 1.5e5},
            'set it to 0, and actuator.stiffness to 3.198e+07 N/m',
            {'actuator.mass': 0.0, 'actuator.stiffness': 3.198e7},
        ),
        (
            {'actuator.stiffness': 3.2e7},
            'without a mass while actuator.resonance is 0 Hz',
            {'actuator.resonance': 1e5},
        ),
        (
            {**VOLTS, 'amplifier.voltage_max': 100.0},
            'amplifier.voltage_min 100 V is not below amplifier.voltage_max, 100 V; lower it or',
            {'amplifier.voltage_max': 200.0},
        ),
        (
            {'amplifier.voltage_initial': -1.0},
            'amplifier.voltage_initial -1 V is outside 0 to 300 V; move it',
            {'amplifier.voltage_min': -2.0},
        ),
        (
            {**TWELVE, 'feet.guide_friction': 0.01},
            'with one for feet.guide_friction',
            {'feet.count': 11},
        ),
    ],
)
def test_values_that_do_not_go_together_are_refused_and_the_remedy_works(values, message, remedy):
    assert message in _refusal(values)
    Parameters().updated({**values, **remedy})


@pytest.mark.parametrize(
    ('values', 'limit'),
    [
        ({'sim.block': 1.01e-3}, 'sim.block 1010000 ns is not a multiple of one sample'),
        ({'sim.wake': 2.5e-3}, 'sim.wake 2500000 ns is not a multiple of one sim.block'),
        ({'sim.block': 1.5e-3}, 'trace.period 10000000 ns is not a multiple of one sim.block'),
        ({'trace.period': 5e-4}, 'trace.period 500000 ns is not a multiple of one sim.block'),
        ({'trace.sample_rate': 30e3}, 'Hz is a period of 33333.3333 ns, not a whole number'),
    ],
)
def test_periods_that_do_not_fit_into_each_other_are_refused(values, limit):
    assert limit in _refusal(values)


def test_assignments_are_split_at_the_first_equals_sign():
    typed = ['stand.preload=0.25', ' record.name = a=b ', 'sim.seed=']
    expected = {'stand.preload': '0.25', 'record.name': 'a=b', 'sim.seed': ''}
    assert parse_assignments(typed) == expected


def test_an_assignment_without_an_equals_sign_is_refused():
    with pytest.raises(WrongKind, match=r"--set 'stand.preload' is not an assignment; write"):
        parse_assignments(['stand.preload'])
