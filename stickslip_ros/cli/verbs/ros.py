"""Verbs that run nodes, watch them, or print what they declare."""

from stickslip_ros.cli.options import MAP, MAP_FILE, PARAMETERS, file, folder, option, verb

ROS = (
    verb(
        'drive',
        'run the ROS 2 node (needs rclpy)',
        'Run the node until Ctrl-C. Further arguments go to ROS, '
        'as in: stickslip drive --ros-args -r __ns:=/left',
        *PARAMETERS,
        reports_compilation=True,
        takes_ros_arguments=True,
    ),
    verb(
        'demo',
        'node and operator over topics: record, draw (needs rclpy)',
        'Start the node as a process of its own; from here, over topics: some steps of the free '
        'runner, a direct-voltage ramp, steps against the load cell, under an external load too. '
        'The demo decides on load_cell.contact and load_cell.gap. Writes DIR/demo.mcap and '
        'DIR/demo.png.',
        folder(),
        *PARAMETERS,
    ),
    verb(
        'panel',
        'the front panel of a drive or a recording, in a browser',
        'Serve the front panel of a running drive, or of a recording, to a browser on this host, '
        'until Ctrl-C.',
        file('a recording to play; none: attach to a drive', nargs='?'),
        MAP,
        MAP_FILE,
        option('--namespace', 'of the drive, as /left', metavar='NAME', default=''),
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
