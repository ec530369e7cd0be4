"""A drive and a position controller: `ros2 launch stickslip_ros closed_loop.launch.py`."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

REALISTIC = Path(__file__).parents[1] / 'config' / 'realistic.yaml'
DRIVE = Path(__file__).with_name('drive.launch.py')


def generate_launch_description() -> LaunchDescription:
    """Return both nodes; the arguments are those of drive.launch.py."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'params_file', default_value=str(REALISTIC), description='parameters of both nodes'
            ),
            IncludeLaunchDescription(str(DRIVE)),
            OpaqueFunction(function=start_controller),
        ]
    )


def start_controller(context: LaunchContext) -> list[Node]:
    """Return the controller, which reads the file of the drive."""
    prefix = LaunchConfiguration('frame_prefix').perform(context)
    controller = Node(
        package='stickslip_ros',
        executable='position_controller',
        namespace=LaunchConfiguration('namespace'),
        parameters=[
            LaunchConfiguration('params_file'),
            {'target_frame': f'{prefix}stage_base'} if prefix else {},
        ],
        ros_arguments=['--log-level', LaunchConfiguration('log_level')],
        output='screen',
    )
    return [controller]
