"""A kernel called again and again gives what it gives when numba looks at every call."""

from typing import Any, NamedTuple

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.repeated import Repeated, kinds_of


class Inner(NamedTuple):
    rate: float
    count: int


class Constants(NamedTuple):
    factor: float
    inner: Inner
    table: Any


class Changing(NamedTuple):
    level: float
    steps: int


@entry_point
def go_on(
    constants: Constants, ring: Any, state: Changing, wave: Inner, way: float, out: Any
) -> Changing:
    level = state.level * constants.factor + way * wave.rate + constants.inner.rate
    level += constants.table[state.steps % len(constants.table)] / 3
    ring[state.steps % len(ring)] += level
    out[0] = level
    return Changing(level, state.steps + wave.count + constants.inner.count)


@entry_point
def widen(constants: Inner, ring: Any, state: Changing) -> Changing:
    """Return a float where an integer may have been."""
    return Changing(state.level + 0.5 * constants.rate, state.steps)


NUMBERS = st.one_of(st.integers(-3, 3), st.sampled_from([0.25, -1.5, 2.75, np.float64(0.125)]))
TABLES = st.sampled_from(
    [
        np.array([1.0, 2.0, 5.0]),
        np.array([1, 2]),
        np.array([1.0, 9.0, 2.0, 9.0])[::2],
        np.array([3.0, 4.0], dtype=np.float32),
    ]
)
CONSTANTS = st.builds(Constants, NUMBERS, st.builds(Inner, NUMBERS, st.integers(0, 2)), TABLES)
WAVES = st.builds(Inner, NUMBERS, st.integers(0, 2))
STATES = st.builds(Changing, NUMBERS, st.integers(0, 5))
CHANGES = st.lists(
    st.tuples(
        st.one_of(st.none(), CONSTANTS), st.one_of(st.none(), WAVES), st.one_of(st.none(), STATES)
    ),
    min_size=1,
    max_size=12,
)


@given(CONSTANTS, WAVES, STATES, CHANGES)
def test_whatever_is_replaced_by_whatever_types(constants, wave, state, changes):
    repeated = Repeated(go_on, records=4)
    rings = np.zeros(3), np.zeros(3)
    outs = np.zeros(1), np.zeros(1)
    for number, (other, next_wave, next_state) in enumerate(changes):
        constants, wave = other or constants, next_wave or wave
        state = next_state or state
        ours = repeated(constants, rings[0], state, wave, 0.5 + number, outs[0])
        usual = go_on(constants, rings[1], state, wave, 0.5 + number, outs[1])
        assert ours == usual
        assert type(ours.level) is float
        state = ours
    assert rings[0].tobytes() == rings[1].tobytes()
    assert outs[0] == outs[1]


def test_types_are_looked_up_once():
    repeated = Repeated(go_on, records=4)
    ring, out, wave = np.zeros(3), np.zeros(1), Inner(1.0, 1)
    constants, state = Constants(0.5, Inner(0.1, 0), np.ones(2)), Changing(0.0, 0)
    state = repeated(constants, ring, state, wave, 1.0, out)
    first = repeated._code
    assert first is not go_on
    for _ in range(3):
        state = repeated(constants, ring, state, wave, 1.0, out)
        wave = Inner(2.0 * wave.rate, 2)
    assert repeated._code is first
    assert len(repeated._codes) == 1


def test_a_state_that_becomes_one_of_other_types():
    repeated = Repeated(widen, records=3)
    states = [Changing(1, 0)]
    for _ in range(3):
        states.append(repeated(Inner(1.0, 0), np.zeros(1), states[-1]))
    assert [each.level for each in states] == [1, 1.5, 2.0, 2.5]


def test_kinds_tell_arrays_apart_as_numba_does():
    column = np.zeros((4, 4))[:, 0]
    fixed = np.zeros(4)
    fixed.setflags(write=False)
    arrays = [np.zeros(4), column, fixed, np.zeros((4, 4)), np.zeros(4, dtype=np.int64)]
    assert len({kinds_of(each) for each in arrays}) == len(arrays)
    assert kinds_of(np.zeros(4)) == kinds_of(np.ones(9))
    assert kinds_of(Inner(1.0, 2)) != kinds_of(Changing(1.0, 2))
    assert kinds_of(Inner(True, 2)) != kinds_of(Inner(1.0, 2))
