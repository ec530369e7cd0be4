"""
The executable ``position_controller``: closes the loop over topics only.

It reads ``position`` and sends ``command/steps`` and ``command/voltage``; the drive's own closed
loop has no part in it. A controller to start from.

"""

import math
import sys
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import PointStamped
from std_msgs.msg import Bool, Float64

from stickslip_ros.errors import quoted
from stickslip_ros.instrument.position_loop import LoopSettings, RemoteLoop, Steps
from stickslip_ros.interface.topics import COMMAND, LATCHED
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.process.signals import run
from stickslip_ros.ros.client import Commands, DriveClient, LockstepClient, stamp_ns
from stickslip_ros.ros.executable import describe_node, guard_services, run_node
from stickslip_ros.ros.interface import to_profile
from stickslip_ros.ros.parameter_bridge import ReloadableNode, declare_controller_parameters

NODE_NAME = 'position_controller'


class PositionController(ReloadableNode):
    """
    Bring the runner to the last ``~/target`` and hold it there.

    The node publishes ``~/in_position`` (std_msgs/Bool, latched) and ``~/error``
    (std_msgs/Float64, m). Keyword arguments are those of ``rclpy.node.Node``; a parameter that is
    not allowed is refused.

    """

    def __init__(self, node_name: str = NODE_NAME, **node_arguments: Any) -> None:
        super().__init__(
            node_name, automatically_declare_parameters_from_overrides=True, **node_arguments
        )
        guard_services(self)
        parameters = declare_controller_parameters(self)
        self.get_logger().info(describe_node(self))
        self.loop = RemoteLoop(
            LoopSettings(
                gain_m_per_v=parameters.gain,
                voltage_min_v=parameters.voltage_min,
                voltage_max_v=parameters.voltage_max,
                step_v=parameters.step_amplitude,
                share=parameters.share,
                deadband_m=parameters.tolerance,
            ),
            parameters.step_frequency,
            parameters.response_time,
        )
        self._target_frame = parameters.target_frame
        command, latched = to_profile(COMMAND), to_profile(LATCHED)
        self._error = self.create_publisher(Float64, '~/error', command)
        self._in_position = self.create_publisher(Bool, '~/in_position', latched)
        self._was_in_position: bool | None = None
        self.create_subscription(PointStamped, '~/target', self._on_target, command)
        self._drive: DriveClient
        if parameters.lockstep:
            self._drive = LockstepClient(self, parameters.block, self._answer)
        else:
            self._drive = DriveClient(self, commands=('steps', 'voltage'))
            self._drive.subscribe('position', self._on_position)

    def _on_target(self, message: PointStamped) -> None:
        frame_id = message.header.frame_id
        if frame_id not in ('', self._target_frame):
            self.get_logger().warning(
                f'target in frame {quoted(frame_id)}, not {self._target_frame}; transform it, '
                'leave the frame empty, or change target_frame'
            )
        elif math.isfinite(message.point.x):
            self.loop.aim(message.point.x)
        else:
            self.get_logger().warning(
                f'target {message.point.x} m is not a finite number; send the position in m'
            )

    def _on_position(self, message: PointStamped) -> None:
        for name, value in self._decide(stamp_ns(message), message.point.x):
            self._drive.command(name, value)

    def _answer(self, time_s: float, position_m: float) -> Commands:
        """Return what to send in lockstep, before the next block is granted."""
        return self._decide(to_nanoseconds(time_s), position_m)

    def _decide(self, time_ns: int, position_m: float) -> list[tuple[str, Any]]:
        action = self.loop.update(time_ns, position_m)
        if math.isfinite(self.loop.error_m):
            self._error.publish(Float64(data=self.loop.error_m))
        if self.loop.in_position != self._was_in_position:
            self._was_in_position = self.loop.in_position
            self._in_position.publish(Bool(data=self.loop.in_position))
        if isinstance(action, Steps):
            return [('steps', action.count)]
        return [] if action is None else [('voltage', action.voltage_v)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the controller until somebody asks for its end, see `run_node`; return its status."""
    return run_node(NODE_NAME, PositionController, arguments)


if __name__ == '__main__':
    sys.exit(run(NODE_NAME, main, is_node=True))
