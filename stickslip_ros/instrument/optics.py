"""Kernels: from the true position of the runner to the reading of the interferometer."""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import entry_point, kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.instrument.display import Fault, displayed, standing

ON_TIME = 1e-9
"""A sample of its own that is late by less than this share of its period is on time."""


class Optics(NamedTuple):
    """
    Constants of an interferometer; times in samples of the trace.

    Attributes
    ----------
    step_max : float
        Longest way of the runner in one sample that can be counted, m; inf is any.
    cyclic_error, fringe : float
        Amplitude of the cyclic error, m, and its phase per distance, rad/m.
    drift, walk : float
        Drift of the zero in one sample, m: the steady one, and the rms of the random one.
    noise : float
        Standard deviation of the white noise of one sample, m.
    gain : float
        Share of the way that the low-pass goes to its input in one sample.
    period, lag : float
        Time between two samples of its own, 0 where it has none, and age of a reading.
    resolution : float
        Quantisation step, m; 0 is none.

    """

    step_max: float
    cyclic_error: float
    fringe: float
    drift: float
    walk: float
    noise: float
    gain: float
    period: float
    lag: float
    resolution: float


class Beam(NamedTuple):
    """
    State of an interferometer between two samples of the trace.

    Attributes
    ----------
    truth : float
        True position at the last sample, m; not a number before the first one.
    lost : float
        1 after the beam was lost, else 0.
    wandered : float
        Random drift of the zero up to now, m.
    level : float
        Output of the low-pass, m.
    counted : float
        The same as long as the beam is there; after that the last count, m.
    sample : float
        Number of its own sample that is shown; counted from time 0, at which it saw rest.
    held : float
        Value of that sample, m.
    standing : float
        Value behind the display, before the zero is subtracted, m.

    """

    truth: float = math.nan
    lost: float = 0.0
    wandered: float = 0.0
    level: float = 0.0
    counted: float = 0.0
    sample: float = 0.0
    held: float = 0.0
    standing: float = 0.0


@entry_point
def read_positions(
    optics: Optics,
    fault: Fault,
    beam: Beam,
    zero_m: float,
    samples: int,
    truth: Array,
    walks: Array,
    past: Array,
    readings: Array,
) -> Beam:
    """
    Replace unit noise in ``readings`` by readings of ``truth``; return the state after them.

    Parameters
    ----------
    optics, fault, beam
        Constants, what is broken, and state before.
    zero_m : float
        Value that is shown as 0, m.
    samples : int
        Number of samples of the trace before these.
    truth, readings : array, shape (samples,)
        True positions, m; unit noise, replaced by readings, m.
    walks : array, shape (samples,) or (0,)
        Unit noise of the random drift; empty where there is none.
    past : array
        Ring of the latest counts, m, as long as the latency; changed in place.

    """
    for i in range(len(truth)):
        walk = walks[i] if optics.walk > 0.0 else 0.0
        beam = _count(optics, beam, samples + i + 1, truth[i], walk, readings[i])
        past[(samples + i + 1) % len(past)] = beam.counted
        beam = _show(optics, fault, beam, samples + i + 1, past)
        readings[i] = displayed(fault, beam.standing, zero_m, optics.resolution)
    return beam


@kernel
def _count(
    optics: Optics, beam: Beam, number: int, truth: float, walk: float, noise: float
) -> Beam:
    """Advance from the light to the count, by one sample of the trace."""
    lost = 1.0 if abs(truth - beam.truth) > optics.step_max else beam.lost
    wandered = beam.wandered + optics.walk * walk
    seen = truth + (optics.drift * number + wandered)
    if optics.cyclic_error > 0.0:
        seen += optics.cyclic_error * math.sin(optics.fringe * truth)
    level = beam.level + optics.gain * (seen + optics.noise * noise - beam.level)
    counted = beam.counted if lost > 0.0 else level
    return Beam(truth, lost, wandered, level, counted, beam.sample, beam.held, beam.standing)


@kernel
def _show(optics: Optics, fault: Fault, beam: Beam, number: int, past: Array) -> Beam:
    """Advance from the count to the value behind the display, by one sample of the trace."""
    time = number - optics.lag
    sample = beam.sample
    held = beam.held
    if optics.period > 0.0:
        newest = math.floor(time / optics.period + ON_TIME)
        if newest > sample:
            sample = float(newest)
            held = _remembered(past, min(sample * optics.period, time))
    else:
        held = _remembered(past, time)
    value = standing(fault, beam.standing, held + fault.offset)
    return Beam(
        beam.truth, beam.lost, beam.wandered, beam.level, beam.counted, sample, held, value
    )


@kernel
def _remembered(past: Array, time: float) -> float:
    """Return the count at a time, in samples of the trace: linear between two of them."""
    before = math.floor(time)
    share = time - before
    count = past[int(before) % len(past)]
    if share > 0.0:
        count += share * (past[(int(before) + 1) % len(past)] - count)
    return float(count)
