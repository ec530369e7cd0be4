# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive under nav2's manager: `ros2 launch stickslip_ros nav2_lifecycle.launch.py`."""

import runpy
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

DRIVE = Path(__file__).with_name('drive.launch.py')
OWN = {'autostart': 'false'}
"""Arguments of drive.launch.py that are fixed; the others can be given."""


def generate_launch_description() -> LaunchDescription:
    """
    Return nav2's lifecycle manager, and the drive, which it configures and activates.

    The manager comes first: where it is missing, no drive is left behind. It heeds no bond, as the
    drive keeps none.

    """
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in runpy.run_path(str(DRIVE))['ARGUMENTS'].items()
        if name not in OWN
    ]
    manager = Node(
        package='nav2_lifecycle_manager',
        executable='lifecycle_manager',
        name='lifecycle_manager',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            {
                'autostart': True,
                'bond_timeout': 0.0,
                'node_names': [LaunchConfiguration('name')],
            }
        ],
        output='screen',
    )
    return LaunchDescription([*arguments, manager, OpaqueFunction(function=include_drive)])


def include_drive(_: LaunchContext) -> list[IncludeLaunchDescription]:
    """Return drive.launch.py."""
    return [IncludeLaunchDescription(str(DRIVE), launch_arguments=OWN.items())]
