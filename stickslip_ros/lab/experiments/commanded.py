# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Voltage and load that were commanded during a recording of this package.

A run with the commands misses its recording only by the noise of the sensors. A wave recognised in
samples at 50 kHz misses it by 4 to 22 times that, as a fall lies anywhere between two samples.

"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import TIME, VOLTAGE, Wave
from stickslip_ros.drive.waveform import level, repeats
from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.instrument.commands import LIVE, Request, check_request
from stickslip_ros.instrument.stand import is_other_drive
from stickslip_ros.lab.experiments.experiment import Voltage
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.units import NANO

JUMP_S = 1e-9
"""Duration of a jump of the commanded voltage: shorter than a fall of any amplifier."""
_OFF = 0.02
"""Largest difference of commanded and measured voltage, as a share of the range; and the share of
samples that may exceed it, within falls."""
_PLAYED = 'sawtooth', 'steps', 'waveform', 'voltage'
_MOVES = 'jog', 'position', 'joint', 'trajectory', 'enable_amplifier', 'reset'
"""Commands that change the voltage in an unknown way."""
_PRESENT = level(math.nan)  # the voltage held by a stop
_CHANGES = 'load', 'preload', 'reset', 'zero_position', 'tare_force', 'fault', 'clear_faults'
"""Commands that change the stand or the reading of a sensor."""


class CommandedWave(NamedTuple):
    """A commanded wave and its start."""

    since_s: float
    wave: Wave | None  # None if the voltage is unknown


class Commanded(NamedTuple):
    """Voltage, load and settings commanded during a part of a recording."""

    # None after a jog, a closed loop or a start before the recording, or if the samples disagree
    voltage: Voltage | None = None
    load_n: float = 0.0  # external force on the runner
    settings: Mapping[str, Scalar] = MappingProxyType({})  # parameters that were changed


def commanded(
    recording: Recording, stand: Parameters, samples: tuple[Array, Array], end_s: float
) -> Commanded:
    """
    Return the commands during a part of a recording that ends at ``end_s``.

    ``recording`` must be whole, as earlier commands may still hold; ``samples`` are times, s, and
    voltages, V, of the piezo in the part, both of shape (n,). Raises RecordingError if load,
    preload, friction, mass, damping, faults or the zero of a sensor change within the part.

    """
    begins_s, rests_v = (float(each[0]) for each in samples)
    if begins_s < 2.0 / stand.trace.sample_rate:  # the run began at rest
        begins_s, rests_v = 0.0, stand.amplifier.voltage_initial
    asked = list[CommandedWave]()
    load_n, settings = 0.0, dict[str, Scalar]()
    for at_ns, request in recorded_requests(recording):
        at_s, name = at_ns * NANO, request.name
        if at_s >= end_s:
            break
        try:
            value = check_request(request, stand)
        except StickSlipError:
            continue  # the drive refused it, too
        after = stand.updated(value) if name == LIVE else stand
        if at_s > begins_s and (name in _CHANGES or is_other_drive(stand, after)):
            problem = f'holds the command {name} at {at_s:.6g} s, which a model cannot follow'
            hint = 'choose a window without it: --window LENGTH@START'
            raise RecordingError(recording.path, problem, hint)
        stand = after
        asked += _asked_by(request, at_s, value, asked[-1:])
        load_n = {'load': value, 'reset': 0.0}.get(name, load_n)
        if name == 'preload':
            settings['stand.preload'] = value
    before = [each for each in asked if each.since_s < begins_s]
    if not before or before[-1].wave is _PRESENT:
        before = [CommandedWave(begins_s - JUMP_S, level(rests_v))]
    played = [before[-1], *(each for each in asked if each.since_s >= begins_s)]
    return Commanded(_voltage(played, samples, begins_s, end_s), load_n, settings)


def _asked_by(
    request: Request, at_s: float, value: Any, before: Sequence[CommandedWave]
) -> list[CommandedWave]:
    """Return the wave that a command begins, if any; ``before`` is the wave before."""
    name = request.name
    if name in _MOVES:
        return [CommandedWave(at_s, None)]
    last = before[0].wave if before else None
    if name == 'stop' and last:
        return [CommandedWave(at_s, _PRESENT)]
    if name not in _PLAYED or value is None:
        return []
    if len(value.rows) and last and repeats(last):  # a table waits for the end of another
        until_s = before[0].since_s + last.cycles * last.period_s
        value = None if at_s < until_s else value
    return [CommandedWave(at_s, value)]


def _voltage(
    played: Sequence[CommandedWave], samples: tuple[Array, Array], begins_s: float, end_s: float
) -> Voltage | None:
    """Return the voltage of waves, or None if a wave is unknown or the samples disagree."""
    if not all(each.wave for each in played):
        return None
    rows = _corners(played, begins_s, end_s)
    off_v = np.abs(np.interp(samples[0], *rows.T) - samples[1])
    if np.quantile(off_v, 1.0 - _OFF) > _OFF * np.ptp(rows[:, VOLTAGE]):
        return None
    rows[:, TIME] -= begins_s
    return Voltage(rows, ('as commanded',), begins_s)


def _corners(asked: Sequence[CommandedWave], begins_s: float, end_s: float) -> Array:
    """Return the corners of successive waves, shape (n, 2)."""
    ends = [*(each.since_s for each in asked[1:]), end_s]
    found = list[Array]()
    for (since_s, wave), until_s in zip(asked, ends, strict=True):
        assert wave is not None
        if wave is _PRESENT:
            wave = level(found[-1][-1, VOLTAGE])  # noqa: PLW2901
        start_s = max(since_s, begins_s)
        found.append(_corners_of(wave, start_s - since_s, until_s - since_s))
        found[-1][:, TIME] += since_s
    rows: Array = np.concatenate(found)
    rows[:, TIME] = np.maximum.accumulate(rows[:, TIME])
    time_s = rows[:, TIME]
    is_same = np.diff(time_s) < JUMP_S  # keep the first and last corner of a jump
    rows = rows[~(np.append(False, is_same) & np.append(is_same, False))]
    jumps = np.flatnonzero(np.diff(rows[:, TIME]) < JUMP_S)
    rows[jumps + 1, TIME] = rows[jumps, TIME] + JUMP_S
    return rows


def _corners_of(wave: Wave, start_s: float, end_s: float) -> Array:
    """Return the corners of a wave between two times; two corners at one time are a jump."""
    ramp = (0.0, wave.start_v), (wave.period_s, wave.start_v + wave.rise_v)
    cycle = wave.rows if len(wave.rows) else np.array(ramp)
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
