"""The parameters of the package are ROS parameters: declared, described, judged."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_dict_from_yaml_file

from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.parameters import Parameters, describe, dump_yaml, specs
from stickslip_ros.recording.reader import Recording

KINDS = {
    float: ParameterType.PARAMETER_DOUBLE,
    int: ParameterType.PARAMETER_INTEGER,
    bool: ParameterType.PARAMETER_BOOL,
    str: ParameterType.PARAMETER_STRING,
}
ROS_OWN = {'use_sim_time', 'start_type_description_service'}


def set_parameter(stand: Any, name: str, value: Any) -> Any:
    """Set a parameter as `ros2 param set` does; give the answer."""
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return stand.operator.call(SetParameters, 'set_parameters', request).results[0]


def described(stand: Any) -> dict[str, Any]:
    names = list(specs())
    request = DescribeParameters.Request(names=names)
    answer = stand.operator.call(DescribeParameters, 'describe_parameters', request)
    return dict(zip(names, answer.descriptors, strict=True))


def test_the_declared_names_are_those_of_the_package(manual: Any):
    listed = manual.operator.call(ListParameters, 'list_parameters', ListParameters.Request())
    assert set(listed.result.names) - ROS_OWN == specs().keys()


def test_the_values_at_the_start_are_the_defaults_and_what_was_given(
    start_drive: Callable, tmp_path: Path
):
    stand = start_drive({'autostart': False, 'stand.preload': 0.25}, wait=False)
    values = {name: stand.drive.get_parameter(name).value for name in specs()}
    given = {'autostart': False, 'stand.preload': 0.25, 'record.directory': str(tmp_path)}
    assert values == Parameters().updated(given).flat()


def test_descriptors_tell_text_kind_and_limits(manual: Any):
    descriptors = described(manual)
    for name, spec in specs().items():
        descriptor = descriptors[name]
        assert descriptor.type == KINDS[spec.kind]
        assert descriptor.description == describe(spec)
        assert not descriptor.dynamic_typing
        limits = [*descriptor.floating_point_range, *descriptor.integer_range]
        bounds = [(each.from_value, each.to_value) for each in limits]
        assert bounds == ([] if spec.minimum is None else [(spec.minimum, spec.maximum)])
        assert all(choice in descriptor.additional_constraints for choice in spec.choices)


def test_only_autostart_is_read_only(manual: Any):
    descriptors = described(manual)
    assert [name for name, each in descriptors.items() if each.read_only] == ['autostart']
    answer = set_parameter(manual, 'autostart', value=True)
    assert not answer.successful


def test_a_parameter_cannot_change_while_the_drive_runs(stand: Any):
    answer = set_parameter(stand, 'stand.preload', 0.3)
    assert not answer.successful
    assert answer.reason == (
        'stand.preload cannot change while the node is active; deactivate it first'
    )
    assert stand.drive.get_parameter('stand.preload').value == 0.5


def test_a_parameter_changed_without_a_drive_is_used_by_the_next_one(
    start_drive: Callable, tmp_path: Path
):
    stand = start_drive({'record.on_start': True, 'record.name': 'one.mcap'})
    stand.operator.change_state('deactivate')
    stand.operator.change_state('cleanup')
    assert set_parameter(stand, 'stand.preload', 0.3).successful
    assert set_parameter(stand, 'record.name', 'two.mcap').successful
    stand.operator.change_state('configure')
    stand.operator.change_state('activate')
    assert stand.drive.session.parameters.stand.preload == 0.3
    stand.operator.change_state('deactivate')
    assert {path.name for path in tmp_path.glob('*.mcap')} == {'one.mcap', 'two.mcap'}
    text = Recording(tmp_path / 'two.mcap').attachments['parameters.yaml'][1].decode()
    assert 'preload: 0.3\n' in text


def test_a_change_that_an_inactive_drive_accepts_is_used_when_it_is_activated(
    start_drive: Callable,
):
    stand = start_drive()
    stand.operator.change_state('deactivate')
    answer = set_parameter(stand, 'stand.preload', 0.3)
    stand.operator.change_state('activate')
    used_n = stand.drive.session.parameters.stand.preload
    assert used_n == (0.3 if answer.successful else 0.5)


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('stand.preload', 101.0, 'out of range'),
        ('stand.preload', float('nan'), ''),
        ('stand.preload', 'much', 'Wrong parameter type, expected'),
        ('contact.profile', 'polished', "contact.profile 'polished' is not one of the choices"),
        ('amplifier.voltage_min', 300.0, 'amplifier.voltage_min 300 V is not below'),
        ('trace.sample_rate', 3000.0, 'trace.sample_rate 3000 Hz is a period of'),
        ('sim.seed', -1, 'out of range'),
        ('sim.seeds', 1, 'undeclared'),
    ],
)
def test_a_bad_change_is_refused_with_a_reason_and_changes_nothing(
    manual: Any, name: str, value: Any, reason: str
):
    answer = set_parameter(manual, name, value)
    assert not answer.successful
    assert reason in answer.reason
    values = {each: manual.drive.get_parameter(each).value for each in specs()}
    changed = Parameters().updated(values).changed()
    assert changed.keys() == {'autostart', 'record.directory'}


def test_a_whole_number_does_for_a_decimal_one_at_the_start(start_drive: Callable):
    stand = start_drive({'autostart': False, 'stand.preload': 1}, wait=False)
    value = stand.drive.get_parameter('stand.preload').value
    assert (type(value), value) == (float, 1.0)
    assert described(stand)['stand.preload'].type == ParameterType.PARAMETER_DOUBLE


@pytest.mark.parametrize(
    ('values', 'refusal', 'message'),
    [
        (
            {'stand.prelaod': 0.3},
            UnknownName,
            "parameter 'stand.prelaod' is not known; did you mean stand.preload",
        ),
        ({'preload': 0.3}, UnknownName, "parameter 'preload' is not known"),
        (
            {'stand.preload': 101.0},
            OutOfRange,
            'stand.preload 101 N is above the maximum 100 N; lower it',
        ),
        ({'sim.seed': 1.5}, WrongKind, 'sim.seed 1.5 is not a whole number'),
        ({'record.name': 12}, WrongKind, 'record.name 12 is not a text'),
        ({'autostart': 'perhaps'}, WrongKind, "autostart 'perhaps' is not true or false"),
        ({'stand.preload': [0.5, 0.5]}, WrongKind, 'is not a finite number'),
        (
            {'sim.block': 0.0007},
            OutOfRange,
            'trace.period 10000000 ns is not a multiple of one sim.block, 700000 ns',
        ),
    ],
)
def test_a_bad_value_at_the_start_is_refused(
    start_drive: Callable, values: dict[str, Any], refusal: type, message: str
):
    with pytest.raises(refusal) as caught:
        start_drive(values, wait=False)
    assert message in str(caught.value)


def test_what_we_write_can_be_loaded_as_ros2_param_load_does_it(manual: Any, tmp_path: Path):
    small = {
        'actuator.gain': 1e-9,
        'interferometer.resolution': 5e-12,
        'stand.stop_stiffness': 1e8,
    }
    wanted = Parameters().updated({**small, 'autostart': False, 'record.directory': str(tmp_path)})
    path = tmp_path / 'stand.yaml'
    path.write_text(dump_yaml(wanted, ''))
    loaded = parameter_dict_from_yaml_file(str(path), use_wildcard=True)
    del loaded['autostart']  # can never change
    request = SetParameters.Request(parameters=list(loaded.values()))
    results = manual.operator.call(SetParameters, 'set_parameters', request).results
    assert [result.reason for result in results if not result.successful] == []
    assert {name: manual.drive.get_parameter(name).value for name in specs()} == wanted.flat()


@pytest.mark.parametrize('text', ['1e-8', '1.0e-8', '1e-08'])
def test_a_text_that_is_a_number_is_taken_for_one(manual: Any, text: str):
    assert set_parameter(manual, 'actuator.gain', text).successful
    assert manual.drive.get_parameter('actuator.gain').value == 1e-8


def test_a_text_that_is_none_or_a_number_out_of_range_is_refused(manual: Any):
    for text in ('much', 'nan', '1e300'):
        assert not set_parameter(manual, 'actuator.gain', text).successful
    assert set_parameter(manual, 'record.name', '1e-8').successful
