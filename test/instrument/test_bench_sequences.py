# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Any sequence of requests on any stand: nothing raises, and every end is reported once."""

from collections import Counter

import numpy as np
from bench_runs import MS, drive_bench
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip_ros.drive.records import POSITION
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Event, Result, Status
from stickslip_ros.parameters import Parameters

BLOCKS = 8
EXAMPLES = 60
MOVES = frozenset(('voltage', 'sawtooth', 'steps', 'jog', 'waveform', 'position', 'joint'))
FAILURE_BITS = (
    Status.END_STOP_REACHED | Status.RANGE_LIMIT_REACHED | Status.FOLLOWING_LIMIT_REACHED
)
SET_POINTS = frozenset(('voltage', 'position', 'preload'))
"""Commands that the next one of their name replaces without an event."""
REFUSALS = (Result.INVALID_PARAMETER, Result.RANGE_LIMIT_REACHED)
SILENT = frozenset(('jog', 'joint'))
"""Moves that are renewed without an event."""
WATCHED = frozenset(('jog', 'position', 'joint'))
"""Moves that are looked at once per update: how long an update is matters to them."""
QUICK = {
    'jog.timeout': 2e-3,
    'closed_loop.timeout': 5e-3,
    'limits.blocked_time': 2e-3,
    'stand.preload_rate': 50.0,
}
"""Nothing takes longer than a few blocks."""
OPTIONS = {
    'amplifier.bandwidth': (5e3,),
    'amplifier.resolution': (0.01, 10.0),
    'actuator.hysteresis': (0.2,),
    'actuator.gain_tolerance': (0.1,),
    'closed_loop.hold': (False,),
    'closed_loop.settle_time': (0.0, 1e-3),
    'closed_loop.velocity': (1e-4,),
    'contact.law': ('coulomb', 'lugre'),
    'interferometer.velocity_max': (1e-3,),
    'limits.following_error': (1e-7,),
    'limits.soft_max': (0.0, 1e-7),
    'load_cell.contact': ('one_sided', 'absent'),
    'load_cell.range': (1e-3,),
    'stand.preload_end': (0.6,),
    'stand.stop_stiffness': (1e5,),
    'step.amplitude': (40.0, 400.0),
    'step.frequency': (1.0, 20e3),
}
SPANS_V = ((0.0, 300.0), (-150.0, 150.0), (50.0, 250.0))
WORDS = st.sampled_from(('none', 'freeze', 'dropout'))
FAULTS = {
    'fault.interferometer': WORDS,
    'fault.interferometer_offset': st.sampled_from((0.0, 1e-6)),
    'fault.load_cell': WORDS,
    'fault.amplifier_off': st.booleans(),
    'fault.dead_foot': st.integers(0, 7),
    'fault.runner_stuck': st.booleans(),
    'fault.missed_steps': st.sampled_from((0.0, 0.5, 1.0)),
}
DELAYS = {'fault.command_delay': st.sampled_from((0.0, 1e-3, 2.5e-3))}


@st.composite
def stands(draw):
    chosen = draw(st.sets(st.sampled_from(sorted(OPTIONS)), max_size=4))
    values = {name: draw(st.sampled_from(OPTIONS[name])) for name in sorted(chosen)}
    if values.get('contact.law') == 'coulomb':
        values.pop('actuator.gain_tolerance', None)  # refused: feet share no load under it
    low_v, high_v = draw(st.sampled_from(SPANS_V))
    span_v = dict(zip(('voltage_min', 'voltage_max'), (low_v, high_v), strict=True))
    span_v['voltage_initial'] = draw(st.sampled_from((low_v, high_v)))
    return Parameters().updated(QUICK | values | {f'amplifier.{k}': v for k, v in span_v.items()})


POSITIONS, VELOCITIES = (0.0, 2e-8, -1e-6, 1e6, np.nan), (0.0, 2e-5, -1e-4, 1.0, np.nan)
JOINTS = st.builds(
    Joints,
    st.sampled_from(((), ('runner_joint',), ('arm',))),
    st.lists(st.sampled_from(POSITIONS), max_size=1).map(tuple),
    st.lists(st.sampled_from(VELOCITIES), max_size=2).map(tuple),
)


def numbers(*choices):
    return st.sampled_from(choices).map(lambda value: (float(value),))


def requests_with(faults):
    """Draw a request; about one in six is bad."""
    values = {
        'voltage': numbers(0.0, 100.0, 299.0, -1.0),
        'steps': numbers(0, 1, -3, 1000),
        'jog': numbers(0.0, 1000.0, -1000.0, 1e9),
        'sawtooth': st.tuples(numbers(100.0, 1e3), numbers(1e3, -2e3), numbers(0, 2)).map(
            lambda each: each[0] + each[1] + each[2]
        ),
        'waveform': st.sampled_from(
            ((0.0, 100.0, 2e-3, 150.0), (0.0, 60.0, 1e-320, 140.0, 1e300, 90.0), (0.0, 100.0))
        ),
        'position': numbers(0.0, 2e-8, -1e-6, 1e6, 1.7e308).map(lambda x: (*x, 0.0, 0.0)),
        'load': numbers(0.0, 0.05, -0.5, 1e3).map(lambda x: (*x, 0.0, 0.0, 0.0, 0.0, 0.0)),
        'preload': numbers(0.4, 0.55, 0.0),
        'enable_amplifier': numbers(0, 1, 1),
    }
    plain = ('stop', 'reset', 'zero_position', 'tare_force', 'clear_faults')
    built = [st.builds(Request, st.just(name), each) for name, each in values.items()]
    broken = st.dictionaries(st.sampled_from(sorted(faults)), st.none(), min_size=1, max_size=2)
    fault = broken.flatmap(lambda names: st.fixed_dictionaries({k: faults[k] for k in names})).map(
        lambda chosen: Request('fault', settings=tuple(chosen.items()))
    )
    bad = st.builds(Request, st.sampled_from((*MOVES, 'fly')), st.just((float('nan'),)))
    joint = st.builds(Request, st.just('joint'), joints=JOINTS)
    closed = ((0.0, 100.0, 7e-4, 150.0, 1.3e-3, 100.0), (0.0, 20.0, 3e-3, 90.0, 3.1e-3, 20.0))
    again = st.builds(
        Request, st.just('waveform'), st.sampled_from(closed), cycles=st.sampled_from((0, 2, 1000))
    )
    return st.one_of(*built, joint, again, st.sampled_from(plain).map(Request), fault, fault, bad)


def sequences(faults):
    due = st.lists(requests_with(faults), max_size=3)
    return st.lists(due, min_size=BLOCKS, max_size=BLOCKS)


def _assert_consistent(status, is_faulty):
    assert not status & Status.IN_POSITION or status & Status.CLOSED_LOOP
    assert not status & Status.STREAMING or status & Status.MOVING
    assert not status & FAILURE_BITS or status & Status.MOVEMENT_FAILED
    assert not status & Status.MOVEMENT_FAILED or not status & (Status.MOVING | Status.CLOSED_LOOP)
    if not status & Status.AMPLIFIER_ENABLED:
        assert not status & (Status.MOVING | Status.CLOSED_LOOP)
    assert bool(status & Status.FAULT) == is_faulty


def _open_names(names, events):
    """Return commands without an event, except set points that a later one has replaced."""
    reported = {event.number for event in events}
    refused = {event.number for event in events if event.result in REFUSALS}
    taken = {number: name for number, name in enumerate(names, start=1) if number not in refused}
    return [
        name
        for number, name in enumerate(names, start=1)
        if number not in reported
        and not (name in SET_POINTS and any(n > number and o == name for n, o in taken.items()))
    ]


def _assert_moves_match(status, open_names):
    """Check that a move or a preload without its event is under way, and nothing else."""
    moves = [name for name in open_names if name in MOVES]
    lone = [name for name in moves if name not in SILENT]
    if not status & Status.MOVE_DELAYED:
        assert len(lone) <= 1
        assert not lone or status & Status.MOVING
        assert open_names.count('preload') <= 1
        assert 'preload' not in open_names or status & Status.PRELOADING
    assert not status & Status.MOVING or moves


def _assert_reported_once(names, events, replaced):
    ends = Counter(event.number for event in events if event.command != 'hold')
    holds = [event.number for event in events if event.command == 'hold']
    assert set(ends.values()) <= {1}
    assert len(set(holds)) == len(holds)
    assert {names[number - 1] for number in holds} <= {'position', 'joint'}
    assert all(e.message for e in events if e.result is not Result.DONE)
    assert all(e.command in (names[e.number - 1], 'hold') for e in events)
    untold = {number for number in range(1, len(names) + 1) if number not in ends}
    counted = [number for number in untold if names[number - 1] not in SILENT]
    assert {names[number - 1] for number in counted} <= SET_POINTS
    assert len(counted) == replaced if len(counted) == len(untold) else len(counted) <= replaced


@given(stand=stands(), sequence=sequences(FAULTS | DELAYS))
@settings(deadline=None, max_examples=EXAMPLES)
def test_whatever_is_asked_and_broken_all_is_finite_consistent_and_told_once(stand, sequence):
    bench = Bench(stand)
    names: list[str] = []
    events: list[Event] = []
    for due in (*sequence, [Request('reset')]):
        names += [request.name for request in due]
        output = bench.update(bench.time_ns + MS, due)
        events += output.events
        assert np.isfinite(output.readings.trace[:, :POSITION]).all()
        assert np.isfinite((output.readings.truth_position_m, output.readings.truth_force_n)).all()
        assert np.isfinite(output.ramps).all()
        assert np.isfinite(bench.ledger.residual_j)
        _assert_consistent(output.status, bool(bench.faults.names))
        _assert_moves_match(output.status, _open_names(names, events))
    _assert_reported_once(names, events, bench.replaced)
    assert not output.status & (Status.MOVING | Status.CLOSED_LOOP | Status.MOVE_DELAYED)


@given(stand=stands(), sequence=sequences(FAULTS | DELAYS))
@settings(deadline=None, max_examples=EXAMPLES // 4)
def test_the_same_sequence_on_the_same_stand_gives_the_same_bytes(stand, sequence):
    requests = {n * MS: due for n, due in enumerate(sequence)}
    first, second = (drive_bench(Bench(stand), BLOCKS * MS, requests) for _ in range(2))
    assert first.trace.tobytes() == second.trace.tobytes()
    assert first.ramps.tobytes() == second.ramps.tobytes()
    assert (first.events, first.status) == (second.events, second.status)


@given(stand=stands(), sequence=sequences(FAULTS))
@settings(deadline=None, max_examples=EXAMPLES // 4)
def test_the_length_of_an_update_does_not_matter_to_moves_that_are_not_watched(stand, sequence):
    stand = stand.updated({'limits.soft_min': 0.0, 'limits.soft_max': 0.0})
    requests = {
        n * MS: [each for each in due if each.name not in WATCHED]
        for n, due in enumerate(sequence)
    }
    whole = drive_bench(Bench(stand), BLOCKS * MS, requests)
    parts = drive_bench(Bench(stand), BLOCKS * MS, requests, step_ns=MS // 5)
    assert whole.trace.tobytes() == parts.trace.tobytes()
    assert whole.ramps.tobytes() == parts.ramps.tobytes()
