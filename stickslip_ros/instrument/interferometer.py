"""
Kernel: the laser interferometer, from the true position of the runner to the reading.

In this order: loss of the beam, cyclic error, drift of the zero, white noise, low-pass, samples of
its own, latency, faults, zero, quantisation. docs/explanation/sensors.md has the formulas.

"""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import FLAG, FLOAT, Record, kind, record
from stickslip_ros.instrument.signal_chain import displayed, low_pass_gain, standing
from stickslip_ros.parameters import InterferometerParameters

ON_TIME = 1e-9
"""A sample of its own that is late by less than this share of its period is on time."""

OPTICS = kind(
    step_max_m=FLOAT,
    cyclic_error_m=FLOAT,
    fringe_rad_per_m=FLOAT,
    drift_m=FLOAT,
    walk_m=FLOAT,
    noise_m=FLOAT,
    gain=FLOAT,
    period=FLOAT,
    lag=FLOAT,
    resolution_m=FLOAT,
)
"""
Constants of an interferometer; times in samples of the trace.

Fields
------
step_max_m : float
    Longest way of the runner in one sample that can be counted; inf is any.
cyclic_error_m, fringe_rad_per_m : float
    Amplitude of the cyclic error, and its phase per distance.
drift_m, walk_m : float
    Drift of the zero in one sample: the steady one, and the rms of the random one.
noise_m : float
    Standard deviation of the white noise of one sample.
gain : float
    Share of the way that the low-pass goes to its input in one sample.
period, lag : float
    Time between two samples of its own, 0 where it has none, and age of a reading.
resolution_m : float
    Quantisation step; 0 is none.

"""

BEAM = kind(
    truth_m=FLOAT,
    lost=FLAG,
    wandered_m=FLOAT,
    level_m=FLOAT,
    counted_m=FLOAT,
    sample=FLOAT,
    held_m=FLOAT,
    standing_m=FLOAT,
    zero_m=FLOAT,
)
"""
State of an interferometer between two samples of the trace.

Fields
------
truth_m : float
    True position at the last sample; not a number before the first one.
lost : bool
    Whether the beam was lost.
wandered_m : float
    Random drift of the zero up to now.
level_m : float
    Output of the low-pass.
counted_m : float
    The same as long as the beam is there; after that the last count.
sample : float
    Number of its own sample that is shown; counted from time 0, at which it saw rest.
held_m : float
    Value of that sample.
standing_m : float
    Value behind the display, before the zero is subtracted.
zero_m : float
    Value that is shown as 0.

"""


def optics_of(setting: InterferometerParameters, rate_hz: float) -> Record:
    """Return the constants of an interferometer, a record of OPTICS."""
    return record(
        OPTICS,
        step_max_m=setting.velocity_max / rate_hz if setting.velocity_max > 0.0 else math.inf,
        cyclic_error_m=setting.cyclic_error,
        fringe_rad_per_m=4.0 * math.pi / setting.wavelength,
        drift_m=setting.drift / rate_hz,
        walk_m=setting.random_walk / math.sqrt(rate_hz),
        noise_m=setting.noise_density * math.sqrt(rate_hz / 2.0),
        gain=low_pass_gain(setting.bandwidth, rate_hz),
        period=rate_hz / setting.sample_rate if setting.sample_rate > 0.0 else 0.0,
        lag=setting.latency * rate_hz,
        resolution_m=setting.resolution,
    )


def find_beam(beam: Record, fault: Record, past_m: Array) -> None:
    """Find a lost beam: the count starts anew where the runner is."""
    past_m.fill(beam.level_m)
    beam.lost = False
    beam.counted_m = beam.held_m = beam.level_m
    beam.standing_m = beam.level_m + fault.offset


@kernel
def read_position(
    optics: Record,
    beam: Record,
    fault: Record,
    past_m: Array,
    number: int,
    truth_m: float,
    noise: float,
    walk: float,
) -> float:
    """
    Return the reading of one sample, m.

    Parameters
    ----------
    optics, beam, fault : record of OPTICS, BEAM, FAULT
        Constants; state, which is changed; what is broken.
    past_m : array
        Ring of the latest counts, as long as the latency; changed in place.
    number : int
        Number of the sample, from 1 on.
    truth_m : float
        True position.
    noise, walk : float
        Unit noise of the reading, and of the random drift.

    """
    _count(optics, beam, number, truth_m, noise, walk)
    past_m[number % len(past_m)] = beam.counted_m
    time = number - optics.lag
    if optics.period > 0.0:
        newest = math.floor(time / optics.period + ON_TIME)
        if newest > beam.sample:
            beam.sample = float(newest)
            beam.held_m = _remembered(past_m, min(beam.sample * optics.period, time))
    else:
        beam.held_m = _remembered(past_m, time)
    beam.standing_m = standing(fault, beam.standing_m, beam.held_m + fault.offset)
    return displayed(fault, beam.standing_m, beam.zero_m, optics.resolution_m)


@kernel
def _count(
    optics: Record, beam: Record, number: int, truth_m: float, noise: float, walk: float
) -> None:
    """Advance from the light to the count."""
    if abs(truth_m - beam.truth_m) > optics.step_max_m:
        beam.lost = True
    beam.truth_m = truth_m
    beam.wandered_m += optics.walk_m * walk
    seen_m = truth_m + (optics.drift_m * number + beam.wandered_m)
    if optics.cyclic_error_m > 0.0:
        seen_m += optics.cyclic_error_m * math.sin(optics.fringe_rad_per_m * truth_m)
    beam.level_m += optics.gain * (seen_m + optics.noise_m * noise - beam.level_m)
    if not beam.lost:
        beam.counted_m = beam.level_m


@kernel
def _remembered(past_m: Array, time: float) -> float:
    """Return the count at a time, in samples of the trace: linear between two of them."""
    before = math.floor(time)
    share = time - before
    count_m = past_m[int(before) % len(past_m)]
    if share > 0.0:
        count_m += share * (past_m[(int(before) + 1) % len(past_m)] - count_m)
    return float(count_m)
