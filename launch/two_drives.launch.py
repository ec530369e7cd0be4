# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two drives, in /left and /right: `ros2 launch stickslip_ros two_drives.launch.py`."""

import runpy
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction

DRIVE = Path(__file__).with_name('drive.launch.py')
OWN = {
    side: {'namespace': side, 'seed': seed, 'frame_prefix': f'{side}/'}
    for side, seed in (('left', '1'), ('right', '2'))
}
"""Arguments of drive.launch.py that differ; the others can be given, and hold for both."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and both drives, which `--show-args` does not look into."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in runpy.run_path(str(DRIVE))['ARGUMENTS'].items()
        if name not in OWN['left']
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=include_drives)])


def include_drives(_: LaunchContext) -> list[IncludeLaunchDescription]:
    """Return drive.launch.py for either side."""
    return [
        IncludeLaunchDescription(str(DRIVE), launch_arguments=own.items()) for own in OWN.values()
    ]
