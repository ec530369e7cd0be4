"""What a node says of itself in the log: one line at its start, one when the drive is active."""

import os
from pathlib import Path

import rclpy
from rclpy.node import Node

import stickslip_ros
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.parameters import Parameters, format_value
from stickslip_ros.ros.environment import DISCOVERY_VARIABLE

KILO = 1e3


def at_start(node: Node) -> str:
    """Return who a node is and where it can be found."""
    version = f'stickslip_ros {stickslip_ros.__version__}, ROS 2 {distribution()}'
    found = os.environ.get(DISCOVERY_VARIABLE) or 'SUBNET'
    domain = node.context.get_domain_id()
    return f'{version}: {node.get_fully_qualified_name()}, domain {domain}, discovery {found}'


def distribution() -> str:
    """Return the distribution of ROS 2: that of the environment, or that of the wheels."""
    wheels = Path(rclpy.__file__).parents[1].glob('ros_*_rclpy-*.dist-info')
    named = os.environ.get('ROS_DISTRO') or next((each.name for each in wheels), '')
    return named.removeprefix('ros_').partition('_')[0] or 'of unknown name'


def when_active(node: Node, parameters: Parameters, bench: Bench) -> str:
    """Return how the drive runs and a command that it takes as it is."""
    rate = f'{1.0 / (KILO * parameters.sim.block):g} kHz blocks'
    preload = f'preload {bench.state.preload_n:g} N'
    amplifier = parameters.amplifier
    start = f'active: {rate}, {_pace(parameters)}, {preload}'
    if parameters.sim.lockstep:
        return f'{start}; waits for grants on {node.resolve_topic_name("command/grant")}'
    middle_v = format_value(0.5 * (amplifier.voltage_min + amplifier.voltage_max))
    topic = node.resolve_topic_name('command/voltage')
    command = f'ros2 topic pub --once {topic} std_msgs/msg/Float64 "{{data: {middle_v}}}"'
    return f'{start}; try: {command}'


def _pace(parameters: Parameters) -> str:
    factor = parameters.sim.real_time_factor
    if parameters.sim.lockstep:
        return 'in lockstep'
    if factor == 0.0:
        return 'as fast as possible'
    return 'in real time' if factor == 1.0 else f'{factor:g} times real time'
