# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The services that rclpy offers on every node answer whatever they are asked."""

import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, NamedTuple

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

from stickslip_ros.errors import StickSlipError
from stickslip_ros.testing import Operator

#: An answer to a client that DDS has not made known yet is lost.
ASK_AGAIN_S, ATTEMPTS = 0.5, 60
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


class Asked(NamedTuple):
    """An executable by the name of its node, and who asks it what, by service."""

    name: str
    operator: Operator
    services: dict[str, Any]

    def offered(self) -> set[str]:
        """Give the names of the services that rclpy offers there."""
        node = self.operator.node
        found = dict(node.get_service_names_and_types_by_node(self.name, '/'))
        return {
            name.rpartition('/')[2]
            for name, [kind] in found.items()
            if kind.startswith(OFFERED_BY_RCLPY)
        }

    def ask(self, service_type: Any, name: str, request: Any) -> Any:
        """Give the answer to a request, which is made again until it comes."""
        client = self.operator.node.create_client(service_type, f'/{self.name}/{name}')
        self.operator.spin_until(client.service_is_ready, name)
        for _ in range(ATTEMPTS):
            future = client.call_async(request)
            with suppress(StickSlipError):
                self.operator.spin_until(future.done, name, ASK_AGAIN_S)
                break
        self.operator.node.destroy_client(client)
        return future.result()


@pytest.fixture
def asked(start: Callable, meet: Callable) -> Iterator[Asked]:
    """Give who asks the drive, which lives until the end of the test."""
    process = start(*DRIVE)
    asked = Asked('stickslip_drive', meet(wait=False), OF_EVERY_NODE | OF_LIFECYCLE)

    def check() -> None:
        assert process.poll() is None

    asked.operator.check = check
    asked.operator.spin_until(
        lambda: asked.name in asked.operator.node.get_node_names(), asked.name
    )
    asked.operator.spin_until(lambda: asked.offered() >= asked.services.keys(), 'the services')
    yield asked
    status, errors = end(process, signal.SIGINT)
    assert status == 0
    assert 'Traceback' not in errors


def test_every_request_is_answered_and_a_bad_one_refused_with_its_reason(asked):
    services = asked.services
    assert asked.offered() == services.keys()
    for name, (service_type, requests) in services.items():
        for request in requests:
            assert isinstance(asked.ask(service_type, name, request), service_type.Response)
    service_type, [request] = services['set_parameters']
    first, *others = asked.ask(service_type, 'set_parameters', request).results
    assert first.successful
    assert len(others) == len(BAD)
    assert not any(each.successful for each in others)
    service_type, requests = services['set_parameters_atomically']
    for request in requests:
        result = asked.ask(service_type, 'set_parameters_atomically', request).result
        assert not result.successful, request
        assert result.reason
