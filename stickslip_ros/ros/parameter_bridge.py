"""The parameters of the package as ROS parameters: declared, checked, read."""

from collections.abc import Mapping

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Parameters, Spec, describe, spec_of, specs

FOREIGN = ('use_sim_time', 'start_type_description_service')
FOREIGN_PREFIX = 'qos_overrides.'


def descriptor_of(spec: Spec) -> ParameterDescriptor:
    """Return the ROS descriptor of a parameter: description, range, read_only."""
    descriptor = ParameterDescriptor(description=describe(spec), read_only=spec.fixed)
    if spec.choices:
        descriptor.additional_constraints = f'one of {", ".join(spec.choices)}'
    if spec.minimum is None or spec.maximum is None:
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
    Declare every parameter of the package on a node.

    Parameters
    ----------
    node : Node
        A node made with ``automatically_declare_parameters_from_overrides=True``, so that a
        misspelt name is seen instead of ignored, and a whole number does for a decimal one.

    Raises
    ------
    UnknownName, WrongKind, OutOfRange
        If a value given at the start is not allowed.

    """
    given = {name: node.get_parameter(name).value for name in _given_names(node)}
    parameters = Parameters().updated(given)
    for name, value in parameters.flat().items():
        if name in given:
            node.undeclare_parameter(name)
        descriptor = descriptor_of(spec_of(name))
        node.declare_parameter(name, value, descriptor, ignore_override=True)
    return parameters


def _given_names(node: Node) -> list[str]:
    names = node.get_parameters_by_prefix('')
    return [n for n in names if n not in FOREIGN and not n.startswith(FOREIGN_PREFIX)]


def read_parameters(node: Node) -> Parameters:
    """
    Return the present values of a node's parameters, checked together.

    Raises
    ------
    OutOfRange
        If the values do not fit together.

    """
    return Parameters().updated({name: node.get_parameter(name).value for name in specs()})


def judge_changes(node: Node, changes: list[Parameter], frozen: bool) -> SetParametersResult:
    """
    Accept or refuse a change of parameters.

    Parameters
    ----------
    node : Node
        Owner of the present values.
    changes : list of Parameter
        Wanted values.
    frozen : bool
        Whether the drive runs, so that its parameters must stay as they are.

    """
    wanted: Mapping[str, object] = {p.name: p.value for p in changes if p.name in specs()}
    if wanted and frozen:
        names = ', '.join(wanted)
        reason = f'{names} cannot change while the node is active; deactivate it first'
        return SetParametersResult(successful=False, reason=reason)
    try:
        read_parameters(node).updated(wanted)
    except StickSlipError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)
