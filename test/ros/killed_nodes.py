"""
Starts recording nodes in child processes and kills each at a random moment.

Started by test_node_kill.py with a folder, a domain, the first number and how many; prints one
JSON line per kill. Importing and compiling is done once, before the children are forked.

"""

import json
import os
import random
import signal
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64MultiArray

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros.node import StickSlipDrive

FLUSH_PERIOD_S = 0.2
SAWTOOTH = (200.0, 500.0, 0.0)
EARLIEST_S, LATEST_S = 0.1, 2.5


def domain_of(domain: int, number: int) -> int:
    """Give the domain of a node: of its own, behind those of tests."""
    return 21 + (domain + 2 * number) % 40


def run_node(folder: str, domain: int, number: int, pipe: int) -> None:
    """
    Be the node, recording in real time from its activation on; never return.

    Every second one moves. Its command comes from the same process: a publisher of another one
    may have heard of this drive for seconds before the drive hears of it, and is not heard then.

    """
    # What the system was handed survives a kill; a busy disk would only hold the writer up.
    os.fsync = lambda fd: None
    rclpy.init(args=['--ros-args', '-r', f'__ns:=/n{number}'], domain_id=domain_of(domain, number))
    values = {
        'record.directory': folder,
        'record.name': f'run{number}',
        'record.on_start': True,
        'record.flush_period': FLUSH_PERIOD_S,
        'sim.seed': number,
    }
    overrides = [Parameter(name, value=value) for name, value in values.items()]
    node = StickSlipDrive(parameter_overrides=overrides)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    _commander = command_sawtooth() if number % 2 else None
    position = node._topics._offered['position']
    while not position.get_subscription_count():
        executor.spin_once(timeout_sec=0.02)
    os.write(pipe, b'.')
    executor.spin()


def command_sawtooth() -> Node:
    """Command a sawtooth over the topic; the node is to be kept."""
    commander = Node('commander')
    sawtooth = commander.create_publisher(Float64MultiArray, 'command/sawtooth', 10)
    while not sawtooth.get_subscription_count():
        time.sleep(0.01)
    sawtooth.publish(Float64MultiArray(data=SAWTOOTH))
    return commander


def kill_one(folder: str, domain: int, number: int, moment_s: float) -> dict:
    """Start a node, kill it so long after somebody listens."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        run_node(folder, domain, number, writing)
    os.close(writing)
    os.read(reading, 1)
    time.sleep(moment_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    os.close(reading)
    return {'number': number, 'killed': os.WIFSIGNALED(status)}


def main(folder: str, domain: str, first: str, count: str) -> None:
    """Kill as many nodes as asked for."""
    bench = Bench(Parameters())
    bench.update(bench.parameters.block_ns)
    moments = random.Random(int(first))
    for number in range(int(first), int(first) + int(count)):
        moment_s = moments.uniform(EARLIEST_S, LATEST_S)
        sys.stdout.write(json.dumps(kill_one(folder, int(domain), number, moment_s)) + '\n')


if __name__ == '__main__':
    main(*sys.argv[1:])
