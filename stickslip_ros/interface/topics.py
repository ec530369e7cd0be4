# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every topic and service of the instrument: name, type, quality of service, meaning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

from stickslip_ros.instrument.commands import COMMANDS, Command
from stickslip_ros.instrument.reports import trace_columns
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    JOINT_STATE,
    POINT_STAMPED,
    SET_BOOL,
    STRING,
    TRIGGER,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)
from stickslip_ros.parameters import NODE_NAME, SENSORS, Parameters, Sensor, spec_of

PREFIX = 'command/'
TRACE = 'trace'

COMMAND = Qos(depth=100)
SET_POINT = Qos(depth=1000)
"""Depth for the messages after a lost one: DDS may take up to 3 s to send it again."""
STREAM = Qos(depth=100)
"""Depth of our subscribers; smallest depth of a stream."""
KEPT_S = 1.0
"""Depth of a stream as simulated time, s, if that is more messages."""
LONG_COMMAND = Qos(depth=2)
"""For messages of megabytes, which take memory of the node while queued."""
LATCHED = Qos(depth=1, latched=True)
EVENTS = Qos(depth=100)
SELDOM = Qos(depth=10)

STREAMED = ('depth', 'reliability')
"""Policies that a user may override on a topic that may lose messages."""
QUEUED = ('depth',)
"""Policies that a user may override on a topic that may lose none."""
_SET_POINTS = (FLOAT64, POINT_STAMPED, WRENCH_STAMPED, JOINT_STATE)
"""Types of the commands that may be streamed."""


@dataclass(frozen=True)
class Topic:
    """A topic of the node."""

    name: str  # relative name, so that a namespace moves it; ``~/`` stands for the node
    type_name: str  # message type
    # quality of service of the node's end; for a stream, the smallest depth
    qos: Qos
    text: str  # meaning, unit and rate
    recorded: bool = True  # whether recordings hold it
    pace: str = ''  # parameter that gives the period, s, or the rate, Hz, of a stream
    # the topic exists if these parameters are all true or above 0
    switches: tuple[str, ...] = ()
    # numbers of a command, or of a table's row, with units
    numbers: tuple[str, ...] = ()
    is_table: bool = False  # whether a command has rows
    # policies of quality of service that a user may override
    overridable: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Short name inside the program: ``command/voltage``, ``voltage``, ``status``."""
        return self.name.lstrip('~/')

    @property
    def is_command(self) -> bool:
        """Whether the node subscribes to it; it publishes on the others."""
        return self.name.startswith(PREFIX)

    @property
    def request(self) -> str:
        """Name of the request that a command topic carries."""
        return self.name.removeprefix(PREFIX)

    def exists(self, parameters: Parameters) -> bool:
        """Return whether the topic is offered under these parameters."""
        return not self.switches or all(map(parameters.value, self.switches))

    def is_recorded(self, parameters: Parameters) -> bool:
        """Return whether recordings hold the topic under these parameters."""
        is_wanted = self.key != TRACE or parameters.record.trace
        return self.recorded and is_wanted and self.exists(parameters)

    def offered_qos(self, parameters: Parameters) -> Qos:
        """Return the quality of service under these parameters; a stream's depth is `KEPT_S`."""
        if not self.pace:
            return self.qos
        pace = float(parameters.value(self.pace))
        rate_hz = pace if spec_of(self.pace).unit == 'Hz' else 1.0 / pace
        return replace(self.qos, depth=max(self.qos.depth, math.ceil(KEPT_S * rate_hz)))

    def full_name(self, namespace: str = '/', node_name: str = NODE_NAME) -> str:
        relative = self.name.replace('~', node_name)
        if relative.startswith('/'):
            return relative
        return f'{namespace.rstrip("/")}/{relative}'


def _topic_of(command: Command) -> Topic:
    is_set_point = command.interface in _SET_POINTS
    short = SET_POINT if is_set_point else COMMAND
    return Topic(
        PREFIX + command.name,
        command.interface,
        LONG_COMMAND if command.is_table else short,
        command.text,
        numbers=command.numbers,
        is_table=command.is_table,
        overridable=STREAMED if is_set_point else (),
    )


READING_TYPES = {
    'm': (POINT_STAMPED, 'point.x'),
    'N': (WRENCH_STAMPED, 'wrench.force.x'),
    'V': (VECTOR3_STAMPED, 'vector.x'),
}
"""Message type and field of the readings in a unit; other fields are 0."""
FORMER_TYPES = {'voltage': FLOAT64}
"""Types of readings in recordings of versions up to 1.0: the voltage had no stamp."""


def _reading_topic(row: Sensor, name: str, text: str, *switches: str) -> Topic:
    type_name, field = READING_TYPES[row.unit]
    text += f'; needs {row.switch}' if row.switch else ''
    return Topic(
        name,
        type_name,
        STREAM,
        text.format(field=f'{field}, {row.unit}'),
        pace='sim.block',
        switches=(*switches, *filter(None, [row.switch])),
        overridable=STREAMED,
    )


# fmt: off
TOPICS = (
    *(_topic_of(command) for command in COMMANDS.values() if command.has_topic),
    Topic('command/grant', FLOAT64_ARRAY, COMMAND,
          '[until s, commands]: lockstep; run to this simulated time after this many commands',
          recorded=False, switches=('sim.lockstep',), numbers=('until s', 'commands')),
    *(_reading_topic(
        row, row.reading, row.text + ': {field}; once per sim.block; stamp is the sample time'
    ) for row in SENSORS),
    Topic('voltage', READING_TYPES['V'][0], STREAM,
          'voltage at the piezo: vector.x, V; once per trace.period; stamp is the sample time',
          pace='trace.period', overridable=STREAMED),
    Topic(TRACE, FLOAT64_ARRAY, STREAM,
          f'oscilloscope: rows of {", ".join(trace_columns(Parameters()))}, then of sensors that '
          'are enabled, at trace.sample_rate; one block per trace.period; t counts from '
          'time_origin_ns, in the label of the rows',
          pace='trace.period', overridable=STREAMED),
    *(_reading_topic(
        row, f'truth/{row.reading}',
        f'true {row.label}: {{field}}; with {row.reading}, of the same stamp',
        'sim.publish_truth',
    ) for row in SENSORS),
    Topic('joint_states', JOINT_STATE, STREAM,
          'sim.joint_name: position, m (interferometer), velocity, m/s (change of that position '
          'since the message before), effort, N (load cell); sim.joint_states_rate',
          pace='sim.joint_states_rate', switches=('sim.joint_states_rate',), overridable=STREAMED),
    Topic('~/status', UINT32, LATCHED, 'status bits, when they change'),
    Topic('~/event', STRING, EVENTS,
          'JSON: the end of a command and its result; stamp_ns of the end, position_m and force_n '
          'read there; sent_ns and tag if the sender gave them; step_m of steps',
          overridable=QUEUED),
    Topic('~/request', STRING, EVENTS,
          'JSON: a request that came by service, parameter or schedule, at the time of its effect',
          overridable=QUEUED),
    Topic('~/info', STRING, LATCHED,
          'JSON: parameters, units, versions, time origin; again when a live parameter other than '
          'a fault is set'),
    Topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray', SELDOM,
          'real-time factor, lateness, overruns, refusals, recorder, faults; in every state, at '
          '1 Hz of wall-clock time, and at once when a fault begins or ends',
          recorded=False),
    Topic('/clock', 'rosgraph_msgs/msg/Clock', SELDOM,
          'simulated time, once per sim.block', recorded=False, switches=('sim.publish_clock',),
          overridable=STREAMED),
)
# fmt: on
COMMAND_TOPICS = tuple(topic for topic in TOPICS if topic.is_command)
READINGS = tuple(topic for topic in TOPICS if not topic.is_command)


@dataclass(frozen=True)
class Service:
    """A service or action of the node; services of its lifecycle are not listed."""

    name: str
    type_name: str
    text: str


*_OF_DRIVE, _OF_FAULTS = (
    Service(f'~/{command.name}', command.interface, command.text)
    for command in COMMANDS.values()
    if command.has_service
)
SERVICES = (
    *_OF_DRIVE,
    Service('~/set_paused', SET_BOOL, 'hold simulated time, or let it run on'),
    Service('~/step_simulation', TRIGGER, 'while paused: advance by one sim.block'),
    _OF_FAULTS,
    Service(
        '~/save_checkpoint',
        TRIGGER,
        'write the present state to a file, for sim.checkpoint; the answer names it',
    ),
    Service('~/set_recording', SET_BOOL, 'start or end a recording; the answer names the file'),
)


TRAJECTORY_ACTION = Service(
    '~/follow_joint_trajectory',
    'control_msgs/action/FollowJointTrajectory',
    'closed loop along a trajectory of sim.joint_name; offered if control_msgs is installed',
)


@lru_cache(maxsize=8)
def recorded_channels(
    parameters: Parameters, namespace: str = '/', node_name: str = NODE_NAME
) -> Mapping[str, Channel]:
    """Return the channels of the topics recorded under these parameters, by key."""
    return {
        topic.key: Channel(
            topic.full_name(namespace, node_name), topic.type_name, topic.offered_qos(parameters)
        )
        for topic in TOPICS
        if topic.is_recorded(parameters)
    }
