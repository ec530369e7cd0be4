# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the commands of a recording of this package say: the voltage they ask for, and the load."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import TIME, VOLTAGE, Wave
from stickslip_ros.drive.waveform import level, repeats
from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.instrument.commands import check_request
from stickslip_ros.lab.experiments.experiment import Voltage
from stickslip_ros.lab.runs.recorded import numbers_of
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.units import NANO

JUMP_S = 1e-9
"""What a jump of the commanded voltage takes: less than any amplifier, more than no time."""
AGREES_SHARE, AGREES_MOSTLY = 0.01, 0.98
"""Share of the range by which the voltage of the piezo may be off the commanded one, and the share
of the samples that must be so near; the others lie within falls."""
_PLAYED = 'sawtooth', 'steps', 'waveform', 'voltage'
_MOVES = 'jog', 'position', 'joint', 'trajectory', 'enable_amplifier', 'reset'
"""What changes the voltage as no table of it says."""
_PRESENT = level(math.nan)  # what a stop holds
_CHANGES = 'load', 'preload', 'reset', 'zero_position', 'tare_force', 'fault', 'clear_faults'
"""What changes the stand, or what a sensor shows."""


class Asked(NamedTuple):
    """A wave that was asked for, from a time on, s; None where the voltage is not known."""

    since_s: float
    wave: Wave | None
    said: str

    def repeats_at(self, time_s: float) -> bool:
        """Return whether it is a table that still repeats, for whose end another table waits."""
        wave = self.wave
        return (
            wave is not None
            and repeats(wave)
            and time_s < self.since_s + wave.cycles * wave.period_s
        )


class Commanded(NamedTuple):
    """
    What commands say of a stretch of a recording.

    The voltage is None where they do not say: of a jog or a closed loop, of a run that began
    before the recording, and where the piezo had another.

    """

    voltage: Voltage | None
    load_n: float = 0.0  # external force on the runner
    settings: Mapping[str, Scalar] = MappingProxyType({})  # parameters that they have changed


NOTHING_ASKED = Commanded(None)


def commanded(
    recording: Recording, stand: Parameters, samples: tuple[Array, Array], end_s: float
) -> Commanded:
    """
    Return what the commands of a recording say of a stretch of it.

    Parameters
    ----------
    recording : Recording
        The whole of it: what was asked for before the stretch may still hold.
    stand : Parameters
        The stand of the recording.
    samples : (times, voltages), arrays of shape (n,)
        Those of the piezo in the stretch, s and V.
    end_s : float
        Where the stretch ends, s.

    Raises
    ------
    RecordingError
        If load, preload, faults or the zero of a sensor are changed within it.

    """
    begins_s, rests_v = (float(each[0]) for each in samples)
    if begins_s < 2.0 / stand.trace.sample_rate:  # the first sample of a run, which began at rest
        begins_s, rests_v = 0.0, stand.amplifier.voltage_initial
    asked = list[Asked]()
    load_n, settings = 0.0, dict[str, Scalar]()
    for at_ns, request in recorded_requests(recording):
        at_s, name = at_ns * NANO, request.name
        if at_s >= end_s:
            break
        if name in _CHANGES and at_s > begins_s:
            problem = f'holds the command {name} at {at_s:.6g} s, which no run of a model follows'
            hint = 'name a stretch without it: --window LENGTH@START'
            raise RecordingError(recording.path, problem, hint)
        try:
            value = check_request(request, stand)
        except StickSlipError:
            continue  # the drive has refused it, too
        if name in _MOVES:
            asked.append(Asked(at_s, None, ''))
        elif name == 'stop' and asked and asked[-1].wave:
            asked.append(Asked(at_s, _PRESENT, name))
        elif name in _PLAYED and value is not None:
            waits = len(value.rows) > 0 and bool(asked) and asked[-1].repeats_at(at_s)
            asked.append(Asked(at_s, None if waits else value, f'{name} {numbers_of(request)}'))
        load_n = {'load': value, 'reset': 0.0}.get(name, load_n)
        if name == 'preload':
            settings['stand.preload'] = value
    voltage = _voltage(_played(asked, begins_s, rests_v), samples, begins_s, end_s)
    return Commanded(voltage, load_n, settings)


def _played(asked: Sequence[Asked], begins_s: float, rests_v: float) -> list[Asked]:
    """Return what was asked for in a stretch; at first what came before it, or a rest."""
    before = [each for each in asked if each.since_s < begins_s]
    if not before or before[-1].wave is _PRESENT:
        before = [Asked(begins_s - JUMP_S, level(rests_v), '')]
    return [before[-1], *(each for each in asked if each.since_s >= begins_s)]


def _voltage(
    played: Sequence[Asked], samples: tuple[Array, Array], begins_s: float, end_s: float
) -> Voltage | None:
    """Return the voltage of waves, where they are known and the samples agree."""
    if not all(each.wave for each in played):
        return None
    rows = _corners(played, begins_s, end_s)
    off_v = np.abs(np.interp(samples[0], *rows.T) - samples[1])
    if np.mean(off_v <= AGREES_SHARE * np.ptp(rows[:, VOLTAGE])) < AGREES_MOSTLY:
        return None
    said = [f'{each.since_s:.6f} s on: {each.said}' for each in played if each.said]
    rows[:, TIME] -= begins_s
    return Voltage(rows, ('as it was commanded', *said), begins_s)


def _corners(asked: Sequence[Asked], begins_s: float, end_s: float) -> Array:
    """Return the corners of waves, each of which replaces the one before, shape (n, 2)."""
    ends = [*(each.since_s for each in asked[1:]), end_s]
    found = list[Array]()
    for (since_s, wave, _), until_s in zip(asked, ends, strict=True):
        assert wave is not None
        if wave is _PRESENT:
            wave = level(found[-1][-1, VOLTAGE])  # noqa: PLW2901
        start_s = max(since_s, begins_s)
        found.append(_corners_of(wave, start_s - since_s, until_s - since_s))
        found[-1][:, TIME] += since_s
    rows: Array = np.concatenate(found)
    rows[:, TIME] = np.maximum.accumulate(rows[:, TIME])
    time_s = rows[:, TIME]
    is_same = np.diff(time_s) < JUMP_S  # a jump; of what meets in it the first and last count
    rows = rows[~(np.append(False, is_same) & np.append(is_same, False))]
    jumps = np.flatnonzero(np.diff(rows[:, TIME]) < JUMP_S)
    rows[jumps + 1, TIME] = rows[jumps, TIME] + JUMP_S
    return rows


def _corners_of(wave: Wave, start_s: float, end_s: float) -> Array:
    """Return the corners of a wave between two times of its own; two at one time are a jump."""
    cycle = (
        wave.rows
        if len(wave.rows)
        else np.array(((0.0, wave.start_v), (wave.period_s, wave.start_v + wave.rise_v)))
    )
    first = min(math.floor(start_s / wave.period_s), wave.cycles)
    last = min(math.ceil(end_s / wave.period_s), wave.cycles)
    found = [cycle + np.array((k * wave.period_s, 0.0)) for k in range(first, last)]
    ended_s = wave.cycles * wave.period_s
    if ended_s < end_s:
        found.append(np.array(((ended_s, wave.start_v), (end_s, wave.start_v))))
    rows = np.concatenate(found)
    inside = (rows[:, TIME] > start_s) & (rows[:, TIME] < end_s)
    after = max(int(np.searchsorted(rows[:, TIME], start_s, 'right')), 1)
    before = min(int(np.searchsorted(rows[:, TIME], end_s, 'left')), len(rows) - 1)
    ends = [
        (at_s, np.interp(at_s, *rows[k - 1 : k + 1].T))
        for at_s, k in ((start_s, after), (end_s, before))
    ]
    return np.concatenate((ends[:1], rows[inside], ends[1:]))
