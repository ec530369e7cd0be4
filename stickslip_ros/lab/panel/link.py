# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A client of one drive in a separate thread; it feeds the model of the panel."""

from collections.abc import Callable, Generator, Mapping
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any

from geometry_msgs.msg import PointStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future
from std_msgs.msg import Float64MultiArray

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.instrument.commands import typed_command
from stickslip_ros.instrument.reports import read_event
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.interface.requests import BY_TOPIC, typed_numbers
from stickslip_ros.interface.topics import SERVICES, Topic
from stickslip_ros.lab.panel.controls import read_numbers, read_parameter
from stickslip_ros.lab.panel.model import ACTIVE, APPLY, PANEL, Model
from stickslip_ros.lab.panel.settings import read_settings
from stickslip_ros.message_types import FLOAT64_ARRAY
from stickslip_ros.parameters import NODE_NAME, spec_of, specs
from stickslip_ros.ros.client import DriveClient, command_topic, drives_of, open_context, stamp_ns
from stickslip_ros.ros.executable import (
    SPIN_S,
    end_node,
    open_executor,
    spin,
    stay_on_this_host,
)
from stickslip_ros.ros.guard import GuardedNode, Summons
from stickslip_ros.ros.interface import SERVICE_TYPES
from stickslip_ros.units import joined

_LOOK_S = 0.5  # time between two looks at the graph and two requests of the state, s
_LOOKS = 3
"""Looks without an answer after which a drive is silent; counted, as a busy panel is slow
itself."""
_TWIN_TYPES = {
    'position': PointStamped,
    'residual': PointStamped,
    'steps': Float64MultiArray,
    'parameters': Float64MultiArray,
}
"""Topics of a twin in the namespace of the drive."""
_TWIN_DEPTH = 400  # two windows; a slow page loses older ones
TRANSITIONS = ('configure', 'activate', 'deactivate', 'cleanup')
BUTTONS = {each.name.removeprefix('~/'): SERVICE_TYPES[each.type_name] for each in SERVICES}
CALLED = BUTTONS | {
    'get_parameters': GetParameters,
    'set_parameters': SetParameters,
    'set_parameters_atomically': SetParametersAtomically,
    'change_state': ChangeState,
    'get_state': GetState,
}
"""Types of all services: those with buttons, and the others."""


def _messages(values: Mapping[str, Any]) -> list[Any]:
    """Return parameters as ROS sends them: an array is a list."""
    plain = {name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}
    return [Parameter(name, value=v).to_parameter_msg() for name, v in plain.items()]


def _setting(values: Mapping[str, Any]) -> tuple[str, Any]:
    """Return the service that sets all values or none, and its request."""
    request = SetParametersAtomically.Request(parameters=_messages(values))
    return 'set_parameters_atomically', request


def _transition(label: str) -> tuple[str, Any]:
    """Return the service of the lifecycle, and its request."""
    return 'change_state', ChangeState.Request(transition=Transition(label=label))


class Link:
    """A client of one drive at a time; all ROS objects are made and destroyed in its thread."""

    def __init__(self, namespace: str = '', domain: int | None = None, name: str = '') -> None:
        self._takes_any = not name
        stay_on_this_host()
        self._context = open_context(domain)
        self._node = GuardedNode(
            'stickslip_panel',
            context=self._context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._executor = open_executor(self._context)
        self._executor.add_node(self._node)
        self.model = Model(f'/{namespace.strip("/")}/{name or NODE_NAME}'.replace('//', '/'))
        self._node.guard.tell = partial(self.model.note, PANEL, bad=True)
        self._node.create_subscription(ParameterEvent, '/parameter_events', self._heed, 100)
        self._asks_why: Callable[[str], None] | None = None  # of a drive that did not activate
        self.state, self.frame = self.model.state, self.model.frame
        self.twin_frame, self.drawing = self.model.twin_frame, self.model.drawing
        self.table, self.settings = self.model.table, self.model.settings
        self._wishes: SimpleQueue[Mapping[str, Any]] = SimpleQueue()
        self._do_soon = Summons(self._node, self._do_wishes)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._node.create_timer(_LOOK_S, self._look, clock=steady)
        self._acts: dict[str, Callable[[Mapping[str, Any]], None]] = {
            'command': self._command,
            'line': self._do_line,
            'service': self._press,
            'set': self._set,
            'apply': self._apply,
            'lifecycle': self._change_state,
            'attach': self._choose_drive,
            'view': self.model.choose,
        }
        self._ended = Future()
        self._looks = 0  # since the last request of the state
        self._twin_topics: list[Any] = []  # subscriptions
        self._drive = self._attached(self.model.drive)
        self._thread = Thread(target=self._run, name='client of the drive', daemon=True)
        self._thread.start()

    def do(self, wish: Mapping[str, Any]) -> None:
        """Queue an action for the thread."""
        self._wishes.put(wish)
        self._do_soon.send()

    def close(self) -> None:
        """Disconnect; the drive runs on, and its watchdog ends a jog."""
        self._ended.set_result(None)
        self._thread.join()
        end_node(self._executor, self._node)
        self._context.try_shutdown()

    def _run(self) -> None:
        while not self._ended.done():
            try:
                spin(self._executor, self._ended, SPIN_S)
            except Exception as error:  # noqa: BLE001, PERF203 - of an answer, the graph
                self._tell(error)

    def _tell(self, error: Exception) -> None:
        """Show an unexpected error on the page."""
        self.model.note(PANEL, f'{type(error).__name__}: {error}', bad=True)

    # --- graph and state

    def _attached(self, name: str) -> DriveClient:
        """Return a client of a drive, and clear the model."""
        self.model.forget(name)
        drive = DriveClient(self._node, name)
        keep = self.model.take_sent  # before the event that may refuse it
        drive.subscribe(
            'command/position', lambda sent: keep('position', sent.point.x, stamp_ns(sent))
        )
        drive.subscribe('command/preload', lambda sent: keep('preload', sent.data))
        drive.subscribe('trace', self._take_trace, raw=True, best_effort=True)
        drive.subscribe('status', lambda message: self.model.take_status(message.data))
        drive.subscribe('event', self._take_event)
        drive.subscribe('info', lambda _: self._ask_parameters())  # each activation
        drive.subscribe('diagnostics', self._take_diagnostics)
        while self._twin_topics:
            self._node.destroy_subscription(self._twin_topics.pop())
        for key, kind in _TWIN_TYPES.items():
            topic, take = f'{name.rpartition("/")[0]}/twin/{key}', partial(self._take_twin, key)
            heard = self._node.create_subscription(kind, topic, take, _TWIN_DEPTH)
            self._twin_topics.append(heard)
        # GetState is the last client: its answer shows that the others are known (see Handshake).
        self._services = {each: drive.service(kind, each) for each, kind in CALLED.items()}
        self._question: Future | None = None
        return drive

    def _choose_drive(self, wish: Mapping[str, Any]) -> None:
        if wish.get('drive') in self.model.drives:
            self._takes_any = False
            self._drive.close()
            self._drive = self._attached(wish['drive'])

    def _look(self) -> None:
        """List the drives, attach to the only drive of the namespace, ask for its state."""
        self.model.drives = drives_of(self._node)
        place = self.model.drive.rpartition('/')[0]
        near = [each for each in self.model.drives if each.rpartition('/')[0] == place]
        if self._takes_any and near:
            self._takes_any = False
            if len(near) == 1 and near[0] != self.model.drive:
                self._choose_drive({'drive': near[0]})
        self.model.is_there = self._services['get_state'].service_is_ready()
        self.model.count_silence(_LOOK_S)
        self._ask_state()
        self._node.guard.begin_report()

    def _ask_state(self) -> None:
        """Request the state of the drive, again if it does not answer."""
        client = self._services['get_state']
        if self._question is not None:
            self._looks += 1
            if self._looks < _LOOKS:
                return
            client.remove_pending_request(self._question)
            self._question = None
            self.model.lifecycle = ''
        if client.service_is_ready():
            self._looks = 0
            self._question = client.call_async(GetState.Request())
            self._question.add_done_callback(self._take_state)
        else:
            self.model.lifecycle = ''

    # --- topics

    def _take_state(self, answer: Future) -> None:
        if answer is not self._question:
            return
        self._question = None
        label = answer.result().current_state.label
        if label != self.model.lifecycle:
            self.model.lifecycle = label
            self._ask_parameters()

    def _ask_parameters(self) -> None:
        names = list(specs())

        def take(answer: Future) -> None:
            values = map(parameter_value_to_python, answer.result().values)
            known = {n: v for n, v in zip(names, values, strict=False) if v is not None}
            self.model.take_parameters(known)

        request = GetParameters.Request(names=names)
        self._services['get_parameters'].call_async(request).add_done_callback(take)

    def _take_trace(self, data: bytes) -> None:
        message = unpack(FLOAT64_ARRAY, data)
        assert isinstance(message, ArrayMessage)
        if message.data.ndim != 2:
            raise WrongKind('trace', message.labels, 'a table of rows and columns', 'label both')
        labels = message.labels[-1].split(',')
        self.model.take_trace(message.data, [each.partition('[')[0] for each in labels])

    def _take_twin(self, key: str, message: Any) -> None:
        if isinstance(message, PointStamped):
            self.model.take_twin_reading(key, stamp_ns(message), message.point.x)
        else:
            label = ''.join(each.label for each in message.layout.dim[-1:])
            self.model.take_twin_row(key, label.split(','), message.data)

    def _take_event(self, message: Any) -> None:
        event = read_event(message.data)
        if event is None:
            raise WrongKind('event', message.data, 'the event of a drive', 'publish none yourself')
        self.model.take_event(event)

    def _take_diagnostics(self, message: Any) -> None:
        title = self.model.drive.lstrip('/')
        for status in message.status:
            name, _, part = status.name.partition(': ')
            if name == title:
                values = {each.key: each.value for each in status.values}
                self.model.take_part(part, status.level[0], status.message, values)
                if part == 'drive' and self._asks_why and status.message != 'inactive':
                    goes_on, self._asks_why = self._asks_why, None
                    goes_on(status.message)

    def _heed(self, event: Any) -> None:
        """Ask a drive for the parameters that it, or another program, has changed."""
        if event.node == self.model.drive and event.changed_parameters:
            self._ask_parameters()

    # --- actions of the page

    def _do_wishes(self) -> None:
        while not self._wishes.empty():
            wish = self._wishes.get()
            act = self._acts.get(str(wish.get('do')), lambda _: None)
            try:
                act(wish)
            except StickSlipError as error:
                self.model.note(str(wish.get('name')), str(error), bad=True)
            except Exception as error:  # noqa: BLE001 - STOP must work after any error
                self._tell(error)

    def _command(self, wish: Mapping[str, Any]) -> None:
        topic = command_topic(str(wish.get('name')), but='grant')
        self._send(topic, read_numbers(topic, wish.get('values')), wish.get('cycles', 1))

    def _do_line(self, wish: Mapping[str, Any]) -> None:
        """Send a command line, as ``stickslip command`` takes it."""
        name, *words = joined(str(wish.get('text', '')).split()) or ['']
        command = typed_command(name)
        numbers = typed_numbers(command, words)
        if command.has_service:
            self._call(command.name, wanted=any(numbers), control=str(wish.get('name')))
        else:
            self._send(BY_TOPIC[command.name], numbers, 1)

    def _send(self, topic: Topic, numbers: Any, cycles: Any) -> None:
        if self.model.lifecycle != ACTIVE:
            raise StickSlipError(f'not sent: {self.model.condition()[1]}')
        self.model.note(topic.request, '')
        self._drive.command(topic.request, numbers, cycles)

    def _press(self, wish: Mapping[str, Any]) -> None:
        name = str(wish.get('name'))
        if name in BUTTONS:
            self._call(name, wanted=bool(wish.get('wanted')), control=name)

    def _call(self, name: str, *, wanted: bool, control: str) -> None:
        request = BUTTONS[name].Request()
        if hasattr(request, 'data'):
            request.data = wanted

        def take(answer: Any) -> None:
            if answer.message or not answer.success:  # the event reports success
                self.model.note(control, answer.message, bad=not answer.success)
            if name == 'set_paused' and answer.success:
                self.model.take_pause(is_paused=request.data)

        self._ask(control, name, request, take)

    def _set(self, wish: Mapping[str, Any]) -> None:
        """Set a live parameter."""
        name, value = read_parameter(wish.get('name'), wish.get('value'))

        def take(answer: Any) -> None:
            [result] = answer.results
            self.model.note(name, result.reason, bad=not result.successful)

        request = SetParameters.Request(parameters=_messages({name: value}))
        self._ask(name, 'set_parameters', request, take)

    def _apply(self, wish: Mapping[str, Any]) -> None:
        wanted, before = read_settings(wish.get('values')), self.model.stand.flat()
        self.model.stand.updated(wanted)  # refuses values that do not fit together
        self._go_on(self._changes(wanted, {name: before[name] for name in wanted}), None)

    def _changes(
        self, wanted: Mapping[str, Any], before: Mapping[str, Any]
    ) -> Generator[tuple[str, Any] | None, Any, None]:
        """
        Set parameters; deactivate an active drive for those that are not live, then activate it.

        A drive that refuses to activate gets its former values again. Yields a service and its
        request, for its answer, or None, for the reason.

        """
        restarts = self.model.lifecycle == ACTIVE and not all(spec_of(n).live for n in wanted)
        if restarts and not (yield _transition('deactivate')).success:
            why = 'deactivate failed; the log of the drive says why'
        else:
            why = (yield _setting(wanted)).result.reason
            if restarts and not (yield _transition('activate')).success:
                why = why or (yield None).removeprefix('inactive; ')
                yield _setting(before)
                yield _transition('activate')
        self._ask_state()
        told = f'{why}; nothing is changed' if why else 'applied'
        told += '; the drive began anew' * (restarts and not why)
        self.model.note(APPLY, told, bad=bool(why))

    def _go_on(self, steps: Generator[tuple[str, Any] | None, Any, None], answer: Any) -> None:
        """Pass the answer of the last step on, and take the next one."""
        try:
            step = steps.send(answer)
        except StopIteration:
            return
        if step is None:
            self._asks_why = partial(self._go_on, steps)
        else:
            self._ask(APPLY, *step, partial(self._go_on, steps))

    def _change_state(self, wish: Mapping[str, Any]) -> None:
        label = wish.get('transition')
        if label not in TRANSITIONS:
            return

        def take(answer: Any) -> None:
            words = '' if answer.success else f'{label} failed; the log of the drive says why'
            self.model.note('lifecycle', words, bad=not answer.success)
            self._ask_state()

        self._ask('lifecycle', *_transition(label), take)

    def _ask(self, control: str, service: str, request: Any, take: Callable[[Any], None]) -> None:
        """Call a service of the drive; its answer appears next to the control."""
        client = self._services[service]
        if not client.service_is_ready():
            raise StickSlipError(f'not asked: {self.model.condition()[1]}')
        self.model.note(control, '')
        client.call_async(request).add_done_callback(lambda done: take(done.result()))
