"""Every topic and service of the instrument: name, type, quality of service, meaning."""

from dataclasses import dataclass

from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.channels import Channel, Qos

NODE_NAME = 'stickslip_drive'

SUBSCRIBED, PUBLISHED = 'subscribed', 'published'
COMMAND = Qos(depth=100)
STREAM = Qos(depth=100)
LONG_COMMAND = Qos(depth=2)
"""Of messages of megabytes: what waits in a queue of the network is memory of the node."""
WAVEFORM_ROWS_MAX = 100_000
"""Rows that a message may have; a measured voltage that is replayed from a file may be longer."""
LATCHED = Qos(depth=1, latched=True)
EVENTS = Qos(depth=100)


@dataclass(frozen=True)
class Topic:
    """
    A topic of the node.

    Attributes
    ----------
    key : str
        Short name inside the program.
    name : str
        Relative name, so that a namespace moves it; ``~/`` stands for the node.
    type_name : str
        Message type.
    direction : str
        SUBSCRIBED or PUBLISHED.
    qos : Qos
        Quality of service that the node offers or asks for.
    text : str
        Meaning, unit and rate.
    recorded : bool
        Whether recordings hold it.
    switch : str
        Parameter that must be true for the topic to exist; empty for one that always does.

    """

    key: str
    name: str
    type_name: str
    direction: str
    qos: Qos
    text: str
    recorded: bool = True
    switch: str = ''

    @property
    def request(self) -> str:
        """Name of the request that a command topic carries."""
        return self.name.removeprefix('command/')

    def exists(self, parameters: Parameters) -> bool:
        """Tell whether the topic is offered under these parameters."""
        return not self.switch or bool(parameters.flat()[self.switch])

    def full_name(self, namespace: str = '/', node_name: str = NODE_NAME) -> str:
        """Return the absolute name in a namespace."""
        relative = self.name.replace('~', node_name)
        if relative.startswith('/'):
            return relative
        return f'{namespace.rstrip("/")}/{relative}'


TOPICS = (
    Topic(
        'voltage',
        'command/voltage',
        'std_msgs/msg/Float64',
        SUBSCRIBED,
        COMMAND,
        'direct piezo voltage, V (scan mode); the amplifier slews to it',
    ),
    Topic(
        'sawtooth',
        'command/sawtooth',
        'std_msgs/msg/Float64MultiArray',
        SUBSCRIBED,
        COMMAND,
        '[amplitude V, frequency Hz (its sign is the direction), steps (0: until stopped)]',
    ),
    Topic(
        'steps',
        'command/steps',
        'std_msgs/msg/Int32',
        SUBSCRIBED,
        COMMAND,
        'signed number of steps at step.amplitude and step.frequency; 0 does nothing',
    ),
    Topic(
        'jog',
        'command/jog',
        'std_msgs/msg/Float64',
        SUBSCRIBED,
        COMMAND,
        'signed steps per second; stops when jog.timeout passes without a new one; 0 stops',
    ),
    Topic(
        'waveform',
        'command/waveform',
        'std_msgs/msg/Float64MultiArray',
        SUBSCRIBED,
        LONG_COMMAND,
        'rows of time s, voltage V, played once; times rise from 0, straight lines in between; '
        f'at most {WAVEFORM_ROWS_MAX} rows',
    ),
    Topic(
        'target',
        'command/position',
        'geometry_msgs/msg/PointStamped',
        SUBSCRIBED,
        COMMAND,
        'closed loop: point.x, m; coarse steps, then fine scan, then hold; the rest must be 0',
    ),
    Topic(
        'load',
        'command/load',
        'geometry_msgs/msg/WrenchStamped',
        SUBSCRIBED,
        COMMAND,
        'external force on the runner, N: force.x, positive along +x; the rest must be 0',
    ),
    Topic(
        'preload',
        'command/preload',
        'std_msgs/msg/Float64',
        SUBSCRIBED,
        COMMAND,
        'preload F_p, N; the drive goes there at stand.preload_rate',
    ),
    Topic(
        'grant',
        'command/grant',
        'std_msgs/msg/Float64MultiArray',
        SUBSCRIBED,
        COMMAND,
        '[until s, commands]: lockstep; run to this simulated time once so many commands came',
        recorded=False,
        switch='sim.lockstep',
    ),
    Topic(
        'position',
        'position',
        'geometry_msgs/msg/PointStamped',
        PUBLISHED,
        STREAM,
        'interferometer: point.x, m; once per sim.block; stamp is the simulated sample time',
    ),
    Topic(
        'force',
        'force',
        'geometry_msgs/msg/WrenchStamped',
        PUBLISHED,
        STREAM,
        'load cell: wrench.force.x, N, positive when the runner presses; once per sim.block',
    ),
    Topic(
        'piezo',
        'voltage',
        'std_msgs/msg/Float64',
        PUBLISHED,
        STREAM,
        'voltage at the piezo, V; once per trace.period',
    ),
    Topic(
        'trace',
        'trace',
        'std_msgs/msg/Float64MultiArray',
        PUBLISHED,
        STREAM,
        'oscilloscope: rows of t[s], voltage[V], foot[m], position[m], force[N] at '
        'trace.sample_rate; one block per trace.period',
    ),
    Topic(
        'truth_position',
        'truth/position',
        'geometry_msgs/msg/PointStamped',
        PUBLISHED,
        STREAM,
        'true position of the runner: point.x, m; with position, of the same stamp',
        switch='sim.publish_truth',
    ),
    Topic(
        'truth_force',
        'truth/force',
        'geometry_msgs/msg/WrenchStamped',
        PUBLISHED,
        STREAM,
        'true force on the load cell: wrench.force.x, N; with force, of the same stamp',
        switch='sim.publish_truth',
    ),
    Topic(
        'status',
        '~/status',
        'std_msgs/msg/UInt32',
        PUBLISHED,
        LATCHED,
        'status bits, when they change',
    ),
    Topic(
        'event',
        '~/event',
        'std_msgs/msg/String',
        PUBLISHED,
        EVENTS,
        "JSON: a command's end and its result",
    ),
    Topic(
        'request',
        '~/request',
        'std_msgs/msg/String',
        PUBLISHED,
        EVENTS,
        'JSON: what came by service, parameter or schedule, when it took effect',
    ),
    Topic(
        'info',
        '~/info',
        'std_msgs/msg/String',
        PUBLISHED,
        LATCHED,
        'JSON: parameters, units, seed, step, versions',
    ),
    Topic(
        'diagnostics',
        '/diagnostics',
        'diagnostic_msgs/msg/DiagnosticArray',
        PUBLISHED,
        Qos(depth=10),
        'real-time factor, lateness, overruns, refusals, recorder, faults; 1 Hz of wall-clock '
        'time, and at once when a fault comes or goes',
        recorded=False,
    ),
    Topic(
        'clock',
        '/clock',
        'rosgraph_msgs/msg/Clock',
        PUBLISHED,
        Qos(depth=10),
        'simulated time, once per sim.block',
        recorded=False,
        switch='sim.publish_clock',
    ),
)

COMMANDS = tuple(topic for topic in TOPICS if topic.direction == SUBSCRIBED)
READINGS = tuple(topic for topic in TOPICS if topic.direction == PUBLISHED)


@dataclass(frozen=True)
class Service:
    """A service of the node beside those of its lifecycle."""

    name: str
    type_name: str
    text: str


SERVICES = (
    Service('~/stop', 'std_srvs/srv/Trigger', 'end the running move and hold the present voltage'),
    Service(
        '~/reset',
        'std_srvs/srv/Trigger',
        'relaxed contacts, runner at 0, no load, voltage as at the start; time runs on',
    ),
    Service('~/zero_position', 'std_srvs/srv/Trigger', 'make the present position reading 0'),
    Service('~/tare_force', 'std_srvs/srv/Trigger', 'make the present force reading 0'),
    Service(
        '~/enable_amplifier',
        'std_srvs/srv/SetBool',
        'amplifier on or off; off, the piezo goes to the lowest voltage and moves are refused',
    ),
    Service('~/set_paused', 'std_srvs/srv/SetBool', 'hold simulated time, or let it run on'),
    Service('~/step_simulation', 'std_srvs/srv/Trigger', 'while paused: advance by one sim.block'),
    Service('~/clear_faults', 'std_srvs/srv/Trigger', 'end every fault, by parameter or schedule'),
    Service(
        '~/set_recording',
        'std_srvs/srv/SetBool',
        'start or end a recording; the answer names the file',
    ),
)


def recorded_channels(
    parameters: Parameters, namespace: str = '/', node_name: str = NODE_NAME
) -> dict[str, Channel]:
    """Return the channel of each topic that is recorded under these parameters, by its key."""
    return {
        topic.key: Channel(topic.full_name(namespace, node_name), topic.type_name, topic.qos)
        for topic in TOPICS
        if topic.recorded and topic.exists(parameters)
    }
