"""Every topic and service of the instrument: name, type, quality of service, meaning."""

from dataclasses import dataclass

from stickslip_ros.recording.channels import Channel, Qos

NODE_NAME = 'stickslip_drive'

SUBSCRIBED, PUBLISHED = 'subscribed', 'published'
COMMAND = Qos(depth=100)
STREAM = Qos(depth=100)
LATCHED = Qos(depth=1, latched=True)
EVENTS = Qos(depth=100)


@dataclass(frozen=True)
class Topic:
    """
    A topic of the node.

    Attributes
    ----------
    key : str
        Short name inside the program; for a command, the name of its request.
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

    """

    key: str
    name: str
    type_name: str
    direction: str
    qos: Qos
    text: str
    recorded: bool = True

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
        'real-time factor, lateness, overruns, refusals, recorder; 1 Hz of wall-clock time',
        recorded=False,
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
    Service(
        '~/set_recording',
        'std_srvs/srv/SetBool',
        'start or end a recording; the answer names the file',
    ),
)


def recorded_channels(namespace: str = '/', node_name: str = NODE_NAME) -> dict[str, Channel]:
    """Return the channel of each recorded topic, by its key."""
    return {
        topic.key: Channel(topic.full_name(namespace, node_name), topic.type_name, topic.qos)
        for topic in TOPICS
        if topic.recorded
    }
