# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the package are ROS parameters: declared, judged, seen in what a node does."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import (
    Parameter,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters, describe, dump_yaml, load_yaml, specs
from stickslip_ros.ros.executable import end_node
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.testing import open_context

KINDS = {
    float: ParameterType.PARAMETER_DOUBLE,
    int: ParameterType.PARAMETER_INTEGER,
    bool: ParameterType.PARAMETER_BOOL,
    str: ParameterType.PARAMETER_STRING,
}
ARRAYS = {
    float: ParameterType.PARAMETER_DOUBLE_ARRAY,
    int: ParameterType.PARAMETER_INTEGER_ARRAY,
}
REALISTIC = Path(__file__).parents[2] / 'config' / 'realistic.yaml'
ROS_OWN = {'use_sim_time', 'start_type_description_service'}


def values_of(drive: StickSlipDrive) -> dict[str, Any]:
    """Give the values of a node; rclpy may have its own kind of array."""
    values = {name: drive.get_parameter(name).value for name in specs()}
    return {n: tuple(v) if specs()[n].is_array else v for n, v in values.items()}


def test_the_values_at_the_start_are_the_defaults_and_what_was_given(start_drive, tmp_path):
    """A whole number does for a decimal one."""
    given = {'autostart': False, 'stand.preload': 1, 'sim.block': 1e-3}
    values = values_of(start_drive(given, wait=False).drive)
    assert values == Parameters().updated({**given, 'record.directory': str(tmp_path)}).flat()
    assert type(values['stand.preload']) is float


def test_names_and_descriptors_are_those_of_the_package(manual: Any):
    listed = manual.operator.call(ListParameters, 'list_parameters', ListParameters.Request())
    assert set(listed.result.names) - ROS_OWN == specs().keys()
    request = DescribeParameters.Request(names=list(specs()))
    answer = manual.operator.call(DescribeParameters, 'describe_parameters', request)
    for spec, descriptor in zip(specs().values(), answer.descriptors, strict=True):
        assert descriptor.type == (ARRAYS if spec.is_array else KINDS)[spec.kind]
        assert descriptor.description == describe(spec, limits=False)
        assert not descriptor.dynamic_typing
        assert descriptor.read_only == (descriptor.name == 'autostart')
        limits = [*descriptor.floating_point_range, *descriptor.integer_range]
        bounds = [(each.from_value, each.to_value) for each in limits]
        has_bounds = spec.minimum is not None and not spec.is_array
        assert bounds == ([(spec.minimum, spec.maximum)] if has_bounds else [])
        told = f'one of {", ".join(spec.choices)}' if spec.choices else ''
        told += f'each {spec.minimum:g} to {spec.maximum:g}' if spec.is_array else ''
        assert descriptor.additional_constraints == told


REFUSED: tuple[tuple[str, Any, str], ...] = (
    ('stand.preload', 101.0, 'stand.preload 101 N is above the maximum'),
    ('stand.preload', float('nan'), 'is not a finite number'),
    ('stand.preload', 'much', "stand.preload 'much' is not a number in"),
    ('stand.preload', [0.5], 'stand.preload [0.5] is not a finite number'),
    ('stand.preload', True, 'is not a finite number; give a number'),
    ('stand.preload', [True], 'is not a finite number; give a number'),
    ('stand.preload', [], 'stand.preload [] is not a finite number'),
    ('stand.preload', None, 'stand.preload [] is not a finite number'),
    ('record.name', 3, 'record.name 3 is not a text; put it in quotes'),
    ('sim.seed', [b'1'], 'is not a whole number; give an integer such as 42'),
    ('use_sim_time', 'maybe', "use_sim_time 'maybe' is not true or false"),
    ('use_sim_time', None, 'use_sim_time [] is not true or false'),
    ('autostart', True, 'read-only; give it at the start: --ros-args -p autostart:=VALUE'),
    ('stand.preloud', 0.3, "parameter 'stand.preloud' is not known; did you mean stand.prel"),
    ('no.such', 1, "parameter 'no.such' is not known; see docs/reference/parameters.md"),
    ('qos_overrides./x.publisher.depth', 1, 'look at the topics and policies in docs'),
    ('contact.profile', 'polished', "contact.profile 'polished' is not one of the choices"),
    ('amplifier.voltage_min', 300.0, 'amplifier.voltage_min 300 V is not below'),
    ('trace.sample_rate', 3000.0, 'trace.sample_rate 3000 Hz is a period of'),
    ('sim.seed', -1, 'sim.seed -1 is below the minimum'),
    ('feet.count', [9, 4], 'feet.count [9, 4] is above 12 feet together; lower it'),
    ('feet.count', [2, 2, 2], 'is of length 2, but feet.count is of length 3; give a value'),
    ('feet.count', [2.0, 4.0], 'feet.count 2.0 is not a whole number; give an integer'),
    ('feet.count', [], 'feet.count [] is not an array of at least one; give one value'),
    ('feet.count', None, 'feet.count [] is not an array of at least one; give one value'),
    ('feet.count', ['2', 'x'], "feet.count 'x' is not a whole number; give an integer"),
    ('feet.gain', [11.0, 1.0], 'feet.gain 11 is above the maximum 10; lower it'),
    ('feet.delay', 'late', "feet.delay 'late' is not a number in"),
    ('feet.gain', [True, False], 'feet.gain True is not a finite number'),
    ('fault.dead_foot', 7, 'fault.dead_foot 7 is above the number of feet, 6; lower it'),
)


def test_a_bad_change_is_refused_with_a_reason_and_changes_nothing(manual: Any):
    before = values_of(manual.drive)
    for name, value, reason in REFUSED:
        answer = manual.operator.set_parameter(name, value)
        whole = SetParametersAtomically.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]
        )
        result = manual.operator.call(SetParametersAtomically, 'set_parameters_atomically', whole)
        assert answer == result.result
        assert not answer.successful
        assert name in answer.reason
        assert reason in answer.reason
    assert values_of(manual.drive) == before


FEET = '/**: {ros__parameters: {feet: {count: [2, 2, 2], share: [0.5], delay: [0.0, 1e-4, 2e-4]}}}'


@pytest.mark.parametrize('text', [FEET, REALISTIC.read_text()], ids=['feet', 'realistic'])
def test_a_node_that_gets_a_file_has_its_values_and_runs(ros_domain, tmp_path, text: str):
    path, context = tmp_path / 'stand.yaml', open_context(ros_domain)
    path.write_text(text)
    drive = StickSlipDrive(context=context, cli_args=['--ros-args', '--params-file', str(path)])
    session = drive.session
    assert session.parameters == load_yaml(path)
    assert values_of(drive) == load_yaml(path).flat()
    end_node(SingleThreadedExecutor(context=context), drive)
    assert session.failure is None
    context.try_shutdown()


def test_feet_are_set_together_without_a_drive_and_used_by_the_next_one(stand: Any):
    operator = stand.operator
    refusal = operator.set_parameter('feet.gain', [1.0, 0.0])
    assert refusal.reason == (
        'feet.gain cannot change while the node is active; deactivate it first'
    )
    operator.change_state('deactivate')
    operator.change_state('cleanup')
    feet = {'feet.count': [2, 2, 2], 'feet.share': [0.5, 0.5, 0.5], 'feet.gain': [1.0, 1.0, 0.0]}
    parameters = [Parameter(name, value=each).to_parameter_msg() for name, each in feet.items()]
    whole = SetParametersAtomically.Request(parameters=parameters)
    answer = operator.call(SetParametersAtomically, 'set_parameters_atomically', whole)
    assert answer.result.successful, answer.result.reason
    assert operator.set_parameter('feet.delay', '[0, 1e-4, 0.0]').successful
    operator.change_state('configure')
    operator.change_state('activate')
    _, late, guide = stand.drive.session.parameters.feet.groups
    assert (late.feet, late.share, late.gain, late.delay_s) == (2, 0.5, 1.0, 1e-4)
    assert (guide.feet, guide.share, guide.gain, guide.delay_s) == (2, 0.5, 0.0, 0.0)
    assert dumped(stand)['feet.gain'] == [1.0, 1.0, 0.0]


def test_what_we_write_can_be_loaded_as_ros2_param_load_does_it(manual: Any, tmp_path: Path):
    small = {
        'actuator.gain': 1e-9,
        'interferometer.resolution': 5e-12,
        'stand.stop_stiffness': 1e8,
        'feet.delay': (0.0, 1e-5),
        'feet.radius': (1e-5, 2e-5),
    }
    wanted = Parameters().updated({**small, 'autostart': False, 'record.directory': str(tmp_path)})
    path = tmp_path / 'stand.yaml'
    path.write_text(dump_yaml(wanted, ''))
    loaded = parameter_dict_from_yaml_file(str(path), use_wildcard=True)
    request = SetParameters.Request(parameters=list(loaded.values()))
    results = manual.operator.call(SetParameters, 'set_parameters', request).results
    assert [result.reason for result in results if not result.successful] == []
    assert values_of(manual.drive) == wanted.flat()


def set_all(stand: Any, values: dict[str, Any]) -> list[Any]:
    """Set parameters by one request; give the results."""
    parameters = [Parameter(name, value=each).to_parameter_msg() for name, each in values.items()]
    request = SetParameters.Request(parameters=parameters)
    return list(stand.operator.call(SetParameters, 'set_parameters', request).results)


def test_values_that_fit_together_only_are_set_in_whatever_order(manual: Any):
    below = {'voltage_min': -400.0, 'voltage_initial': -100.0, 'voltage_max': -100.0}
    above = {'voltage_max': 300.0, 'voltage_initial': 0.0, 'voltage_min': 0.0}
    for order in (below, above, dict(reversed(below.items()))):
        wanted = {f'amplifier.{name}': value for name, value in order.items()}
        assert [each.reason for each in set_all(manual, wanted)] == ['', '', '']
        assert values_of(manual.drive).items() >= wanted.items()


def test_values_that_do_not_fit_together_are_set_or_refused_one_by_one(manual: Any):
    values = {'amplifier.voltage_max': -400.0, 'stand.preload': 0.3, 'sim.seeds': 1}
    bad, good, unknown = set_all(manual, values)
    assert 'is not below amplifier.voltage_max' in bad.reason
    assert good.successful
    assert unknown.reason.startswith("parameter 'sim.seeds' is not known; did you mean sim.seed")
    assert manual.drive.get_parameter('amplifier.voltage_max').value == 300.0
    assert manual.drive.get_parameter('stand.preload').value == 0.3


def dumped(stand: Any) -> dict[str, Any]:
    """Ask for every parameter and its value, as `ros2 param dump` does."""
    ask, listed = stand.operator.call, ListParameters.Request()
    names = list(ask(ListParameters, 'list_parameters', listed).result.names)
    request = GetParameters.Request(names=names)
    values = ask(GetParameters, 'get_parameters', request).values
    return dict(zip(names, map(parameter_value_to_python, values), strict=True))


def test_a_dump_of_all_parameters_is_loaded_back_by_a_drive_that_runs(stand: Any, tmp_path: Path):
    values = dumped(stand)
    fixed = {name for name in values if name.startswith('qos_overrides.')}
    assert len(fixed) > 10
    path = tmp_path / 'dump.yaml'
    path.write_text(yaml.safe_dump({'/stickslip_drive': {'ros__parameters': values}}))
    loaded = parameter_dict_from_yaml_file(str(path), target_nodes=['/stickslip_drive'])
    assert loaded.keys() == values.keys()
    request = SetParameters.Request(parameters=list(loaded.values()))
    results = stand.operator.call(SetParameters, 'set_parameters', request).results
    assert [result.reason for result in results if not result.successful] == []
    whole = SetParametersAtomically.Request(parameters=list(loaded.values()))
    answer = stand.operator.call(SetParametersAtomically, 'set_parameters_atomically', whole)
    assert answer.result.successful
    assert dumped(stand) == values
    for name in fixed:
        other = 'best_effort' if name.endswith('reliability') else values[name] + 1
        assert 'read-only' in stand.operator.set_parameter(name, other).reason


def test_a_live_parameter_set_to_what_it_was_ends_a_fault_that_a_schedule_brought(
    start_drive: Callable, tmp_path: Path
):
    schedule = tmp_path / 'faults.yaml'
    schedule.write_text('- {at: 0.0, set: {fault.runner_stuck: true}}\n')
    stand = start_drive({'fault.schedule': str(schedule)})
    faults = stand.drive.session.worker
    stand.operator.spin_until(lambda: 'runner_stuck' in str(faults.faults), 'the fault')
    assert not stand.drive.get_parameter('fault.runner_stuck').value
    assert stand.operator.set_parameter('fault.runner_stuck', value=False).successful
    stand.operator.spin_until(lambda: not faults.faults, 'the end of the fault')


def test_whole_numbers_and_texts_of_numbers_are_taken_for_doubles(manual: Any):
    for name, value, taken in (
        ('stand.preload', 1, 1.0),
        ('limits.soft_max', 0, 0.0),
        ('feet.share', [1, 2], (1.0, 2.0)),
        ('feet.gain', 1, (1.0,)),
        *(('actuator.gain', text, 1e-8) for text in ('1e-8', '1.0e-8', '1e-08')),
    ):
        answer = manual.operator.set_parameter(name, value)
        assert answer.successful, answer.reason
        assert values_of(manual.drive)[name] == taken


@pytest.mark.parametrize(
    ('name', 'value'),
    [('stand.preload', 101.0), ('sim.seed', -1), ('contact.profile', 'polished')],
)
def test_a_value_out_of_its_bounds_is_refused_at_the_start(start_drive, name: str, value: Any):
    with pytest.raises(OutOfRange, match=f'^{re.escape(name)} .*; '):
        start_drive({name: value}, wait=False)


def test_soft_limits_and_velocity_change_while_the_drive_runs(stand: Any):
    operator = stand.operator
    assert operator.set_parameter('limits.soft_max', 1e-6).successful
    assert operator.wait_for_event('parameters', 0)['result'] == 'DONE'
    operator.spin_until(
        lambda: operator.info['parameters']['limits.soft_max'] == 1e-6, 'the new information'
    )
    operator.command('position', 2e-6)
    assert operator.wait_for_event('position', 0)['result'] == 'RANGE_LIMIT_REACHED'
    assert operator.trigger('clear_faults').success
    assert stand.drive.get_parameter('limits.soft_max').value == 1e-6
    answer = operator.set_parameter('limits.soft_min', 2e-6)
    assert 'is above limits.soft_max' in answer.reason
    assert operator.set_parameter('closed_loop.velocity', 1e-6).successful
    operator.spin_until(lambda: len(operator.requests) == 3, 'the requests')
    assert operator.requests[0] == {
        'name': 'parameters',
        'values': [],
        'settings': {'limits.soft_max': 1e-6},
    }
    assert stand.drive.session.bench.parameters.closed_loop.velocity == 1e-6


def test_friction_mass_and_damping_change_at_once_in_a_drive_that_runs(stand: Any):
    operator, bench = stand.operator, stand.drive.session.bench
    changes = {'contact.friction': 0.2, 'runner.mass': 0.012, 'runner.damping': 9.0}
    for name, value in changes.items():
        assert operator.set_parameter(name, value).successful
        operator.spin_until(
            lambda: operator.info['parameters'][name] == value,  # noqa: B023 - at once
            'the new information',
        )
        assert bench.parameters.flat()[name] == value
    assert stand.drive.session.bench is bench
    operator.change_state('deactivate')
    operator.change_state('activate')
    assert stand.drive.session.bench is bench


def test_where_the_contacts_cannot_follow_friction_changes_in_an_inactive_drive(
    start_drive: Callable,
):
    stand = start_drive({'feet.guide_friction': 0.1})
    operator, bench = stand.operator, stand.drive.session.bench
    reason = operator.set_parameter('contact.friction', 0.2).reason
    assert 'from 0.3, excluded by feet.guide_friction' in reason
    assert 'deactivate' in reason
    assert stand.drive.get_parameter('contact.friction').value == 0.3
    operator.change_state('deactivate')
    assert operator.set_parameter('contact.friction', 0.2).successful
    operator.change_state('activate')
    assert stand.drive.session.bench is not bench
    assert stand.drive.session.bench.parameters.contact.friction == 0.2


def test_soft_limits_that_change_without_a_drive_that_runs_hold_when_it_does(stand: Any):
    operator = stand.operator
    operator.change_state('deactivate')
    bench = stand.drive._session.bench
    assert operator.set_parameter('limits.soft_max', 1e-6).successful
    operator.change_state('activate')
    operator.spin_until(lambda: bool(operator.info), 'information')
    assert operator.info['parameters']['limits.soft_max'] == 1e-6
    operator.wait_for_event('parameters', 0)
    assert stand.drive.session.bench is bench
    assert bench.parameters.limits.soft_max == 1e-6
