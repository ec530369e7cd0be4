"""The services of a node beside those of its lifecycle."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from rclpy.node import Node

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import COMMANDS, SET_BOOL, Command, Request
from stickslip_ros.interface.topics import SERVICES
from stickslip_ros.recording.run_file import save_checkpoint
from stickslip_ros.ros.interface import SERVICE_TYPES
from stickslip_ros.runtime.orders import AT_ONCE
from stickslip_ros.runtime.recordings import await_reply
from stickslip_ros.runtime.session import Session
from stickslip_ros.units import NANO

Act = Callable[[Session, Any], str]
"""Does what a service is for and returns the message of its answer."""


class Services:
    """
    What can be asked of a drive.

    Parameters
    ----------
    node : Node
        Their owner.
    get_session : callable
        Returns the running drive, or refuses.
    on_refusal : callable
        Receives the name of a service and why it was refused.
    acts : mapping of str to callable
        What only the node can do, by the name of the service.

    """

    def __init__(
        self,
        node: Node,
        get_session: Callable[[], Session],
        on_refusal: Callable[[str, str], None],
        acts: Mapping[str, Act],
    ) -> None:
        self._node = node
        self._get_session = get_session
        self._on_refusal = on_refusal
        self._acts = {**_ACTS, **acts}
        self._offered: list[Any] = []

    def offer(self) -> None:
        """Offer every declared service."""
        for service in SERVICES:
            name = service.name.removeprefix('~/')
            callback = partial(self._answer, name, self._acts[name])
            self._offered.append(
                self._node.create_service(SERVICE_TYPES[service.type_name], service.name, callback)
            )

    def release(self) -> None:
        """Take every service away."""
        while self._offered:
            self._node.destroy_service(self._offered.pop())

    def _answer(self, name: str, act: Act, request: Any, response: Any) -> Any:
        try:
            response.message = act(self._get_session(), request)
            response.success = True
        except StickSlipError as error:
            response.success = False
            response.message = f'{name} refused: {error}'
            self._on_refusal(name, response.message)
        return response


def _ask(command: Command, session: Session, request: Any) -> str:
    """Let the bench carry out a command; a switch is its only number."""
    values = (float(request.data),) if command.interface == SET_BOOL else ()
    await_reply(session.submit(Request(command.name, values), AT_ONCE))
    return ''


def _set_paused(session: Session, request: Any) -> str:
    session.set_paused(request.data)
    return f'paused at {_time(session)}' if request.data else 'running'


def _step_simulation(session: Session, _: Any) -> str:
    await_reply(session.step())
    return f'advanced to {_time(session)}'


def _save_checkpoint(session: Session, _: Any) -> str:
    return str(save_checkpoint(await_reply(session.save()), session.parameters).absolute())


def _time(session: Session) -> str:
    return f'{session.bench.time_ns * NANO:.9g} s'


_ACTS: dict[str, Act] = {
    **{name: partial(_ask, row) for name, row in COMMANDS.items() if row.has_service},
    'set_paused': _set_paused,
    'step_simulation': _step_simulation,
    'save_checkpoint': _save_checkpoint,
}
