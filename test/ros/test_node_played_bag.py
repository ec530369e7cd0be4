"""A bag of command topics, played into the node as `ros2 bag play` does: bytes as they are."""

from collections.abc import Callable
from pathlib import Path

from rosbags.highlevel import AnyReader

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.feed import Feed
from stickslip_ros.recording.run_file import run_path
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.recording.topics import COMMANDS
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile

BLOCK_NS = 1_000_000
PLAN = (
    Request('steps', (3.0,)),
    Request('voltage', (150.0,)),
    Request('sawtooth', (200.0, 1000.0, 2.0)),
    Request('waveform', (0.0, 0.0, 0.002, 30.0)),
    Request('load', (0.05, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Request('preload', (0.45,)),
    Request('jog', (0.0,)),
    Request('position', (0.0, 0.0, 0.0)),
)
EVERY_BLOCKS = 60


def record_bag(folder: Path) -> Path:
    """Record the plan, one request after the other, as a bag directory."""
    stand = Parameters().updated({'record.format': 'bag', 'record.directory': str(folder)})
    bench, feed = Bench(stand), Feed(stand)
    with RunWriter(run_path(stand), stand, wait=True) as writer:
        writer.begin(0, bench.status)
        for block in range(EVERY_BLOCKS * len(PLAN)):
            due = [PLAN[block // EVERY_BLOCKS]] if block % EVERY_BLOCKS == 0 else []
            writer.write_requests(due, bench.time_ns)
            for packed in feed.pack(bench.update(bench.time_ns + BLOCK_NS, due)):
                writer.write(packed)
    return writer.recorder.path


def test_a_played_bag_of_commands_is_carried_out(start_drive: Callable, tmp_path: Path):
    bag = record_bag(tmp_path)
    stand = start_drive({'sim.real_time_factor': 20.0, 'load_cell.contact': 'absent'})
    operator = stand.operator
    topics = {f'/{topic.name}': topic for topic in COMMANDS}
    publishers = {
        name: operator.node.create_publisher(
            MESSAGE_TYPES[topic.type_name], name, to_profile(topic.qos)
        )
        for name, topic in topics.items()
    }
    operator.spin_until(
        lambda: all(
            each.get_subscription_count()
            for name, each in publishers.items()
            if name != '/command/grant'
        ),
        'the drive',
    )
    played = 0
    with AnyReader([bag]) as reader:
        chosen = [each for each in reader.connections if each.topic in topics]
        for connection, _, data in reader.messages(chosen):
            publishers[connection.topic].publish(bytes(data))
            played += 1
            operator.spin_until(lambda n=played: len(operator.events) >= n, 'an event', 30.0)
    assert played == len(PLAN)
    results = {event['command']: event['result'] for event in operator.events}
    assert results == {request.name: 'DONE' for request in PLAN}
