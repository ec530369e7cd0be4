"""Every bit of ~/status is set and cleared by a real node."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

from stickslip_ros.instrument.reports import Status

IDLE = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
FREE = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
BLOCKED = FREE | {'stand.travel_max': 1e-6, 'stand.stop_stiffness': 1e7}
CONFINED = FREE | {'limits.soft_min': -1e-6, 'limits.soft_max': 1e-6}
#: The set point runs ten times faster than the runner can: 0.1 mm/s at 1000 steps of 100 nm.
HURRIED = FREE | {'closed_loop.velocity': 1e-3, 'limits.following_error': 1e-6}
IMPATIENT = FREE | {'closed_loop.timeout': 0.02}
FAR_M = 1e-3
ENDLESS = (300.0, 1000.0, 0.0)
BURST = (300.0, 1000.0, 20.0)
LONG_WAVE = ((0.0, 0.0), (100.0, 10.0))

Act = Callable[[Any], Any]
"""What an operator does."""


@dataclass(frozen=True)
class Way:
    """How an operator reaches a bit, and leaves it again."""

    there: Act
    back: Act
    given: Mapping[str, Any] = field(default_factory=dict)


def step_and_wait(operator: Any) -> None:
    operator.command('sawtooth', BURST)
    operator.wait_for_event('sawtooth', 0)


def stop(operator: Any) -> Any:
    return operator.trigger('stop')


def reset(operator: Any) -> Any:
    return operator.trigger('reset')


def clear(operator: Any) -> Any:
    return operator.trigger('clear_faults')


def next_move(operator: Any) -> None:
    operator.command('voltage', 0.0)


def break_down(name: str, value: Any) -> Act:
    return lambda operator: operator.set_parameter(f'fault.{name}', value)


def switch_amplifier(wanted: bool) -> Act:
    return lambda operator: operator.switch('enable_amplifier', wanted=wanted)


def ask(name: str, value: Any) -> Act:
    return lambda operator: operator.command(name, value)


BITS = {
    Status.MOVING: Way(ask('sawtooth', ENDLESS), stop),
    Status.CLOSED_LOOP: Way(ask('position', 1e-6), stop, FREE),
    Status.MOVE_DELAYED: Way(ask('voltage', 10.0), reset, {'fault.command_delay': 10.0}),
    Status.SENSOR_PRESENT: Way(break_down('interferometer', 'dropout'), clear),
    Status.IS_REFERENCED: Way(lambda operator: operator.trigger('zero_position'), reset),
    Status.END_STOP_REACHED: Way(ask('position', FAR_M), next_move, BLOCKED),
    Status.RANGE_LIMIT_REACHED: Way(ask('sawtooth', ENDLESS), next_move, CONFINED),
    Status.FOLLOWING_LIMIT_REACHED: Way(ask('position', FAR_M), next_move, HURRIED),
    Status.MOVEMENT_FAILED: Way(ask('position', FAR_M), next_move, IMPATIENT),
    Status.STREAMING: Way(ask('waveform', LONG_WAVE), stop),
    Status.AMPLIFIER_ENABLED: Way(switch_amplifier(wanted=False), switch_amplifier(wanted=True)),
    Status.IN_POSITION: Way(ask('position', 1e-6), stop, FREE),
    Status.LOADED: Way(ask('load', 0.1), ask('load', 0.0)),
    Status.REFUSED: Way(ask('voltage', 1e6), ask('voltage', 1.0)),
    Status.PRELOADING: Way(ask('preload', 0.8), reset, {'stand.preload_rate': 0.01}),
    Status.FAULT: Way(break_down('dead_foot', 1), clear),
    Status.BEAM_LOST: Way(
        step_and_wait,
        lambda operator: operator.trigger('zero_position'),
        {'interferometer.velocity_max': 1e-4, 'runner.damping': 80.0},
    ),
    Status.FORCE_OVERRANGE: Way(step_and_wait, reset, {'load_cell.range': 1e-3}),
}


@pytest.mark.parametrize('bit', list(Status), ids=lambda bit: bit.name)
def test_a_bit_is_set_and_cleared_on_the_topic(start_drive: Callable, bit: Status):
    way = BITS[bit]
    stand = start_drive(dict(way.given))
    operator = stand.operator

    def is_as_in_idle() -> bool:
        return operator.status & bit == IDLE & bit

    assert is_as_in_idle()
    way.there(operator)
    operator.spin_until(lambda: not is_as_in_idle(), f'the change of {bit.name}')
    way.back(operator)
    operator.spin_until(is_as_in_idle, f'the change back of {bit.name}')


def test_every_bit_has_its_way():
    assert BITS.keys() == set(Status)
