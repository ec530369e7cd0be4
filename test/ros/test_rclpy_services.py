"""The services that rclpy offers on every node answer whatever they are asked."""

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from executables import CONTROLLER, DRIVE, END_TIMEOUT_S, end
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
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from type_description_interfaces.srv import GetTypeDescription

from stickslip_ros.ros.executable import end_node
from stickslip_ros.testing import open_context

#: An answer to a client that DDS has not made known yet is lost.
ASK_AGAIN_S = 0.5
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


class Client:
    """Asks a process, again and again until it answers."""

    def __init__(self, ros_domain: int, process: subprocess.Popen[str], name: str) -> None:
        self.context = open_context(ros_domain)
        self.node = Node('client', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._process = process
        self._name = name
        self._clients: dict[str, Any] = {}

    def spin_until(self, condition: Callable[[], bool], timeout_s: float = END_TIMEOUT_S) -> bool:
        """Spin; tell whether the condition has come true while the process lived."""
        end_s = time.monotonic() + timeout_s
        while not condition() and time.monotonic() < end_s and self._process.poll() is None:
            self.executor.spin_once(timeout_sec=0.02)
        return condition()

    def offered(self) -> set[str]:
        """Give the names of the services that rclpy offers there."""
        found = dict(self.node.get_service_names_and_types_by_node(self._name, '/'))
        return {
            name.rpartition('/')[2]
            for name, [kind] in found.items()
            if kind.startswith(OFFERED_BY_RCLPY)
        }

    def ask(self, service_type: Any, name: str, request: Any) -> Any:
        """Give the answer to a request."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service_type, f'/{self._name}/{name}')
        client = self._clients[name]
        assert self.spin_until(client.service_is_ready)
        for _ in range(round(END_TIMEOUT_S / ASK_AGAIN_S)):
            future = client.call_async(request)
            if self.spin_until(future.done, ASK_AGAIN_S):
                return future.result()
            assert self._process.poll() is None, f'{name} {request} has ended the process'
        raise TimeoutError(f'{name} does not answer {request}')


@pytest.fixture(params=['stickslip_drive', 'position_controller'])
def asked(
    request: pytest.FixtureRequest, start: Callable, ros_domain: int
) -> Iterator[tuple[Client, dict[str, Any]]]:
    """Give who asks an executable, and what, by service."""
    is_drive = request.param == 'stickslip_drive'
    process = start(*(DRIVE if is_drive else CONTROLLER))
    client = Client(ros_domain, process, request.param)
    requests = OF_EVERY_NODE | OF_LIFECYCLE if is_drive else OF_EVERY_NODE
    assert client.spin_until(lambda: request.param in client.node.get_node_names())
    assert client.spin_until(lambda: client.offered() >= requests.keys())
    yield client, requests
    end_node(client.executor, client.node)
    client.context.try_shutdown()
    status, errors = end(process, signal.SIGINT)
    assert status == 0
    assert 'Traceback' not in errors


def test_every_request_is_answered_and_a_bad_one_refused_with_its_reason(
    asked: tuple[Client, dict[str, Any]],
):
    client, services = asked
    assert client.offered() == services.keys()
    for name, (service_type, requests) in services.items():
        for request in requests:
            assert isinstance(client.ask(service_type, name, request), service_type.Response)
    service_type, [request] = services['set_parameters']
    first, *others = client.ask(service_type, 'set_parameters', request).results
    assert first.successful
    assert len(others) == len(BAD)
    assert not any(each.successful for each in others)
    service_type, requests = services['set_parameters_atomically']
    for request in requests:
        result = client.ask(service_type, 'set_parameters_atomically', request).result
        assert not result.successful, request
        assert result.reason
