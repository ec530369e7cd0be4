"""Two drives, in /left and /right: `ros2 launch stickslip_ros two_drives.launch.py`."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription

DRIVE = Path(__file__).with_name('drive.launch.py')
SEEDS = {'left': '1', 'right': '2'}


def generate_launch_description() -> LaunchDescription:
    """Return both drives; the other arguments of drive.launch.py hold for both."""
    return LaunchDescription(
        [
            IncludeLaunchDescription(
                str(DRIVE),
                launch_arguments={
                    'namespace': side,
                    'seed': seed,
                    'frame_prefix': f'{side}/',
                }.items(),
            )
            for side, seed in SEEDS.items()
        ]
    )
