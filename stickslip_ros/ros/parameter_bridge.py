# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parameters of the package as ROS parameters: declared, checked, read."""

from array import array
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.instrument.checks import check_live
from stickslip_ros.parameters import Parameters, Scalar, Spec, describe, is_fault, spec_of, specs
from stickslip_ros.parameters.declaration import find_spec

SIM_TIME, _CLOCK = 'use_sim_time', 'sim.publish_clock'
FOREIGN = dict.fromkeys(
    (SIM_TIME, 'start_type_description_service'), Spec(bool, False, '', 'rclpy', '')
)
"""Parameters that every node of rclpy has."""
QOS_PREFIX = 'qos_overrides.'


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


def declare_parameters(node: 'CheckedNode') -> Parameters:
    """
    Declare every parameter of the package on a node; refuse a value that is not allowed.

    The node was made with ``automatically_declare_parameters_from_overrides=True``: so a misspelt
    name is refused instead of ignored, and a whole number is taken for a decimal one.

    """
    parameters = Parameters().updated(given_values(node))
    declare_all(node, specs(), parameters.flat())
    return parameters


def given_values(node: 'CheckedNode') -> dict[str, Any]:
    """Return the values given to a node at its start; check and leave out rclpy's own ones."""
    names = [n for n in node.get_parameters_by_prefix('') if not n.startswith(QOS_PREFIX)]
    values = {name: node.check(name, node.get_parameter(name).value) for name in names}
    return {name: value for name, value in values.items() if name not in FOREIGN}


def declare_all(node: Node, declared: Mapping[str, Spec], values: Mapping[str, Scalar]) -> None:
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
    new: dict[str, Any] = {p.name: p.value for p in changes}
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
            present = read_parameters(node)
            present.updated(wanted)
            if runs:
                check_live(present, {n: each for n, each in wanted.items() if not is_fault(n)})
    except StickSlipError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)


class CheckedNode(Node):  # type: ignore[misc]
    """A node that refuses parameters by name, value and remedy, before rclpy does."""

    declared: ClassVar[Mapping[str, Spec]] = specs() | FOREIGN

    def check(self, name: str, value: object) -> Any:
        """Return a value as declared; None is an empty array, for which ROS has no type."""
        if name.startswith(QOS_PREFIX):
            if value is None:
                raise WrongKind(name, [], 'a policy', 'give a number or a word')
            return value
        spec = find_spec(self.declared, name, 'see docs/reference/parameters.md')
        value = list(value or ()) if isinstance(value, array | None) else value
        checked = spec.check(name, value)
        return list(checked) if spec.is_array else checked

    def declare_parameters(
        self, namespace: str, parameters: list[Any], ignore_override: bool = False
    ) -> list[Parameter]:
        """Declare parameters; refuse an empty array, for which rclpy has no words."""
        for name, *rest in parameters:
            if rest and rest[0] is None:
                self.check(name, None)
        return list(super().declare_parameters(namespace, parameters, ignore_override))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """
        Set the parameters that differ from the present ones; an equal value is no change.

        A live one is always set, which ends a fault of the schedule. ``ros2 param`` sends 1 for
        1.0 and 1e-8 as a text: both are converted.

        """
        changes = []
        try:
            for name, value in ((each.name, each.value) for each in parameter_list):
                change = Parameter(name, value=self.check(name, value))
                if not self.has_parameter(name):
                    hint = 'look at the topics and policies in docs/reference/node.md'
                    raise UnknownName('parameter', name, hint)
                before = self.get_parameter(name).get_parameter_value()
                differs = change.get_parameter_value() != before
                if differs and self.describe_parameter(name).read_only:
                    hint = f'give it at the start: --ros-args -p {name}:=VALUE'
                    raise OutOfRange(name, value, '', 'refused: it is read-only', hint)
                if differs or (name in self.declared and self.declared[name].live):
                    changes.append(change)
        except StickSlipError as error:
            return SetParametersResult(reason=str(error))
        if not changes:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(changes)


Settings = tuple[tuple[str, Scalar], ...]
"""Full names of parameters and their values."""


def live_settings(changes: list[Parameter]) -> tuple[Settings, Settings]:
    """Return the live parameters among some changes: faults, and others."""
    own = [(p, spec_of(p.name)) for p in changes if p.name in specs()]
    live = [(p.name, spec.check(p.name, p.value)) for p, spec in own if spec.live]
    faults = tuple(each for each in live if is_fault(each[0]))
    return faults, tuple(each for each in live if each not in faults)


def fault_defaults(node: Node) -> list[Parameter]:
    """Return the defaults of the faults that a node has set."""
    return [
        Parameter(name, value=spec.default)
        for name, spec in specs().items()
        if is_fault(name) and node.get_parameter(name).value != spec.default
    ]
