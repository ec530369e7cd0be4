"""What the tests of the node share: a drive and an operator in one process, over real topics."""

import gc
import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from stickslip_ros.units import NS_PER_S

os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'  # before rclpy is imported

import pytest
from contexts import open_context
from executables import await_network
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Log
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from stickslip_ros.recording.topics import NODE_NAME, TOPICS
from stickslip_ros.ros.ending import end_node
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.testing.operator import Operator

SPIN_S = 0.02
REPORT_S = 0.2
LISTEN_DEPTH = 10_000

TRANSITIONS = {
    'configure': Transition.TRANSITION_CONFIGURE,
    'cleanup': Transition.TRANSITION_CLEANUP,
    'activate': Transition.TRANSITION_ACTIVATE,
    'deactivate': Transition.TRANSITION_DEACTIVATE,
    'shutdown unconfigured': Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    'shutdown inactive': Transition.TRANSITION_INACTIVE_SHUTDOWN,
    'shutdown active': Transition.TRANSITION_ACTIVE_SHUTDOWN,
}

#: Sensors without errors: a reading is the truth, to the bit.
PERFECT_SENSORS = {
    'interferometer.noise_density': 0.0,
    'interferometer.resolution': 0.0,
    'interferometer.bandwidth': 0.0,
    'load_cell.noise_density': 0.0,
    'load_cell.resolution': 0.0,
    'load_cell.bandwidth': 0.0,
}


class Stand:
    """
    A drive, its executor on a thread of its own, and an operator that a test spins.

    The operator lives in a context of its own, as it would in a process of its own.

    """

    def __init__(
        self, domain: int, namespace: str, values: dict[str, Any], rules: tuple[str, ...] = ()
    ) -> None:
        self.domain = domain
        self.namespace = namespace
        self._context = open_context(domain, namespace, rules)
        self.drive = StickSlipDrive(
            context=self._context,
            parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.drive)
        self._ended = threading.Event()
        self.crash: Exception | None = None
        self.has_raised = False
        self._thread = threading.Thread(target=self._spin, name='executor of the drive')
        self._thread.start()
        self._operator_context = open_context(domain, namespace)
        self.operator = Operator(self._operator_context, self.drive.get_name())

    def _spin(self) -> None:
        try:
            while not self._ended.is_set():
                self._executor.spin_once(timeout_sec=SPIN_S)
        except Exception as error:  # noqa: BLE001 - _raise_crash tells it to the test
            self.crash = error

    def listen(self, key: str) -> list[Any]:
        """Collect the messages of a topic from now on; they come while the operator spins."""
        [topic] = [each for each in TOPICS if each.key == key]
        profile = to_profile(topic.qos)
        profile.depth = LISTEN_DEPTH  # of a latched topic the writer still keeps one
        heard: list[Any] = []
        self.operator.node.create_subscription(
            MESSAGE_TYPES[topic.type_name],
            topic.name.replace('~', NODE_NAME),
            heard.append,
            profile,
        )
        return heard

    def listen_to_log(self) -> list[str]:
        """Collect what the drive writes into its log from now on."""
        lines: list[str] = []
        self.operator.node.create_subscription(
            Log, '/rosout', lambda message: lines.append(message.msg), LISTEN_DEPTH
        )
        return lines

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service of the drive and give its answer."""
        future = self.operator.ask(service_type, name, request)
        self.operator.spin_until(lambda: future.done() or self.crash is not None, name)
        self._raise_crash()
        return future.result()

    def change_state(self, transition: str) -> bool:
        """Ask for a transition as a lifecycle manager does; tell whether it was made."""
        request = ChangeState.Request(transition=Transition(id=TRANSITIONS[transition]))
        return bool(self.call(ChangeState, 'change_state', request).success)

    def state(self) -> str:
        """Ask for the present state of the lifecycle."""
        return str(self.call(GetState, 'get_state', GetState.Request()).current_state.label)

    def close(self) -> None:
        """End the drive as its executable does, then leave; the second time, nothing."""
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join()
        end_node(self._executor, self.drive)
        self._context.try_shutdown()
        self.operator.close()
        self._operator_context.try_shutdown()
        # rclpy leaves a lifecycle node in the graph, with its services, until it is collected, or
        # never where a traceback holds it; the next drive would have a twin.
        self.drive._state_machine.destroy_when_not_in_use()
        del self.drive, self.operator, self._executor
        gc.collect()
        self._raise_crash()

    def _raise_crash(self) -> None:
        """Say, once, what has ended the executor of the drive."""
        if self.crash is not None and not self.has_raised:
            self.has_raised = True
            raise self.crash


@pytest.fixture(scope='session', autouse=True)
def _quiet_surroundings(
    tmp_path_factory: pytest.TempPathFactory, compiled_kernels: None
) -> Iterator[None]:
    """Keep logs out of the home folder, and what the machine has set up for ROS out of a test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('log')))
        patch.delenv('ROS_DOMAIN_ID', raising=False)
        patch.delenv('ROS_NAMESPACE', raising=False)
        gc.collect()
        gc.freeze()  # a stand that is closed collects garbage: of its own, not all there was
        yield


@pytest.fixture
def launch(domain: int, tmp_path: Path) -> Iterator[Callable[..., Stand]]:
    """Give a function that starts a drive with parameters; what it started ends with the test."""
    started: list[Stand] = []

    def launch_stand(
        values: dict[str, Any] | None = None,
        namespace: str = '',
        *,
        wait: bool = True,
        rules: tuple[str, ...] = (),
    ) -> Stand:
        given = {'record.directory': str(tmp_path), **(values or {})}
        started.append(Stand(domain, namespace, given, rules))
        if wait:
            started[-1].operator.wait_for_drive()
        return started[-1]

    yield launch_stand
    while started:
        started.pop().close()


@pytest.fixture
def stand(launch: Callable[..., Stand]) -> Stand:
    """Give the stand of the paper, active, with an operator who hears it."""
    return launch()


@pytest.fixture
def manual(launch: Callable[..., Stand]) -> Stand:
    """Give a stand that waits, unconfigured, for a lifecycle manager."""
    return launch({'autostart': False}, wait=False)


@pytest.fixture
def started() -> list[subprocess.Popen[str]]:
    """Give the processes that a test has started."""
    return []


@pytest.fixture
def start(
    domain: int, tmp_path: Path, started: list[subprocess.Popen[str]]
) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Give a function that starts the executable; what still runs at the end is killed."""

    def start_process(*words: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            words,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain)},
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start_process
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def meet(domain: int, started: list[subprocess.Popen[str]]) -> Iterator[Callable[..., Operator]]:
    """Give a function that gives an operator who hears the drive."""
    met: list[tuple[Operator, Context]] = []

    def meet_drive(namespace: str = '', *, wait: bool = True) -> Operator:
        for process in started:
            await_network(process)
        context = open_context(domain, namespace)
        met.append((Operator(context), context))
        if wait:
            met[-1][0].wait_for_drive()
        return met[-1][0]

    yield meet_drive
    for operator, context in met:
        operator.close()
        context.try_shutdown()


@pytest.fixture
def frequent_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have drives report often, for tests that wait for some reports."""
    monkeypatch.setattr('stickslip_ros.ros.node.DIAGNOSTICS_PERIOD_S', REPORT_S)


@pytest.fixture(scope='session')
def perfect_sensors() -> dict[str, float]:
    return dict(PERFECT_SENSORS)


@pytest.fixture(scope='session')
def states() -> type[State]:
    return State


@pytest.fixture(scope='session')
def stamp_ns() -> Callable[[Any], int]:
    """Give the stamp of a message, in ns."""
    return lambda message: message.header.stamp.sec * NS_PER_S + message.header.stamp.nanosec
