# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every bit of the status is set and cleared."""

from typing import Any, NamedTuple

import pytest

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters

IDLE = int(Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED)
PATIENCE_BLOCKS = 2000
FREE: dict[str, Any] = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
BLOCKED = FREE | {'fault.runner_stuck': True}
CONFINED = FREE | {'limits.soft_min': -1e-6, 'limits.soft_max': 1e-6}
#: The set point runs ten times faster than the runner can: 0.1 mm/s at 1000 steps of 100 nm.
HURRIED = FREE | {'closed_loop.velocity': 1e-3, 'limits.following_error': 1e-6}
IMPATIENT = FREE | {'closed_loop.timeout': 0.02}
LOST = {'interferometer.velocity_max': 1e-4, 'runner.damping': 80.0}
STOP, RESET, CLEAR, ZERO = map(Request, ('stop', 'reset', 'clear_faults', 'zero_position'))
STEPS, NEXT = Request('sawtooth', (300.0, 1000.0, 0.0)), Request('voltage', (1.0,))
NEAR, FAR = (Request('position', (x_m, 0.0, 0.0)) for x_m in (1e-6, 1e-3))
LOAD, UNLOAD = (Request('load', (x_n, 0.0, 0.0, 0.0, 0.0, 0.0)) for x_n in (0.1, 0.0))
POWER_OFF, POWER_ON = (Request('enable_amplifier', (on,)) for on in (0.0, 1.0))
DROPOUT = Request('fault', settings=(('fault.interferometer', 'dropout'),))
DEAD_FOOT = Request('fault', settings=(('fault.dead_foot', 1),))


class Way(NamedTuple):
    """Requests that set and clear a bit, and their stand."""

    there: Request
    back: Request
    given: dict[str, Any] = {}  # noqa: RUF012 - nobody changes it


BITS = {
    Status.MOVING: Way(STEPS, STOP),
    Status.CLOSED_LOOP: Way(NEAR, STOP, FREE),
    Status.MOVE_DELAYED: Way(NEXT, RESET, {'fault.command_delay': 10.0}),
    Status.SENSOR_PRESENT: Way(DROPOUT, CLEAR),
    Status.IS_REFERENCED: Way(ZERO, RESET),
    Status.END_STOP_REACHED: Way(FAR, NEXT, BLOCKED),
    Status.RANGE_LIMIT_REACHED: Way(STEPS, NEXT, CONFINED),
    Status.FOLLOWING_LIMIT_REACHED: Way(FAR, NEXT, HURRIED),
    Status.MOVEMENT_FAILED: Way(FAR, NEXT, IMPATIENT),
    Status.STREAMING: Way(Request('waveform', (0.0, 0.0, 100.0, 10.0)), STOP),
    Status.AMPLIFIER_ENABLED: Way(POWER_OFF, POWER_ON),
    Status.IN_POSITION: Way(NEAR, STOP, FREE),
    Status.LOADED: Way(LOAD, UNLOAD),
    Status.REFUSED: Way(Request('voltage', (1e6,)), NEXT),
    Status.PRELOADING: Way(Request('preload', (0.8,)), RESET, {'stand.preload_rate': 0.01}),
    Status.FAULT: Way(DEAD_FOOT, CLEAR),
    Status.BEAM_LOST: Way(Request('sawtooth', (300.0, 1000.0, 20.0)), RESET, LOST),
    Status.FORCE_OVERRANGE: Way(STEPS, RESET, {'load_cell.range': 1e-3}),
}


@pytest.mark.parametrize('bit', list(Status), ids=lambda bit: bit.name)
def test_a_bit_is_set_and_cleared(bit: Status):
    way = BITS[bit]
    bench = Bench(Parameters().updated(way.given))
    block_ns = bench.parameters.block_ns

    def changes_by(*requests: Request) -> int:
        before = bench.update(bench.time_ns + block_ns).status & bit
        status = bench.update(bench.time_ns + block_ns, requests).status
        for _ in range(PATIENCE_BLOCKS):
            if status & bit != before:
                break
            status = bench.update(bench.time_ns + block_ns).status
        return int(status & bit)

    assert changes_by(way.there) == int(bit) & ~IDLE  # Python 3.11.2 has another ~ of flags
    assert changes_by(way.back) == bit & IDLE
