# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive, its frames and bodies, and RViz: `ros2 launch stickslip_ros view.launch.py`."""

import runpy
import shutil
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from stickslip_ros import load_yaml, robot_description

DRIVE = Path(__file__).with_name('drive.launch.py')
RVIZ = Path(__file__).parents[1] / 'config' / 'stand.rviz'


def generate_launch_description() -> LaunchDescription:
    """
    Return what publishes the frames of the drive, RViz where there is one, and the drive.

    The drive comes last: what refuses to start leaves no drive behind.

    """
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in runpy.run_path(str(DRIVE))['ARGUMENTS'].items()
    ]
    view = OpaqueFunction(function=start_view)
    return LaunchDescription([*arguments, view, IncludeLaunchDescription(str(DRIVE))])


def start_view(context: LaunchContext) -> list[Node]:
    """Return robot_state_publisher with the bodies of the stand in the file of parameters."""
    drive = runpy.run_path(str(DRIVE))
    stage, file, prefix, namespace = (
        LaunchConfiguration(name).perform(context)
        for name in ('stage', 'params_file', 'frame_prefix', 'namespace')
    )
    frames = drive['FRAMES'] if prefix else {}
    stand = load_yaml(*drive['parameter_files'](stage, file)).updated(
        {name: prefix + frame for name, frame in frames.items()}
    )
    bodies = {'robot_description': ParameterValue(robot_description(stand), value_type=str)}
    publisher = Node(
        package='robot_state_publisher',
        executable='robot_state_publisher',
        namespace=namespace,
        parameters=[bodies],
        output='screen',
    )
    if not shutil.which('rviz2'):
        return [publisher]
    fixed = ['-d', str(RVIZ), '-f', stand.frame_id.stage]
    return [
        publisher,
        Node(package='rviz2', executable='rviz2', namespace=namespace, arguments=fixed),
    ]
