# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A twin beside a rig, as a lifecycle node: `ros2 launch stickslip_ros twin.launch.py`."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

STAND = Path(__file__).parents[1] / 'config' / 'test_stand.yaml'
ARGUMENTS = {
    'params_file': (str(STAND), 'file of parameters: the stand as it was fitted'),
    'namespace': ('', 'namespace of the twin'),
    'map': ('', 'twin.map: which topic of the rig is what; empty: the trace of a drive'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
}
"""Default and meaning of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the twin."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start_twin)])


def start_twin(context: LaunchContext) -> list[LifecycleNode]:
    """Return the twin; a file that is not there is refused."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    if not Path(given['params_file']).is_file():
        raise FileNotFoundError(f'params_file {given["params_file"]!r} is no file; check the path')
    twin = LifecycleNode(
        package='stickslip_ros',
        executable='twin',
        namespace=given['namespace'],
        name='stickslip_twin',
        parameters=[given['params_file'], {'twin.map': given['map']}],
        ros_arguments=['--log-level', given['log_level']],
        output='screen',
    )
    return [twin]
