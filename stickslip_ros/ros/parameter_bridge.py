# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the package as ROS parameters: declared, checked, read."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.parameters import (
    Parameters,
    Scalar,
    Spec,
    describe,
    is_fault,
    spec_of,
    specs,
)

SIM_TIME, _CLOCK = 'use_sim_time', 'sim.publish_clock'
FOREIGN = (SIM_TIME, 'start_type_description_service')
"""Parameters that every node of rclpy has."""
QOS_PREFIX = 'qos_overrides.'
_TYPES = Parameter.Type
_NO_DOUBLES = (_TYPES.STRING, _TYPES.STRING_ARRAY, _TYPES.INTEGER, _TYPES.INTEGER_ARRAY)
"""Types that stand for doubles where doubles are declared."""


def descriptor_of(spec: Spec) -> ParameterDescriptor:
    """Return the ROS descriptor of a parameter: description, range or choices, read_only."""
    description = describe(spec, limits=False)  # tools show them as constraints
    descriptor = ParameterDescriptor(description=description, read_only=spec.fixed)
    if spec.choices:
        descriptor.additional_constraints = f'one of {", ".join(spec.choices)}'
    if spec.minimum is None or spec.maximum is None:
        return descriptor
    if spec.is_array:  # the ranges of a descriptor are those of one number
        descriptor.additional_constraints = f'each {spec.minimum:g} to {spec.maximum:g}'
        return descriptor
    if spec.kind is int:
        bounds = IntegerRange(from_value=int(spec.minimum), to_value=int(spec.maximum), step=0)
        descriptor.integer_range = [bounds]
    else:
        limits = FloatingPointRange(
            from_value=float(spec.minimum), to_value=float(spec.maximum), step=0.0
        )
        descriptor.floating_point_range = [limits]
    return descriptor


def declare_parameters(node: Node) -> Parameters:
    """
    Declare every parameter of the package on a node; refuse a value that is not allowed.

    The node was made with ``automatically_declare_parameters_from_overrides=True``: so a misspelt
    name is refused instead of ignored, and a whole number is taken for a decimal one.

    """
    parameters = Parameters().updated(given_values(node))
    declare(node, specs(), parameters.flat())
    return parameters


def given_values(node: Node) -> dict[str, Any]:
    """Return the values given to a node at its start, without rclpy's own parameters."""
    names = node.get_parameters_by_prefix('')
    own = [n for n in names if n not in FOREIGN and not n.startswith(QOS_PREFIX)]
    return {name: node.get_parameter(name).value for name in own}


def declare(node: Node, declared: Mapping[str, Spec], values: Mapping[str, Scalar]) -> None:
    """Declare parameters with checked values."""
    for name, value in values.items():
        if node.has_parameter(name):
            node.undeclare_parameter(name)
        node.declare_parameter(name, value, descriptor_of(declared[name]), ignore_override=True)


def hand_over_overrides(node: Node) -> list[str]:
    """
    Return the given overrides of quality of service, and leave their declaration to rclpy.

    rclpy declares an override read-only, with its topic. Overrides that are still undeclared
    after that belong to no topic.

    """
    names = [n for n in node.get_parameters_by_prefix('') if n.startswith(QOS_PREFIX)]
    for name in names:
        node.undeclare_parameter(name)
    return names


def read_parameters(node: Node) -> Parameters:
    """Return the present values of a node's parameters; refuse contradictions."""
    return Parameters().updated({name: node.get_parameter(name).value for name in specs()})


def check_clock(node: Node, changes: Mapping[str, object] = MappingProxyType({})) -> None:
    """Refuse changes after which the node would follow the clock that it publishes."""
    now = {name: node.get_parameter(name).value for name in (_CLOCK, SIM_TIME)} | dict(changes)
    if now[_CLOCK] and now[SIM_TIME]:
        limit = f'not possible while {_CLOCK} is true: the node would follow its own clock'
        raise OutOfRange(SIM_TIME, True, '', limit, 'set one of the two to false')


def judge_changes(node: Node, changes: list[Parameter], *, runs: bool) -> SetParametersResult:
    """Accept or refuse a change of parameters; a running drive takes only live ones."""
    new: dict[str, object] = {p.name: p.value for p in changes}
    wanted = {name: value for name, value in new.items() if name in specs()}
    fixed = [name for name in wanted if not spec_of(name).live]
    if fixed and runs:
        names = ', '.join(fixed)
        reason = f'{names} cannot change while the node is active; deactivate it first'
        return SetParametersResult(successful=False, reason=reason)
    try:
        if SIM_TIME in new or _CLOCK in new:
            check_clock(node, new)
        if wanted:
            read_parameters(node).updated(wanted)
    except StickSlipError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)


class ReloadableNode(Node):
    """A node that can load a dump of its parameters, including the read-only ones."""

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        Set the parameters that differ from the present ones; an equal value is no change.

        A live parameter is always set, which ends a fault of the schedule.

        """
        changes = [
            each
            for each in map(with_number, parameter_list)
            if is_live(each.name)
            or not self.has_parameter(each.name)
            or each.get_parameter_value() != self.get_parameter(each.name).get_parameter_value()
        ]
        if not changes:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(changes)


def with_number(change: Parameter) -> Parameter:
    """
    Return a parameter with whole numbers and texts turned into doubles, if those are declared.

    ``ros2 param load`` and ``set`` send 1 as a whole number, and 1e-8 as text, since YAML 1.1
    wants a point before an exponent. ``load`` also turns 1.0e-8 into text: it writes 1e-08, as
    Python does. An array with a text, or with numbers of two types, becomes one text or an array
    of texts.

    """
    spec, value = specs().get(change.name), change.value
    if spec is None or spec.kind is not float or change.type_ not in _NO_DOUBLES:
        return change
    if spec.is_array and isinstance(value, str | int):
        value = str(value).strip('[] ').split(',')
    try:
        doubles = [float(each) for each in value] if spec.is_array else float(value)
    except (TypeError, ValueError):  # not a number, or an array for a number
        return change
    return Parameter(change.name, value=doubles)


def is_live(name: str) -> bool:
    """Return whether a running drive takes a parameter: a fault, or a limit of its moves."""
    return name in specs() and spec_of(name).live


Settings = tuple[tuple[str, Scalar], ...]
"""Full names of parameters and their values."""


def live_settings(changes: list[Parameter]) -> tuple[Settings, Settings]:
    """Return the live parameters among some changes: faults, and others."""
    live = [(p.name, spec_of(p.name).check(p.name, p.value)) for p in changes if is_live(p.name)]
    faults = tuple(each for each in live if is_fault(each[0]))
    return faults, tuple(each for each in live if each not in faults)


def fault_defaults(node: Node) -> list[Parameter]:
    """Return the defaults of the faults that a node has set."""
    return [
        Parameter(name, value=spec.default)
        for name, spec in specs().items()
        if is_fault(name) and node.get_parameter(name).value != spec.default
    ]


def differ_when_built(one: Parameters, other: Parameters) -> bool:
    """Return whether two sets of parameters differ in more than live ones."""
    values = other.flat()
    return any(value != values[n] for n, value in one.flat().items() if not spec_of(n).live)
