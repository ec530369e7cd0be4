# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every parameter is declared in full, every value passes its declaration, shipped ones too."""

import math
import re
from pathlib import Path

import pytest
import yaml
from allowed_values import allowed_values
from hypothesis import given

from stickslip_ros.errors import StickSlipError, UnknownName
from stickslip_ros.parameters import (
    ContactParameters,
    Parameters,
    ReplaceableDefault,
    Spec,
    spec_of,
    specs,
    to_nanoseconds,
)

SI_UNITS = {
    '', 's', 'm', 'm^(1-H)', 'rad/m', 'Pa', 'N', 'kg', 'N s/m', 'V', 'V/s', 'Hz', 'm/V', 'N/m',
    'B', 'N/sqrt(Hz)', 'm/sqrt(Hz)', 'm/sqrt(s)', 'm/s', 'N/s', '1/s', 'A', 'F',
}  # fmt: skip
PURE_NUMBERS = {
    'sim.real_time_factor', 'contact.hurst', 'contact.friction', 'contact.travel',
    'contact.friction_ageing', 'contact.friction_rate', 'contact.loss_factor',
    'contact.poisson_runner', 'contact.poisson_sphere', 'friction_law.static_ratio',
    'friction_law.breakaway_ratio', 'actuator.hysteresis', 'actuator.creep',
    'actuator.damping_ratio', 'actuator.gain_tolerance', 'frame.damping_ratio',
    'load_cell.damping_ratio', 'load_cell.hysteresis', 'load_cell.restitution',
    'fault.missed_steps', 'feet.share', 'feet.friction', 'feet.weight', 'feet.gain',
}  # fmt: skip
"""Quantities without a unit; counts and seeds have none either."""
TABLE_1 = {
    'contact.young_runner': 210e9,
    'contact.young_sphere': 370e9,
    'contact.poisson_runner': 0.3,
    'contact.poisson_sphere': 0.3,
    'contact.friction': 0.3,
    'contact.radius': 0.5e-3,
    'runner.mass': 3e-3,
    'feet.radius': (0.0, 0.0),
}


def test_every_parameter_has_unit_bounds_source_and_text():
    for name, spec in specs().items():
        assert spec.kind in {float, int, bool, str}, name
        assert spec.text, name
        assert re.match('assumed$|Table |Section |Eq. ', spec.source), name
        assert spec.unit in SI_UNITS, name
        if spec.kind in {float, int}:
            assert -math.inf < spec.minimum < spec.maximum < math.inf, name
        if spec.kind is float:
            assert bool(spec.unit) != (name in PURE_NUMBERS), name


def test_every_default_is_of_its_kind_and_inside_its_bounds():
    for name, spec in specs().items():
        for each in spec.default if spec.is_array else (spec.default,):
            assert type(each) in {spec.kind, ReplaceableDefault}, name
        assert spec.check(name, spec.default) == spec.default


def test_the_defaults_of_table_1_say_so():
    defaults = Parameters().flat()
    assert {name: defaults[name] for name in TABLE_1} == TABLE_1
    assert {name for name, spec in specs().items() if spec.source == 'Table 1'} == set(TABLE_1)


def test_what_the_paper_does_not_give_is_marked_as_assumed():
    for name in ('load_cell.stiffness', 'runner.damping', 'sim.dt'):
        assert spec_of(name).source == 'assumed'


def test_no_group_can_exist_with_a_value_outside_its_declaration():
    with pytest.raises(StickSlipError, match=r'contact\.friction -1 is below'):
        ContactParameters(friction=-1.0)


def test_a_value_is_checked_once_where_it_enters(monkeypatch):
    checked = []
    check = Spec.check

    def noted(spec, name, value):
        checked.append(name)
        return check(spec, name, value)

    monkeypatch.setattr(Spec, 'check', noted)
    everything = Parameters().updated(Parameters().flat())
    assert checked == list(specs())
    checked.clear()
    everything.updated({'stand.preload': 0.25}).updated({'stand.travel_max': 1e-3})
    ContactParameters(friction=0.2)
    assert checked == ['stand.preload', 'stand.travel_max', 'contact.friction']


def test_parameters_are_immutable(stand):
    with pytest.raises(AttributeError, match='parameters do not change'):
        stand.stand.preload = 1.0


@given(allowed_values())
def test_an_update_changes_what_it_names_and_nothing_else(values):
    before = Parameters()
    after = before.updated(values)
    assert after.flat() == before.flat() | values
    assert after.changed() == {
        name: value for name, value in values.items() if value != spec_of(name).default
    }
    assert before == Parameters()


def test_an_update_takes_texts_as_they_are_typed(stand):
    typed = {
        'stand.preload': '25e-2',
        'sim.seed': '7',
        'autostart': 'False',
        'contact.profile': 'smooth',
    }
    after = stand.updated(typed)
    assert after.stand.preload == 0.25
    assert after.sim.seed == 7
    assert after.autostart is False
    assert after.contact.profile == 'smooth'


@pytest.mark.parametrize(
    ('typed', 'read'),
    [
        ('[10 us, 0.1 ms]', (1e-5, 1e-4)),
        ('1e-5, 1e-4', (1e-5, 1e-4)),
        ([0, 1e-4], (0.0, 1e-4)),
        ('0.1 ms', (1e-4, 1e-4)),
        (1e-4, (1e-4, 1e-4)),
    ],
)
def test_an_array_is_typed_as_a_list_and_a_single_value_holds_for_all(stand, typed, read):
    delays_s = stand.updated({'feet.delay': typed}).feet.delay
    assert (delays_s, set(map(type, delays_s))) == (read, {float})


def test_values_that_hang_together_can_be_changed_together(stand):
    shifted = {'amplifier.voltage_min': 400.0, 'amplifier.voltage_max': 500.0}
    after = stand.updated(shifted | {'amplifier.voltage_initial': 450.0})
    assert after.amplifier.voltage_initial == 450.0


def test_periods_are_whole_nanoseconds(stand):
    assert (stand.sample_ns, stand.block_ns, stand.trace_period_ns) == (20_000, 10**6, 10**7)
    assert to_nanoseconds(1.5e-9) == 2
    assert to_nanoseconds(0.1 + 0.2) == 300_000_000


def test_the_table_of_declarations_cannot_be_changed_from_outside():
    specs().clear()
    assert 'stand.preload' in specs()


def test_an_unknown_name_is_refused_wherever_it_is_asked_for():
    with pytest.raises(UnknownName, match=r'did you mean stand\.preload'):
        spec_of('stand.preloads')


CONFIG = Path(__file__).parents[2] / 'config'
PATHS = [CONFIG / 'realistic.yaml', CONFIG / 'coupled.yaml']
INDENT_OF_GROUP, INDENT_OF_VALUE = 4, 6


def written(path: Path) -> dict[str, object]:
    """Give the values of the file by their full names."""
    groups = yaml.safe_load(path.read_text())['/**']['ros__parameters']
    return {
        f'{group}.{name}': value for group, each in groups.items() for name, value in each.items()
    }


def comments(path: Path) -> dict[str, str]:
    """Give, for every line with a value, the comment above it within its group."""
    found: dict[str, str] = {}
    group = comment = ''
    goes_on = False  # whether the line before was a comment too
    for line in path.read_text().splitlines():
        text = line.strip()
        indent = len(line) - len(line.lstrip())
        if indent == INDENT_OF_GROUP:
            group, comment = text.rstrip(':'), ''
        elif text.startswith('#'):
            comment = f'{comment} {text}' if goes_on else text
        elif indent == INDENT_OF_VALUE:
            found[f'{group}.{text.partition(":")[0]}'] = comment
        goes_on = text.startswith('#')
    return found


@pytest.mark.parametrize('path', PATHS, ids=lambda path: path.name)
def test_every_name_is_a_parameter(path: Path):
    assert written(path).keys() <= specs().keys()


@pytest.mark.parametrize('path', PATHS, ids=lambda path: path.name)
def test_every_value_stands_below_a_comment_that_calls_it_assumed(path: Path):
    found = comments(path)
    assert found.keys() == written(path).keys()
    assert [name for name, comment in found.items() if 'assumed' not in comment] == []
