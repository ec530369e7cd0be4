"""The link between a drive and the page: a client of the drive with a thread of its own."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from queue import SimpleQueue
from threading import Event, Thread
from time import monotonic
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import FLOAT64_ARRAY, ArrayMessage
from stickslip_ros.interface.requests import typed_numbers
from stickslip_ros.interface.topics import NODE_NAME, SERVICES, Topic
from stickslip_ros.panel.controls import read_cycles, read_fault, read_numbers, shown_parameters
from stickslip_ros.panel.model import ACTIVE, Model, parsed_event
from stickslip_ros.parameters import specs
from stickslip_ros.ros.client import DriveClient, command_topic, open_context
from stickslip_ros.ros.executable import end_node, stay_on_this_host
from stickslip_ros.ros.interface import SERVICE_TYPES

LOOK_S = 0.5
"""Time between two looks at who is there, and two questions for the state of the drive."""
ANSWER_S = 1.5
"""Time after which a drive that has not answered counts as silent."""
SPIN_S = 0.1
TRANSITIONS = ('configure', 'activate', 'deactivate', 'cleanup')
TELLING = 'step_simulation'
"""A service that only drives have, whatever their nodes are called."""
BUTTONS = {each.name.removeprefix('~/'): SERVICE_TYPES[each.type_name] for each in SERVICES}
CALLED = BUTTONS | {
    'get_parameters': GetParameters,
    'set_parameters': SetParameters,
    'change_state': ChangeState,
    'get_state': GetState,
}
"""Types of the services that are called: those that have buttons, and the others."""


class Link:
    """
    A client of one drive at a time: tells a model what it hears, and does what is wished.

    Everything that is made or destroyed in ROS is so in its thread; who wishes something leaves
    it in a queue and wakes the thread.

    """

    def __init__(self, namespace: str = '', domain: int | None = None) -> None:
        stay_on_this_host()
        self._context = open_context(domain)
        self._node = Node(
            'stickslip_panel',
            context=self._context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.model = Model(f'/{namespace.strip("/")}/{NODE_NAME}'.replace('//', '/'))
        self._wishes: SimpleQueue[Mapping[str, Any]] = SimpleQueue()
        self._wake = self._node.create_guard_condition(self._do_wishes)
        self._acts: dict[str, Callable[[Mapping[str, Any]], None]] = {
            'command': self._command,
            'line': self._do_line,
            'service': self._call,
            'fault': self._set_fault,
            'lifecycle': self._change_state,
            'attach': self._choose_drive,
            'view': self.model.choose,
        }
        self._ended = Event()
        self._looked_s = self._asked_s = -LOOK_S
        self._drive = self._attached(self.model.drive)
        self._thread = Thread(target=self._run, name='client of the drive', daemon=True)
        self._thread.start()

    def state(self) -> dict[str, Any]:
        """Return what changes now and then, for the page."""
        return self.model.state()

    def frame(self) -> bytes | None:
        """Return the next picture for the page; None if it is the last one still."""
        return self.model.frame()

    def drawing(self) -> str:
        """Return the stand in its last cycles as SVG; empty as long as it is not known."""
        return self.model.drawing()

    def do(self, wish: Mapping[str, Any]) -> None:
        """Have the thread do what somebody wants."""
        self._wishes.put(wish)
        self._wake.trigger()

    def close(self) -> None:
        """Leave the drive, which goes on; the watchdog ends a jog."""
        self._ended.set()
        self._wake.trigger()
        self._thread.join()
        end_node(self._executor, self._node)
        self._context.try_shutdown()

    def _run(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=SPIN_S)
            now_s = monotonic()
            if now_s - self._looked_s >= LOOK_S:
                self._looked_s = now_s
                self._look()
                self._ask_state(now_s)

    # --- what is there

    def _attached(self, name: str) -> DriveClient:
        """Return a client of a drive, there or not, of which nothing is known yet."""
        self.model.forget(name)
        drive = DriveClient(self._node, name)
        drive.subscribe('trace', self._take_trace, raw=True)
        drive.subscribe('status', lambda message: self.model.take_status(message.data))
        drive.subscribe('event', self._take_event)
        drive.subscribe('diagnostics', self._take_diagnostics)
        # GetState as the last: once it answers, the drive knows all before it (see Handshake).
        self._services = {each: drive.service(kind, each) for each, kind in CALLED.items()}
        self._question: Future | None = None
        return drive

    def _choose_drive(self, wish: Mapping[str, Any]) -> None:
        if wish.get('drive') in self.model.drives:
            self._drive.close()
            self._drive = self._attached(wish['drive'])

    def _look(self) -> None:
        """See which drives the graph has."""
        self.model.drives = [
            node
            for name, namespace in self._node.get_node_names_and_namespaces()
            for node in [f'{namespace.rstrip("/")}/{name}']
            if name == NODE_NAME or self._node.count_services(f'{node}/{TELLING}')
        ]
        self.model.is_there = self._services['get_state'].service_is_ready()

    def _ask_state(self, now_s: float) -> None:
        """Ask the drive for its state, again if it does not answer."""
        client = self._services['get_state']
        if self._question is not None:
            if now_s - self._asked_s < ANSWER_S:
                return
            client.remove_pending_request(self._question)
            self._question = None
            self.model.lifecycle = ''
        if client.service_is_ready():
            self._asked_s = now_s
            self._question = client.call_async(GetState.Request())
            self._question.add_done_callback(self._take_state)
        else:
            self.model.lifecycle = ''

    # --- what is heard

    def _take_state(self, answer: Future) -> None:
        if answer is not self._question:
            return
        self._question = None
        label = answer.result().current_state.label
        if label != self.model.lifecycle:
            self.model.lifecycle = label
            names = list(specs())

            def take(answer: Future) -> None:
                values = map(parameter_value_to_python, answer.result().values)
                known = {n: v for n, v in zip(names, values, strict=False) if v is not None}
                self.model.take_parameters(known, shown_parameters())

            request = GetParameters.Request(names=names)
            self._services['get_parameters'].call_async(request).add_done_callback(take)

    def _take_trace(self, data: bytes) -> None:
        with suppress(RecordingError):
            message = unpack(FLOAT64_ARRAY, data)
            if isinstance(message, ArrayMessage) and message.data.ndim == 2 and message.data.size:
                labels = message.labels[-1].split(',')
                self.model.take_trace(message.data, [each.partition('[')[0] for each in labels])

    def _take_event(self, message: Any) -> None:
        event = parsed_event(message.data)
        if event is not None:
            self.model.take_event(event)

    def _take_diagnostics(self, message: Any) -> None:
        title = self.model.drive.lstrip('/')
        for status in message.status:
            name, _, part = status.name.partition(': ')
            if name == title:
                values = {each.key: each.value for each in status.values}
                self.model.take_part(part, status.level[0], status.message, values)

    # --- what is wished

    def _do_wishes(self) -> None:
        while not self._wishes.empty():
            wish = self._wishes.get()
            act = self._acts.get(str(wish.get('do')), lambda _: None)
            try:
                act(wish)
            except StickSlipError as error:
                self.model.note(str(wish.get('name')), str(error), bad=True)

    def _command(self, wish: Mapping[str, Any]) -> None:
        topic = command_topic(str(wish.get('name')), but='grant')
        self._send(topic, read_numbers(topic, wish.get('values')), wish.get('cycles', 1))

    def _do_line(self, wish: Mapping[str, Any]) -> None:
        """Send a command and its numbers, as ``stickslip command`` takes them."""
        name, *words = str(wish.get('text', '')).split() or ['']
        topic = command_topic(name, but='grant')
        self._send(topic, typed_numbers(COMMANDS[topic.request], words), 1)

    def _send(self, topic: Topic, numbers: list[float], cycles: object) -> None:
        if self.model.lifecycle != ACTIVE:
            raise StickSlipError(f'not sent: {self.model.condition()[1]}')
        self.model.note(topic.request, '')
        self._drive.command(topic.request, numbers, read_cycles(cycles))

    def _call(self, wish: Mapping[str, Any]) -> None:
        name = str(wish.get('name'))
        if name not in BUTTONS:
            return
        request = BUTTONS[name].Request()
        if hasattr(request, 'data'):
            request.data = bool(wish.get('wanted'))

        def take(answer: Any) -> None:
            if answer.message or not answer.success:  # else the event tells
                self.model.note(name, answer.message, bad=not answer.success)
            if name == 'set_paused' and answer.success:
                self.model.take_pause(is_paused=request.data)

        self._ask(name, name, request, take)

    def _set_fault(self, wish: Mapping[str, Any]) -> None:
        name, value = read_fault(wish.get('name'), wish.get('value'))
        parameters = [Parameter(name, value=value).to_parameter_msg()]

        def take(answer: Any) -> None:
            [result] = answer.results
            self.model.note(name, result.reason, bad=not result.successful)

        request = SetParameters.Request(parameters=parameters)
        self._ask(name, 'set_parameters', request, take)

    def _change_state(self, wish: Mapping[str, Any]) -> None:
        label = wish.get('transition')
        if label not in TRANSITIONS:
            return

        def take(answer: Any) -> None:
            words = '' if answer.success else f'{label} failed; the log of the drive says why'
            self.model.note('lifecycle', words, bad=not answer.success)
            self._looked_s = -LOOK_S

        request = ChangeState.Request(transition=Transition(label=label))
        self._ask('lifecycle', 'change_state', request, take)

    def _ask(self, control: str, service: str, request: Any, take: Callable[[Any], None]) -> None:
        """Call a service of the drive; its answer stands beside the control."""
        client = self._services[service]
        if not client.service_is_ready():
            raise StickSlipError(f'not asked: {self.model.condition()[1]}')
        self.model.note(control, '')
        client.call_async(request).add_done_callback(lambda done: take(done.result()))
