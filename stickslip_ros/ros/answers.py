"""The services that rclpy offers on every node: they answer whatever they are asked."""

from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.service import Service


def answer_everything(node: Node) -> None:
    """
    Have every service that a node offers by now refuse what rclpy does not expect.

    What rclpy raises in a service of its own, such as for a parameter of a type that does not
    exist or for a transition that does not fit the state, would end the executor, and with it
    the process; whoever asked would wait for ever.

    """
    for service in node.services:
        service.callback = partial(_answer, node, service, service.callback)


def _answer(node: Node, service: Service, callback: Any, request: Any, response: Any) -> Any:
    try:
        return callback(request, response)
    except Exception as error:  # noqa: BLE001 - rclpy may raise what it likes
        node.get_logger().warning(f'{service.srv_name.rpartition("/")[2]} refused: {error}')
        return _refusal(request, response, SetParametersResult(reason=str(error)))


def _refusal(request: Any, response: Any, result: SetParametersResult) -> Any:
    """Return an answer in which nothing has succeeded, but what was set before the bad one."""
    if isinstance(request, SetParameters.Request):
        done = list(response.results)
        response.results = done + [result] * (len(request.parameters) - len(done))
        return response
    if isinstance(request, SetParametersAtomically.Request):
        return SetParametersAtomically.Response(result=result)
    return type(response)()
