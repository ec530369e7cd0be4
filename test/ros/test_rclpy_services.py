# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The services that rclpy offers on every node answer whatever they are asked."""

import signal
from collections.abc import Callable, Iterator

import pytest
from executables import DRIVE, end
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from type_description_interfaces.srv import GetTypeDescription

from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.testing import Operator

NAMES = ['', '/', 'a b', '..', 'x' * 5000, 'use_sim_time', 'qos_overrides./position.depth']
BAD = [
    Parameter(name=name, value=ParameterValue(type=kind))
    for name in ('use_sim_time', 'no.such', 'a b')
    for kind in (2, 10, 200, 255)
]
GOOD = Parameter(name='use_sim_time', value=ParameterValue(type=1, bool_value=False))
OF_EVERY_NODE = {
    'set_parameters': (SetParameters, [SetParameters.Request(parameters=[GOOD, *BAD])]),
    'set_parameters_atomically': (
        SetParametersAtomically,
        [SetParametersAtomically.Request(parameters=[each]) for each in BAD],
    ),
    'get_parameters': (GetParameters, [GetParameters.Request(names=NAMES)]),
    'get_parameter_types': (GetParameterTypes, [GetParameterTypes.Request(names=NAMES)]),
    'describe_parameters': (DescribeParameters, [DescribeParameters.Request(names=NAMES)]),
    'list_parameters': (
        ListParameters,
        [ListParameters.Request(prefixes=NAMES, depth=each) for each in (1, 2**64 - 1)],
    ),
    'get_type_description': (
        GetTypeDescription,
        [GetTypeDescription.Request(type_name=each, type_hash='RIHS01_zz') for each in NAMES],
    ),
}
OF_LIFECYCLE = {
    'change_state': (
        ChangeState,
        [
            ChangeState.Request(transition=Transition(id=number, label=label))
            for number, label in ((1, ''), (77, ''), (255, ''), (0, 'no such'), (0, 'x' * 5000))
        ],
    ),
    'get_state': (GetState, [GetState.Request()]),
    'get_available_states': (GetAvailableStates, [GetAvailableStates.Request()]),
    'get_available_transitions': (GetAvailableTransitions, [GetAvailableTransitions.Request()]),
    'get_transition_graph': (GetAvailableTransitions, [GetAvailableTransitions.Request()]),
}
OFFERED_BY_RCLPY = ('rcl_interfaces/', 'lifecycle_msgs/', 'type_description_interfaces/')
SERVICES = OF_EVERY_NODE | OF_LIFECYCLE


@pytest.fixture
def operator(start: Callable, meet: Callable) -> Iterator[Operator]:
    """Give who asks the drive, which lives until the end of the test."""
    process = start(*DRIVE)
    operator = meet()

    def check() -> None:
        assert process.poll() is None

    operator.check = check
    yield operator
    status, errors = end(process, signal.SIGINT)
    assert status == 0
    assert 'Traceback' not in errors


def test_every_request_is_answered_and_a_bad_one_refused_with_its_reason(operator: Operator):
    def offered() -> set[str]:
        found = operator.node.get_service_names_and_types_by_node(NODE_NAME, '/')
        return {n.rpartition('/')[2] for n, [kind] in found if kind.startswith(OFFERED_BY_RCLPY)}

    operator.spin_until(lambda: offered() >= SERVICES.keys(), 'the services')
    assert offered() == SERVICES.keys()
    for name, (service_type, requests) in SERVICES.items():
        for request in requests:
            assert isinstance(operator.call(service_type, name, request), service_type.Response)
    service_type, [request] = SERVICES['set_parameters']
    first, *others = operator.call(service_type, 'set_parameters', request).results
    assert first.successful
    assert len(others) == len(BAD)
    assert not any(each.successful for each in others)
    service_type, requests = SERVICES['set_parameters_atomically']
    for request in requests:
        result = operator.call(service_type, 'set_parameters_atomically', request).result
        assert not result.successful, request
        assert result.reason
