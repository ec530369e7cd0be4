"""
The executable ``position_controller``: closes the loop over topics only.

It reads ``position`` and sends ``command/steps`` and ``command/voltage``; the drive's own closed
loop has no part in it. A controller to start from.

"""

import math
import sys
from collections.abc import Sequence
from typing import Any

import rclpy
from geometry_msgs.msg import PointStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool, Float64, Int32

from stickslip_ros.instrument.position_loop import Level, LoopSettings, Steps
from stickslip_ros.instrument.remote_loop import RemoteLoop
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.recording.topics import COMMAND, LATCHED, STREAM
from stickslip_ros.ros.environment import stay_on_this_host
from stickslip_ros.ros.interface import to_profile
from stickslip_ros.ros.lockstep import Commands, LockstepClient
from stickslip_ros.ros.main import end_on_signals, spin_until

NODE_NAME = 'position_controller'
NANOSECONDS_PER_SECOND = 1_000_000_000
STAND = Parameters()
SETTINGS = {
    'gain': (STAND.actuator.gain, 1e-13, 1e-6, 'displacement of the feet per volt, m/V'),
    'voltage_min': (STAND.amplifier.voltage_min, -1000.0, 1000.0, 'lower end of the scan, V'),
    'voltage_max': (STAND.amplifier.voltage_max, -1000.0, 1000.0, 'upper end of the scan, V'),
    'step_amplitude': (STAND.step.amplitude, 1e-3, 2000.0, "the drive's step.amplitude, V"),
    'step_frequency': (STAND.step.frequency, 1e-3, 1e6, "the drive's step.frequency, Hz"),
    'share': (0.05, 1e-4, 1.0, 'share of the error that each reading takes back while scanning'),
    'tolerance': (2e-9, 1e-12, 1e-3, 'distance from the target that counts as in position, m'),
    'response_time': (0.015, 0.0, 10.0, 'time from a command until its effect has settled, s'),
    'block': (STAND.sim.block, 1e-4, 0.1, "lockstep: the drive's sim.block, s"),
}
"""Parameters of the controller: default, bounds, meaning."""
LOCKSTEP = ParameterDescriptor(
    description='grant every block to a drive with sim.lockstep', read_only=True
)


class PositionController(Node):
    """
    Bring the runner to the last ``~/target`` and hold it there.

    Publishes ``~/in_position`` (std_msgs/Bool, latched) and ``~/error`` (std_msgs/Float64, m).
    Keyword arguments are those of ``rclpy.node.Node``.

    """

    def __init__(self, node_name: str = NODE_NAME, **node_arguments: Any) -> None:
        super().__init__(node_name, **node_arguments)
        values = {name: self._declare(name) for name in SETTINGS}
        self.loop = RemoteLoop(
            LoopSettings(
                gain_m_per_v=values['gain'],
                voltage_min_v=values['voltage_min'],
                voltage_max_v=values['voltage_max'],
                step_v=values['step_amplitude'],
                share=values['share'],
                deadband_m=values['tolerance'],
            ),
            values['step_frequency'],
            values['response_time'],
        )
        command, latched = to_profile(COMMAND), to_profile(LATCHED)
        self._error = self.create_publisher(Float64, '~/error', command)
        self._in_position = self.create_publisher(Bool, '~/in_position', latched)
        self._told: bool | None = None
        self.create_subscription(PointStamped, '~/target', self._on_target, command)
        if self.declare_parameter('lockstep', False, LOCKSTEP).value:
            self._lockstep = LockstepClient(self, values['block'], self._answer)
        else:
            self._steps = self.create_publisher(Int32, 'command/steps', command)
            self._voltage = self.create_publisher(Float64, 'command/voltage', command)
            stream = to_profile(STREAM)
            self.create_subscription(PointStamped, 'position', self._on_position, stream)

    def _declare(self, name: str) -> float:
        default, lowest, highest, text = SETTINGS[name]
        bounds = FloatingPointRange(from_value=lowest, to_value=highest, step=0.0)
        descriptor = ParameterDescriptor(
            description=text, floating_point_range=[bounds], read_only=True
        )
        return float(self.declare_parameter(name, default, descriptor).value)

    def _on_target(self, message: PointStamped) -> None:
        if math.isfinite(message.point.x):
            self.loop.aim(message.point.x)
        else:
            self.get_logger().warning(
                f'target {message.point.x} m is not a finite number; send the position in m'
            )

    def _on_position(self, message: PointStamped) -> None:
        stamp = message.header.stamp
        time_ns = stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec
        action = self._decide(time_ns, message.point.x)
        if isinstance(action, Steps):
            self._steps.publish(Int32(data=action.count))
        elif action is not None:
            self._voltage.publish(Float64(data=action.voltage_v))

    def _answer(self, time_s: float, position_m: float) -> Commands:
        """Return what to send in lockstep, before the next block is granted."""
        action = self._decide(to_nanoseconds(time_s), position_m)
        if isinstance(action, Steps):
            return [('steps', action.count)]
        return [] if action is None else [('voltage', action.voltage_v)]

    def _decide(self, time_ns: int, position_m: float) -> Steps | Level | None:
        action = self.loop.update(time_ns, position_m)
        self._tell()
        return action

    def _tell(self) -> None:
        if math.isfinite(self.loop.error_m):
            self._error.publish(Float64(data=self.loop.error_m))
        if self.loop.in_position != self._told:
            self._told = self.loop.in_position
            self._in_position.publish(Bool(data=self._told))


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the controller until SIGINT or SIGTERM.

    Parameters
    ----------
    arguments : sequence of str, optional
        ROS arguments, such as ``--ros-args -p tolerance:=1e-9``; the command line if None.

    """
    ended = end_on_signals()
    stay_on_this_host()
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO,
        )
        spin_until(ended, PositionController(), SingleThreadedExecutor())
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
