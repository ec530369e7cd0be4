# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that run or watch nodes, or print their interface."""

from stickslip_ros.lab.cli.options import (
    MAP,
    NAMESPACE,
    NODE,
    PARAMETERS,
    READING,
    WINDOW,
    file,
    flag_option,
    folder,
    option,
    options_of,
    verb,
)

ROS = (
    verb(
        'drive',
        'run the ROS 2 node (needs rclpy)',
        'Run the node until Ctrl-C. Arguments after --ros-args go to ROS: '
        'stickslip drive --ros-args -r __ns:=/left',
        *PARAMETERS,
        reports_compilation=True,
        takes_ros_arguments=True,
    ),
    verb(
        'twin',
        'run a fitted stand beside a rig (needs rclpy)',
        'Run a fitted stand next to a rig, driven by the same voltage, until Ctrl-C. It listens '
        'to the topics of --map, or to the trace of a drive. Settings are parameters: stickslip '
        'twin --params fitted.yaml --ros-args -p twin.period:=20.0',
        *PARAMETERS,
        *options_of(READING, 'headers'),
        module='drive',
        takes_ros_arguments=True,
    ),
    verb(
        'demo',
        'node and operator over topics: record, draw (needs rclpy)',
        'Start the node in a separate process and command it over topics: some steps of the '
        'free runner, a direct-voltage ramp, steps against the load cell, also under an external '
        'load. The demo sets load_cell.contact and load_cell.gap. Writes DIR/demo.mcap and '
        'DIR/demo.png.',
        folder(),
        *PARAMETERS,
    ),
    verb(
        'command',
        'send a command to a drive, wait for its end (needs rclpy)',
        'Send a command (docs/reference/interface.md) to a running drive, and wait for its end: '
        'stickslip command sawtooth 300V 500Hz 200, or by name: sawtooth amplitude=300V '
        'frequency=500Hz steps=200. A refusal prints the reason of the drive.',
        option('name', 'voltage, sawtooth, steps, position, load, stop, ...', metavar='NAME'),
        option('numbers', 'its numbers, in order or by name', metavar='NUMBER', nargs='*'),
        option('--cycles', 'cycles of a waveform; 0 repeats it', int, default=1),
        NAMESPACE,
        NODE,
        option('--timeout', 'longest wait for a drive', unit='s', default=10.0),
        flag_option('--no-wait', 'do not wait for its end'),
    ),
    verb(
        'panel',
        'the front panel of a drive or a recording, in a browser',
        'Serve the front panel of a running drive, or of a recording, to a browser on this host, '
        'until Ctrl-C.',
        file('recording to play (default: attach to a drive)', nargs='?'),
        *MAP,
        WINDOW,
        NAMESPACE,
        NODE,
        option('--port', 'TCP port on 127.0.0.1; 0 takes a free one', int, default=8040),
    ),
    verb(
        'parameters',
        'print all parameters as a ROS parameter file',
        'Print a ROS parameter file with every parameter, its unit and its source.',
        *PARAMETERS,
        module='reference',
    ),
    verb(
        'interface',
        'print topics, services, events and parameters as Markdown',
        'Print the ROS interface as Markdown.',
        module='reference',
    ),
)
