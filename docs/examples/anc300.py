"""
The console of attocube's ANC300 over TCP: each of its axes is a virtual drive, by its namespace.

    python anc300.py --ros-args -p axes:="['/x', '/y']" -p port:=7230 -p password:="'123456'"

Without a password (`''`) it asks for none. Its 150 V are the range of the drive's amplifier.
"""

import asyncio
import json
import secrets
import threading
import time
from contextlib import suppress
from functools import partial

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension, String, UInt32
from std_srvs.srv import SetBool, Trigger

RANGE_V, STEPS_MAX, FALL_S = 150.0, 2**31 - 1, 2e-6
LIMITS = {'v': (0.0, RANGE_V), 'f': (1.0, 10_000.0), 'a': (0.0, RANGE_V)}
RAMPS = {'u': list(range(256)), 'd': list(range(255, -1, -1))}
OFFSET_MODES, LINE_B = ('off', 'stp+', 'stp-'), 4096
CLIENTS, STRANGERS = 8, 64  # with a password, and without one yet; of these the oldest has to go
LOGIN_S, TRIES, TRY_S = 10.0, 3, 1.0  # for the password; of passwords; after a wrong one
ANSWER_S, ATTEMPTS, LOOK_S = 3.0, 6, 2e-3
MOVING, AMPLIFIER_ENABLED = 1 << 0, 1 << 18  # bits of the drive's status
NEEDED = 'amplifier.voltage_min', 'amplifier.voltage_max', 'actuator.capacitance'
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Refused(Exception):
    """What the console says in front of ERROR."""


def guarded(take):
    """Have a callback pass over, and log, a message that is not a drive's: it ends nothing."""

    def heed(self, message):
        try:
            take(self, message)
        except Exception as error:  # noqa: BLE001 - of whatever somebody publishes
            self.log.warning(f'not of a drive: {error!r}'[:200], throttle_duration_sec=5.0)

    return heed


class Axis:
    """A drive as an axis; what its topics say is noted at once, and looked at by the loop."""

    def __init__(self, node, namespace):
        base = namespace.rstrip('/')
        drive = f'{base}/stickslip_drive'
        self.values, self.patterns = {'v': 30.0, 'f': 1000.0, 'a': 0.0}, dict(RAMPS)
        self.given, self.status, self.chosen = {}, 0, 'gnd'
        self.under_way, self.failure, self.log = set(), '', node.get_logger()
        self.sawtooth = node.create_publisher(Float64MultiArray, f'{base}/command/sawtooth', 10)
        self.waveform = node.create_publisher(Float64MultiArray, f'{base}/command/waveform', 2)
        self.direct = node.create_publisher(Float64, f'{base}/command/voltage', 10)
        node.create_subscription(String, f'{drive}/info', self._take_info, LATCHED)
        node.create_subscription(String, f'{drive}/event', self._take_event, 100)
        self.told = node.create_subscription(UInt32, f'{drive}/status', self._take_status, LATCHED)
        # Last: a drive that has answered one of these knows the publishers above.
        self.stopping = node.create_client(Trigger, f'{drive}/stop')
        self.amplifier = node.create_client(SetBool, f'{drive}/enable_amplifier')

    @guarded
    def _take_info(self, message):
        given = json.loads(message.data)['parameters']
        self.given = {name: float(given[name]) for name in NEEDED}

    def _take_status(self, message):
        self.status = message.data

    @guarded
    def _take_event(self, message):
        event = json.loads(message.data)
        tag, result, why = event.get('tag'), event['result'], str(event['message'])
        if tag in self.under_way:
            self.failure = '' if result in ('DONE', 'ABORTED') else why or result
            self.under_way.discard(tag)

    async def until(self, condition, timeout_s=ANSWER_S):
        """Wait until a condition holds, or time is up; return whether it does."""
        end_s = time.monotonic() + timeout_s
        while not condition() and time.monotonic() < end_s:
            if not self.told.get_publisher_count():
                self.under_way.clear()
                raise Refused('Drive not connected')
            await asyncio.sleep(LOOK_S)
        return condition()

    async def call(self, client, request):
        """Call a service, again while no answer comes: DDS may lose one."""
        asked, answers = [], []
        while not answers and len(asked) < ATTEMPTS:
            asked.append(client.call_async(request))
            await self.until(lambda: any(each.done() for each in asked), ANSWER_S / ATTEMPTS)
            answers = [each.result() for each in asked if each.done()]
        if not answers or not answers[0].success:
            raise Refused(answers[0].message if answers else 'Drive does not answer')

    @property
    def mode(self):
        """The mode; an axis whose amplifier somebody else has switched off is grounded."""
        return self.chosen if self.status & AMPLIFIER_ENABLED else 'gnd'

    def volts(self, console_v):
        """Return the voltage of the drive."""
        low_v, high_v = self.given['amplifier.voltage_min'], self.given['amplifier.voltage_max']
        return low_v + (high_v - low_v) * console_v / RANGE_V

    async def set_mode(self, mode):
        """Stop, and switch the amplifier: a measured capacitance leaves it off, as `gnd` does."""
        if mode not in ('gnd', 'cap', 'stp', *OFFSET_MODES):
            raise Refused('Unsupported mode')
        is_on = mode not in ('gnd', 'cap')
        await self.stop()
        await self.call(self.amplifier, SetBool.Request(data=is_on))
        self.chosen = mode if is_on else 'gnd'
        await self.until(lambda: bool(self.status & AMPLIFIER_ENABLED) == is_on)
        await self.set_value('a', self.values['a'])

    async def set_value(self, name, word):
        """Set voltage or frequency of steps, or the offset."""
        self.values[name] = number(word, *LIMITS[name])
        if name == 'a' and self.mode in OFFSET_MODES:
            self.direct.publish(Float64(data=self.volts(self.values[name])))

    async def set_pattern(self, way, *levels):
        """Give steps another shape."""
        if len(levels) != len(RAMPS[way]):
            raise Refused('256 values needed')
        self.patterns[way] = [int(number(each, 0, 255)) for each in levels]

    async def step(self, way, count='1'):
        """Make steps; 0 and c: on and on. Return when the drive has begun, or has refused."""
        if self.mode not in ('stp', 'stp+', 'stp-'):
            raise Refused('Axis in wrong mode')
        steps = 0 if count == 'c' else int(number(count, 0, STEPS_MAX))
        v, f, a = self.values.values()
        tag = secrets.token_hex(8)
        if self.mode == 'stp' and self.patterns[way] == RAMPS[way]:
            publisher, axis = self.sawtooth, MultiArrayDimension(label=f'#{tag}', size=3)
            data = [self.volts(v) - self.volts(0.0), f if way == 'u' else -f, float(steps)]
        else:  # one step of another shape, or beside an offset, again and again
            publisher, axis = self.waveform, MultiArrayDimension(label=f'cycle#{tag}', size=steps)
            low_v = {'stp': 0.0, 'stp+': a, 'stp-': a - v}[self.mode]
            levels = [low_v + v * each / 255 for each in self.patterns[way]]
            times = [*(i / 256 / f for i in range(255)), 1 / f - FALL_S, 1 / f]
            rows = zip(times, map(self.volts, [*levels, levels[0]]), strict=True)
            data = [each for row in rows for each in row]
        message = Float64MultiArray(data=data)
        message.layout.dim = [axis]
        self.under_way.add(tag)
        self.failure = ''
        publisher.publish(message)
        await self.wait(lambda: tag not in self.under_way or self.status & MOVING, ANSWER_S)

    async def wait(self, condition=None, timeout_s=float('inf')):
        """Wait for the ends of our moves, as long as they take; refused if the last has failed."""
        is_over = await self.until(condition or (lambda: not self.under_way), timeout_s)
        if self.failure or not is_over:
            raise Refused(self.failure or 'Drive does not answer')

    async def stop(self):
        """End whatever moves."""
        await self.call(self.stopping, Trigger.Request())
        await self.until(lambda: not self.under_way)
        self.under_way, self.failure = set(), ''

    def read(self, name):
        """Return the lines of an answer; `geto` is 0 at rest, by which drivers know it."""
        if name in ('getpu', 'getpd'):
            return map(str, self.patterns[name[4]])
        v, f, a = self.values.values()
        return [{
            'getser': 'ANM150A-M-0000-0000001', 'getm': f'mode = {self.mode}',
            'getv': f'voltage = {v:.6f} V', 'geta': f'voltage = {a:.6f} V',
            'getf': f'frequency = {f:.0f} Hz',
            'geto': f'voltage = {v if self.under_way else a * (self.mode in OFFSET_MODES):.6f} V',
            'getc': f'capacitance = {1e9 * self.given["actuator.capacitance"]:.6f} nF',
            'gettu': 'trigger = off', 'gettd': 'trigger = off',
            'getaci': 'acin = off', 'getdci': 'dcin = off',
        }[name]]  # fmt: skip


VERSION = 'attocube ANC300 controller version 1.1.0-1304 2013-10-17 08:16'
BOARD = {'ver': [VERSION, 'virtual drive'], 'getcser': ['ANC300B-C-0000-0000001'], 'echo': []}
ORDERS = {
    'setm': (Axis.set_mode,), 'stop': (Axis.stop,), 'stepw': (Axis.wait,), 'capw': (Axis.wait,),
    **{f'set{name}': (Axis.set_value, name) for name in LIMITS},
    **{f'step{way}': (Axis.step, way) for way in RAMPS},
    **{f'setp{way}': (Axis.set_pattern, way) for way in RAMPS},
}  # fmt: skip


def number(word, low, high):
    """Return a number between its limits."""
    with suppress(ValueError):
        if low <= float(word) <= high:
            return float(word)
    raise Refused(f'{word[:20]} is not a number from {low:g} to {high:g}')


async def answer(axes, line):
    """Carry out a command; return what is said in front of OK."""
    name, place, *words = *line.split(), '', ''
    if name in BOARD:
        return BOARD[name]
    axis = {str(i): each for i, each in enumerate(axes, 1)}.get(place)
    if axis is None or not axis.given:
        raise Refused('Drive not connected' if axis else 'Wrong axis type')
    if name in ('settu', 'settd', 'setaci', 'setdci') and words[0] == 'off':
        return []
    try:
        if name not in ORDERS:
            return axis.read(name)
        act, *first = ORDERS[name]
        under_way = act(axis, *first, *filter(None, words))
    except (KeyError, TypeError):
        raise Refused('Unknown command, or wrong number of parameters') from None
    return await under_way or []


async def say(writer, *lines):
    """Send lines to a client."""
    writer.write(''.join(f'{each}\r\n' for each in lines).encode())
    await writer.drain()


async def log_in(password, reader, writer):
    """Hear the password, a try a second; return whether it came."""
    for _ in range(TRIES):
        word = (await reader.readline()).decode('ascii', 'replace').strip()
        is_in = word == password
        await say(writer, '*' * len(word), f'Authorization {"success" if is_in else "failed"}')
        if is_in:
            return True
        await asyncio.sleep(TRY_S)
    return False


async def serve(axes, password, clients, strangers, reader, writer):
    """Log a client in, then talk to it, command by command."""
    has_echo = bool(password)
    strangers[writer] = writer
    if len(strangers) > STRANGERS:
        strangers.pop(next(iter(strangers))).close()
    with suppress(ValueError, ConnectionError, asyncio.TimeoutError):  # an endless line, silence
        is_in = not password or await asyncio.wait_for(log_in(password, reader, writer), LOGIN_S)
        strangers.pop(writer, None)
        if is_in and len(clients) < CLIENTS:
            clients.add(writer)
        elif is_in:
            await say(writer, f'{CLIENTS} clients are here, which is the limit', 'ERROR')
        while writer in clients and (line := await reader.readline()):
            line = line.decode('ascii', 'replace').strip()
            echo, has_echo = [f'> {line}'] * has_echo, has_echo and line != 'echo off'
            try:
                said = *await answer(axes, line), 'OK'
            except Refused as refused:
                said = ' '.join(str(refused).split()), 'ERROR'
            await say(writer, *echo, *said)
    strangers.pop(writer, None)
    clients.discard(writer)
    writer.close()


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    node = Node('anc300')
    given = ('axes', ['/']), ('host', '127.0.0.1'), ('port', 7230), ('password', '123456')
    namespaces, host, port, password = (each.value for each in node.declare_parameters('', given))
    talk = partial(serve, [Axis(node, each) for each in namespaces], password, set(), {})
    loop = asyncio.new_event_loop()
    server = loop.run_until_complete(asyncio.start_server(talk, host, port, limit=LINE_B))
    node.get_logger().info(f'listens on {server.sockets[0].getsockname()}')
    threading.Thread(target=loop.run_forever, daemon=True).start()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
