# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One drive, as a lifecycle node: `ros2 launch stickslip_ros drive.launch.py`."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

from stickslip_ros import stage_file

STAND = Path(__file__).parents[1] / 'config' / 'test_stand.yaml'
IN_FILE = 'empty: as in params_file'
ARGUMENTS = {
    'params_file': (str(STAND), 'file of parameters'),
    'stage': ('', 'another kind of stage, as clamp; a given params_file wins over it'),
    'namespace': ('', 'namespace of the drive'),
    'name': ('stickslip_drive', 'name of the node'),
    'autostart': ('', f'true or false: configure and activate it; {IN_FILE}'),
    'record': ('', f'true or false: record from the activation on; {IN_FILE}'),
    'seed': ('', f'sim.seed; {IN_FILE}'),
    'joint_name': ('', f'name of the joint; {IN_FILE}'),
    'joint_states': ('joint_states', 'topic on which the joint is reported'),
    'frame_prefix': ('', f'what stands before the names of frames; {IN_FILE}'),
    'respawn': ('false', 'true or false: start the drive again when its process has ended'),
    'log_level': ('info', 'debug, info, warn, error or fatal'),
}
"""Default and meaning of each argument."""
RESPAWN_DELAY_S = 2.0
FRAMES = {
    'frame_id.stage': 'stage_base',
    'frame_id.runner': 'runner',
    'frame_id.load_cell': 'load_cell',
}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the drive."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=start_drive)])


def start_drive(context: LaunchContext) -> list[LifecycleNode]:
    """
    Return the drive with what the arguments say; they outrank the file.

    A file that is not there is refused: launch_ros would start the drive without it.

    """
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    files = parameter_files(given['stage'], given['params_file'])
    parameters = {
        'autostart': given['autostart'],
        'record.on_start': given['record'],
        'sim.seed': given['seed'],
        'sim.joint_name': given['joint_name'],
    }
    if given['frame_prefix']:
        parameters |= {name: given['frame_prefix'] + frame for name, frame in FRAMES.items()}
    chosen = {name: value for name, value in parameters.items() if value}
    drive = LifecycleNode(
        package='stickslip_ros',
        executable='drive',
        namespace=given['namespace'],
        name=given['name'],
        parameters=[*files, chosen],
        remappings=[('joint_states', given['joint_states'])],
        ros_arguments=['--log-level', given['log_level']],
        respawn=given['respawn'] == 'true',
        respawn_delay=RESPAWN_DELAY_S,
        output='screen',
    )
    return [drive]


def parameter_files(stage: str, params_file: str) -> list[str]:
    """Return the files of a drive; later ones win. The default file is a stage as well."""
    if not Path(params_file).is_file():
        raise FileNotFoundError(f'params_file {params_file!r} is no file; check the path')
    if not stage:
        return [params_file]
    return [str(stage_file(stage)), *([params_file] if params_file != str(STAND) else [])]
