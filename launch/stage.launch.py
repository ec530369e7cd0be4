# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Drives x, y and z on each other, in /stage: `ros2 launch stickslip_ros stage.launch.py`."""

import runpy
from pathlib import Path

from launch import Action, LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from stickslip_ros import load_yaml, robot_description

DRIVE = Path(__file__).with_name('drive.launch.py')
OWN = {
    axis: {'seed': seed, 'joint_name': f'{axis}_joint', 'frame_prefix': f'{axis}/', 'stage': ''}
    for axis, seed in zip('xyz', '123', strict=True)
}
"""Arguments of drive.launch.py that differ; the others can be given, and hold for all."""
NAMESPACE = 'stage', 'namespace of the stage; those of its drives are x, y and z in it'
AXES = {axis: ('', f'kind of stage of {axis}, as clamp; empty: as in params_file') for axis in OWN}
Z_LOAD = '-0.05', 'force on the runner of z, N, once it is active: the weight of what stands on it'
START_TIMEOUT_S = '120'
"""A first start compiles the kernels."""


def generate_launch_description() -> LaunchDescription:
    """
    Return what publishes the frames of the stage, its drives, and the load of the last.

    The publisher comes first: where it is missing, no drive is left behind.

    """
    shown = {
        **runpy.run_path(str(DRIVE))['ARGUMENTS'],
        **AXES,
        'namespace': NAMESPACE,
        'z_load': Z_LOAD,
    }
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in shown.items()
        if name not in {*OWN['x'], 'joint_states', 'name'}
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start_stage)])


def start_stage(context: LaunchContext) -> list[Action]:
    """Return robot_state_publisher with all bodies, the three drives, and what loads z."""
    file, namespace, load_n = (
        LaunchConfiguration(each).perform(context)
        for each in ('params_file', 'namespace', 'z_load')
    )
    drive = runpy.run_path(str(DRIVE))
    own_of = {
        axis: {**own, 'stage': LaunchConfiguration(axis).perform(context)}
        for axis, own in OWN.items()
    }
    stands = [
        load_yaml(*drive['parameter_files'](own['stage'], file)).updated(
            {
                'sim.joint_name': own['joint_name'],
                **{key: own['frame_prefix'] + frame for key, frame in drive['FRAMES'].items()},
            }
        )
        for own in own_of.values()
    ]
    bodies = {'robot_description': ParameterValue(robot_description(*stands), value_type=str)}
    publisher = Node(
        package='robot_state_publisher',
        executable='robot_state_publisher',
        namespace=namespace,
        parameters=[bodies],
        output='screen',
    )
    drives = [
        IncludeLaunchDescription(
            str(DRIVE),
            launch_arguments={
                **own,
                'namespace': f'{namespace}/{axis}',
                'joint_states': f'/{namespace}/joint_states',
            }.items(),
        )
        for axis, own in own_of.items()
    ]
    z_drive = f'/{namespace}/z'
    load = ExecuteProcess(
        cmd=[
            *('ros2', 'run', 'stickslip_ros', 'stickslip', 'command', 'load', f'force.x={load_n}'),
            *('--namespace', z_drive, '--timeout', START_TIMEOUT_S),
        ],
        output='screen',
    )
    return [publisher, *drives, load]
