"""The lifecycle node: commands in, readings out; the drive itself runs in a session."""

from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoReply
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.cdr import pack_string, pack_uint32
from stickslip_ros.recording.feed import Packed
from stickslip_ros.recording.run_file import info_json, run_path
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.recording.topics import COMMANDS, NODE_NAME, READINGS, SERVICES
from stickslip_ros.ros.health import drive_status, pace_status, recorder_status
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.ros.parameter_bridge import (
    declare_parameters,
    judge_changes,
    read_parameters,
)
from stickslip_ros.ros.requests import to_request
from stickslip_ros.ros.session import Session, require

REPLY_TIMEOUT_S = 10.0
DIAGNOSTICS_PERIOD_S = 1.0
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class StickSlipDrive(LifecycleNode):
    """
    The virtual test stand as a ROS 2 lifecycle node.

    With the parameter ``autostart`` (the default) it configures and activates itself.
    Keyword arguments are those of ``rclpy.node.Node``: ``namespace``, ``context``,
    ``parameter_overrides`` and so on.

    Raises
    ------
    StickSlipError
        If a parameter given at the start is not known or not allowed.

    """

    def __init__(self, node_name: str = NODE_NAME, **node_arguments: Any) -> None:
        super().__init__(
            node_name, automatically_declare_parameters_from_overrides=True, **node_arguments
        )
        self._active: Session | None = None
        self._session: Session | None = None
        self._publishers_by_key: dict[str, Any] = {}
        self._entities: list[tuple[Any, Any]] = []
        self._answer_misfits()
        parameters = declare_parameters(self)
        self.add_on_set_parameters_callback(self._on_parameters)
        if parameters.autostart:
            self.trigger_configure()
            self.trigger_activate()

    def _answer_misfits(self) -> None:
        """Refuse a transition that does not fit the state: rclpy would let it end the process."""
        change_state = self._service_change_state.callback

        def guarded(request: Any, response: Any) -> Any:
            try:
                return change_state(request, response)
            except RuntimeError as error:  # the base of rclpy's RCLError
                self.get_logger().warning(f'transition refused: {error}')
                response.success = False
                return response

        self._service_change_state.callback = guarded

    @property
    def session(self) -> Session:
        """The running drive; refused while the node is not active."""
        return require(self._active)

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Build the drive, compile its kernels, offer topics and services."""
        try:
            self._session = Session(read_parameters(self), self._publish)
        except StickSlipError as error:
            self.get_logger().error(f'not configured: {error}')
            return FAILURE
        self._offer_topics()
        self._offer_services()
        timer = self.create_timer(DIAGNOSTICS_PERIOD_S, self._publish_diagnostics)
        self._entities.append((self.destroy_timer, timer))
        return SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the drive, and the recording if ``record.on_start`` says so."""
        result = super().on_activate(state)
        try:
            session = self._up_to_date()
        except StickSlipError as error:
            self.get_logger().error(f'not activated: {error}')
            super().on_deactivate(state)
            return FAILURE
        self._publish(Packed('info', 0, pack_string(info_json(session.parameters))))
        self._publish(Packed('status', 0, pack_uint32(int(session.status))))
        try:
            if session.parameters.record.on_start:
                session.exchange_recording(self._open_recording(session))
        except StickSlipError as error:
            self.get_logger().error(f'not activated: {error}')
            super().on_deactivate(state)
            return FAILURE
        session.start()
        self._active = session
        return result

    def _up_to_date(self) -> Session:
        """Return the drive, built anew if its parameters were changed while it was inactive."""
        parameters = read_parameters(self)
        old = self._session
        if old is None or old.failure is not None or old.parameters != parameters:
            old = self._session = Session(parameters, self._publish)
        return old

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the drive and finish its recording; its state stays."""
        self._halt()
        return super().on_deactivate(state)

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Give up the drive, its topics and its services."""
        self._release()
        return SUCCESS

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Stop whatever runs, finish the recording."""
        self._halt()
        self._release()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Return to the unconfigured state after a failed transition."""
        return self.on_shutdown(state)

    def destroy_node(self) -> None:
        """Finish the recording before the node goes, whatever state it is in."""
        self._halt()
        super().destroy_node()

    def _offer_topics(self) -> None:
        for topic in READINGS:
            publisher = self.create_lifecycle_publisher(
                MESSAGE_TYPES[topic.type_name], topic.name, to_profile(topic.qos)
            )
            self._publishers_by_key[topic.key] = publisher
            self._entities.append((self.destroy_lifecycle_publisher, publisher))
        for topic in COMMANDS:
            subscription = self.create_subscription(
                MESSAGE_TYPES[topic.type_name],
                topic.name,
                partial(self._on_command, topic.key),
                to_profile(topic.qos),
            )
            self._entities.append((self.destroy_subscription, subscription))

    def _offer_services(self) -> None:
        handlers: dict[str, tuple[Any, Any]] = {
            '~/stop': (Trigger, partial(self._on_trigger, 'stop')),
            '~/reset': (Trigger, partial(self._on_trigger, 'reset')),
            '~/set_recording': (SetBool, self._on_set_recording),
        }
        for service in SERVICES:
            service_type, handler = handlers[service.name]
            offered = self.create_service(service_type, service.name, handler)
            self._entities.append((self.destroy_service, offered))

    def _release(self) -> None:
        self._session = None
        self._publishers_by_key.clear()
        while self._entities:
            destroy, entity = self._entities.pop()
            destroy(entity)

    def _halt(self) -> None:
        session, self._active = self._active, None
        if session is None:
            return
        writer = session.stop()
        if session.failure is not None:
            self.get_logger().error(f'the drive had stopped: {session.failure}')
        if writer is not None:
            self._close_recording(writer)

    def _publish(self, packed: Packed) -> None:
        self._publishers_by_key[packed.key].publish(packed.data)

    def _on_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        return judge_changes(self, changes, frozen=self._active is not None)

    def _on_command(self, key: str, message: Any) -> None:
        try:
            self.session.submit(to_request(key, message))
        except StickSlipError as error:
            self.get_logger().warning(f'command/{key} refused: {error}')

    def _on_trigger(
        self, name: str, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        try:
            _await_reply(self.session.submit(Request(name)))
            response.success = True
        except StickSlipError as error:
            response.message = f'{name} refused: {error}'
        return response

    def _on_set_recording(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        try:
            response.message = self._set_recording(request.data)
            response.success = True
        except StickSlipError as error:
            response.message = str(error)
        return response

    def _set_recording(self, wanted: bool) -> str:
        session = self.session
        if wanted == (session.writer is not None):
            raise StickSlipError('already recording' if wanted else 'not recording')
        if wanted:
            writer = self._open_recording(session)
            try:
                _await_reply(session.exchange_recording(writer))
            except StickSlipError:
                writer.close()
                raise
            return str(writer.recorder.path)
        ended = _await_reply(session.exchange_recording(None))
        return '' if ended is None else self._close_recording(ended)

    def _open_recording(self, session: Session) -> RunWriter:
        parameters = session.parameters
        return RunWriter(
            run_path(parameters),
            parameters,
            wait=parameters.sim.real_time_factor == 0.0,
            namespace=self.get_namespace(),
            node_name=self.get_name(),
        )

    def _close_recording(self, writer: RunWriter) -> str:
        """Finish a file; the drive does not wait for the disk, the caller does."""
        writer.close()
        recorder = writer.recorder
        if recorder.error is not None:
            self.get_logger().error(f'{recorder.path} is incomplete: {recorder.error}')
        self.get_logger().info(
            f'recorded {recorder.path}: {recorder.written} messages, {recorder.dropped} dropped'
        )
        return str(recorder.path)

    def _publish_diagnostics(self) -> None:
        session = self._active
        if session is None:
            return
        name = self.get_fully_qualified_name().lstrip('/')
        array = DiagnosticArray(
            status=[
                pace_status(name, session.pacer.report()),
                drive_status(name, session),
                recorder_status(name, session),
            ]
        )
        array.header.stamp = self.get_clock().now().to_msg()
        self._publishers_by_key['diagnostics'].publish(array)


def _await_reply(reply: 'Future[RunWriter | None]') -> RunWriter | None:
    """Wait for a tick to carry out an order; one that does not come is withdrawn and refused."""
    try:
        return reply.result(REPLY_TIMEOUT_S)
    except NoReply:
        reply.cancel()
        raise StickSlipError(
            f'the drive made no tick in {REPLY_TIMEOUT_S:g} s; look at /diagnostics'
        ) from None
