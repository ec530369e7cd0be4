# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive under ros2_control: `ros2 launch stickslip_ros ros2_control.launch.py`."""

import runpy
from pathlib import Path

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from stickslip_ros import load_yaml, robot_description

DRIVE = Path(__file__).with_name('drive.launch.py')
CONFIG = Path(__file__).parents[1] / 'config'
OWN = {
    'namespace': '',
    'joint_name': 'runner_joint',
    'joint_states': '/stage/joint_states',
    'frame_prefix': '',
}
"""Arguments of drive.launch.py as ros2_control.urdf and .yaml name them; others can be given."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, ros2_control, and then the drive: without the rest none is left."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in runpy.run_path(str(DRIVE))['ARGUMENTS'].items()
        if name not in OWN
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start_control)])


def start_control(context: LaunchContext) -> list[Action]:
    """Return who publishes the description, the controller manager, what loads, and the drive."""
    given = (LaunchConfiguration(name).perform(context) for name in ('stage', 'params_file'))
    stand = load_yaml(*runpy.run_path(str(DRIVE))['parameter_files'](*given))
    bodies = robot_description(stand.updated({'sim.joint_name': OWN['joint_name']}))
    hardware = (CONFIG / 'ros2_control.urdf').read_text(encoding='utf-8')
    controllers = str(CONFIG / 'ros2_control.yaml')  # to both: since Jazzy, the spawner needs it
    described = bodies.replace('</robot>', f'{hardware}</robot>')
    return [
        Node(
            package='robot_state_publisher',
            executable='robot_state_publisher',
            parameters=[{'robot_description': ParameterValue(described, value_type=str)}],
            output='screen',
        ),
        Node(
            package='controller_manager',
            executable='ros2_control_node',
            parameters=[controllers],
            output='screen',
        ),
        Node(
            package='controller_manager',
            executable='spawner',
            arguments=['joint_state_broadcaster', 'stage_trajectory', '--param-file', controllers],
            output='screen',
        ),
        IncludeLaunchDescription(str(DRIVE), launch_arguments=OWN.items()),
    ]
