"""
An EPICS motor record on the closed loop of a virtual drive, by caproto, as a client of its topics.

    python epics_motor.py --ros-args -r __ns:=/x -p record:=stand:x -p per_metre:=1e6 -p unit:=um

It is heard on this host only; EPICS_CA_SERVER_PORT chooses its port, as for every server of EPICS.
"""

import asyncio
import json
import math
import os
import secrets
import socket
import threading
import time
from functools import partial

import rclpy
from caproto import AlarmSeverity, AlarmStatus
from caproto.server import PVGroup, pvproperty, run
from geometry_msgs.msg import PointStamped
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PERIOD_S, SILENCE_S, ANSWER_S = 0.1, 1.0, 3.0  # of readbacks, of a dead drive, of a service
NEEDED = (
    'step.frequency', 'step.amplitude', 'actuator.gain', 'closed_loop.velocity',
    'closed_loop.tolerance', 'limits.soft_min', 'limits.soft_max')  # fmt: skip
NONE = (AlarmStatus.NO_ALARM, AlarmSeverity.NO_ALARM)
FAILED = (AlarmStatus.STATE, AlarmSeverity.MAJOR_ALARM)
BEYOND = (AlarmStatus.HWLIMIT, AlarmSeverity.MAJOR_ALARM)
SILENT = (AlarmStatus.COMM, AlarmSeverity.INVALID_ALARM)
ALARMS = {'DONE': NONE, 'ABORTED': NONE, 'END_STOP_REACHED': BEYOND, 'RANGE_LIMIT_REACHED': BEYOND}


def word(field, value=None):
    """Return an enumeration as text; caproto keeps what a client wrote, number or text."""
    value = field.value if value is None else value
    return value if isinstance(value, str) else field.enum_strings[int(value)]


def finite(field, value):
    """Return a number that a client writes; refuse what is not finite."""
    if not math.isfinite(value):
        raise ValueError(f'{field.pvname} {value} is not finite; write a number')
    return value


class MotorRecord(PVGroup):
    """One drive as one record; it lives on the loop of asyncio."""

    motor = pvproperty(value=0.0, name='', record='motor', precision=4)

    def __init__(self, node, **options):
        super().__init__(**options)
        self.node, self.per_m = node, node.get_parameter('per_metre').value
        self.dial_m, self.dial_ns, self.heard_s = 0.0, 0, float('-inf')
        self.step_m, self.given = None, {}
        self.tag, self.alarm, self.is_at_rest = '', SILENT, asyncio.Event()
        self.showing = asyncio.Lock()
        self.target = node.create_publisher(PointStamped, 'command/position', 10)

    @motor.startup
    async def motor(self, instance, _):
        """Join the two sides, then read back for ever."""
        f, node, unit = instance.field_inst, self.node, self.node.get_parameter('unit').value
        self.f, self.loop = f, asyncio.get_running_loop()
        await f.engineering_units.write(unit)
        for each in (instance, f.user_readback_value):
            await each.write_metadata(units=unit, precision=4)
        await f.stop_pause_move_go.write('Go')
        f.user_offset.putter = f.tweak_step_size.putter = self.take
        instance.verify_value = self.put  # a putter is not asked beyond the limits of VAL
        f.stop.putter, f.stop_pause_move_go.putter = self.stop, self.pause
        f.tweak_motor_forward.putter = lambda _, on: self.tweak(+1, on)
        f.tweak_motor_reverse.putter = lambda _, on: self.tweak(-1, on)
        f.velocity.putter = lambda _, per_s: self.set('closed_loop.velocity', per_s)
        f.user_low_limit.putter = lambda _, low: self.set('limits.soft_min', low, f.user_offset)
        f.user_high_limit.putter = lambda _, high: self.set('limits.soft_max', high, f.user_offset)
        for field in (f.max_velocity, f.home_forward, f.home_reverse):
            field.putter = self.refuse
        for kind, name, take, qos in (
            (JointState, 'joint_states', self._take_position, 1),  # 100 Hz; position has 1 kHz
            (String, 'stickslip_drive/event', self._take_event, 100),
            (String, 'stickslip_drive/info', self._take_info, LATCHED),
        ):
            hand_over = partial(self.loop.call_soon_threadsafe, self.guard, take)
            node.create_subscription(kind, name, hand_over, qos)
        self.stopping = node.create_client(Trigger, 'stickslip_drive/stop')
        self.setting = node.create_client(SetParameters, 'stickslip_drive/set_parameters')
        while True:
            if time.monotonic() - self.heard_s > SILENCE_S:
                await self.rest(SILENT)
            elif self.alarm is SILENT:
                self.alarm = NONE
                await self.motor.write(self.readback(), verify_value=False)
            await self.write_readback()
            await asyncio.sleep(PERIOD_S)

    def guard(self, take, message):
        """Pass over, and log, a message that is not a drive's."""
        try:
            take(message)
        except Exception as error:  # noqa: BLE001 - of whatever somebody publishes
            log = self.node.get_logger()
            log.warning(f'not of a drive: {error!r}'[:200], throttle_duration_sec=5.0)

    def _take_position(self, message):
        stamp = message.header.stamp
        self.read_at(stamp.sec * 10**9 + stamp.nanosec, message.position[0])

    def read_at(self, stamp_ns, position_m):
        """Take a reading; not one of just before the last one, which an event may have brought."""
        is_old = 0.0 < 1e-9 * (self.dial_ns - stamp_ns) < SILENCE_S
        if math.isfinite(position_m) and not is_old:
            self.dial_m, self.dial_ns, self.heard_s = position_m, stamp_ns, time.monotonic()

    def _take_info(self, message):
        given = json.loads(message.data)['parameters']
        self.given = {name: float(given[name]) for name in NEEDED}
        self.loop.create_task(self.show_parameters())

    def _take_event(self, message):
        event = json.loads(message.data)
        if self.tag and event.get('tag') == self.tag:
            result, step_m = str(event['result']), event.get('step_m')
            self.step_m = self.step_m if step_m is None else float(step_m)
            if event.get('position_m') is not None:  # null: the drive has no reading
                self.read_at(event['stamp_ns'], event['position_m'])
            self.loop.create_task(self.rest(ALARMS.get(result, FAILED), result, self.tag))

    def readback(self):
        """Return the position, with the offset."""
        return self.dial_m * self.per_m + self.f.user_offset.value

    async def show_parameters(self):
        """Write speeds and limits, call by call; an event of VAL's would bring ophyd old ones."""
        async with self.showing:
            given, f, per_m = self.given, self.f, self.per_m
            rate_hz, stroke_v = given['step.frequency'], given['step.amplitude']
            stroke_m = stroke_v * given['actuator.gain']
            step_m = self.step_m or 0.5 * stroke_m  # as learned by the last move
            speed = given['closed_loop.velocity'] or step_m * rate_hz
            low, high = given['limits.soft_min'] * per_m, given['limits.soft_max'] * per_m
            offset = f.user_offset.value if (low, high) != (0.0, 0.0) else 0.0  # without limits
            for field, value in (
                (f.velocity, speed * per_m), (f.max_velocity, stroke_m * rate_hz * per_m),
                (f.motor_step_size, step_m * per_m), (f.seconds_to_velocity, 0.0),
                (f.retry_deadband, given['closed_loop.tolerance'] * per_m),
                (f.dial_low_limit, low), (f.dial_high_limit, high)):  # fmt: skip
                await field.write(value, verify_value=False)
            low, high = low + offset, high + offset
            if (low, high) != (f.user_low_limit.value, f.user_high_limit.value):
                await self.motor.write_metadata(False, lower_ctrl_limit=low, upper_ctrl_limit=high)
                await f.user_low_limit.write(low, verify_value=False)
                await f.user_high_limit.write(high, verify_value=False)

    async def write_readback(self):
        """Write position and alarm: what is verified, caproto sets to no alarm."""
        (status, severity), f = self.alarm, self.f
        for field, value in (
            (f.current_alarm_severity, int(severity)), (f.alarm_status, int(status)),
            (f.dial_readback_value, self.dial_m * self.per_m),
            (f.user_readback_value, self.readback())):  # fmt: skip
            await field.alarm.write(status=int(status), severity=int(severity), publish=False)
            await field.write(value, verify_value=False)

    async def refuse(self, instance, _):
        """Refuse what the drive does not have."""
        raise ValueError(f'{instance.pvname} cannot be set')

    async def take(self, instance, value):
        """Take a finite number."""
        return finite(instance, value)

    async def set(self, name, value, offset=None):
        """Set a live parameter of the drive, and wait until its information says so."""
        value = (finite(self.motor, value) - (offset.value if offset else 0.0)) / self.per_m
        parameter = Parameter(name, value=value).to_parameter_msg()
        asked = self.setting.call_async(SetParameters.Request(parameters=[parameter]))
        end_s = time.monotonic() + ANSWER_S
        while self.given.get(name) != value:
            is_refused = asked.done() and not asked.result().results[0].successful
            if is_refused or time.monotonic() > end_s:
                raise ValueError(asked.result().results[0].reason if is_refused else 'no answer')
            await asyncio.sleep(1e-3)
        await self.show_parameters()

    async def put(self, value):
        """Take VAL, and move; a put that waits ends with the move. Return what VAL is then."""
        finite(self.motor, value)
        f, low, high = self.f, self.f.user_low_limit.value, self.f.user_high_limit.value
        if word(f.set_use_switch) == 'Set':
            await f.user_offset.write(f.user_offset.value + value - self.readback())
            await self.show_parameters()  # the limits stay where they are on the dial
            await self.write_readback()
            return value
        is_beyond = (low, high) != (0, 0) and not low <= value <= high
        await f.limit_violation.write(int(is_beyond))
        if is_beyond:
            return self.motor.value
        await self.motor.write(value, verify_value=False)
        if word(f.stop_pause_move_go) in ('Move', 'Go'):
            await self.move(value)
        return self.motor.value

    async def move(self, value):
        """Go to a place in closed loop, and wait for the end; also to the present place."""
        f, self.tag, message = self.f, f'motor-{secrets.token_hex(8)}', PointStamped()
        self.is_at_rest.clear()
        for field, state in (
            (f.user_high_limit_switch, 0), (f.user_low_limit_switch, 0),
            (f.direction_of_travel, int(value >= self.readback())),
            (f.done_moving_to_value, 0), (f.motor_is_moving, 1)):  # fmt: skip
            await field.write(state, verify_value=False)
        message.header.frame_id = f'#{self.tag}'
        message.point.x = (value - f.user_offset.value) / self.per_m
        self.target.publish(message)
        await self.is_at_rest.wait()

    async def rest(self, alarm, result='', tag=None):
        """End the move: readback and alarm first, then DMOV, then whoever waits."""
        if tag not in (None, self.tag):  # the next one has begun
            return
        f, self.alarm = self.f, alarm
        if alarm is BEYOND:
            switch = f.user_low_limit_switch, f.user_high_limit_switch
            await switch[f.direction_of_travel.value].write(1, verify_value=False)
        await self.write_readback()
        if result == 'ABORTED' and word(f.stop_pause_move_go) != 'Pause':
            await self.motor.write(self.readback(), verify_value=False)
        if not self.is_at_rest.is_set():
            await f.motor_is_moving.write(0, verify_value=False)
            await f.done_moving_to_value.write(1, verify_value=False)
            self.is_at_rest.set()

    async def stop(self, _, on):
        """End whatever moves."""
        if on:
            self.stopping.call_async(Trigger.Request())
        return 0

    async def pause(self, instance, value):
        """Stop, or go on to VAL."""
        if word(instance, value) in ('Stop', 'Pause'):
            self.stopping.call_async(Trigger.Request())
        elif word(instance) == 'Pause':
            self.loop.create_task(self.move(self.motor.value))

    async def tweak(self, sign, on):
        """Move by TWV."""
        if on:
            await self.motor.write(self.motor.value + sign * self.f.tweak_step_size.value)
        return 0


def main():
    """Serve until Ctrl-C."""
    sink = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # hears beacons, which fail unheard
    sink.bind(('127.0.0.1', 0))
    os.environ['EPICS_CAS_BEACON_ADDR_LIST'] = f'127.0.0.1:{sink.getsockname()[1]}'
    os.environ['EPICS_CAS_AUTO_BEACON_ADDR_LIST'] = 'NO'
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # those of caproto end it
    node = Node('epics_motor')
    node.declare_parameters('', [('record', 'stand:x'), ('per_metre', 1e6), ('unit', 'um')])
    record = MotorRecord(node, prefix=node.get_parameter('record').value)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=executor.spin).start()
    node.get_logger().info(f'serves {record.prefix}')
    run(record.pvdb, interfaces=['127.0.0.1'])
    executor.shutdown()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
