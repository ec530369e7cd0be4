"""
Kernel: the load cell, from the true force in its spring to the reading.

In this order: hysteresis of the mechanics, white noise of bridge and amplifier, low-pass of the
electronics, drift of the zero, faults, saturation, tare, quantisation.
docs/sensors.md has the formulas.

"""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import FLAG, FLOAT, Record, kind, record
from stickslip_ros.instrument.signal_chain import (
    LOOP,
    PLAYS,
    displayed,
    follow,
    loop_of,
    low_pass_gain,
    standing,
)
from stickslip_ros.parameters import LoadCellParameters

CELL = kind(
    loop=LOOP,
    noise_n=FLOAT,
    gain=FLOAT,
    drift_n=FLOAT,
    limit_n=FLOAT,
    resolution_n=FLOAT,
)
"""
Constants of a load cell.

Fields
------
loop : record of LOOP
    Its hysteresis.
noise_n : float
    Standard deviation of the white noise of one sample.
gain : float
    Share of the way that the low-pass goes to its input in one sample.
drift_n : float
    Drift of the zero in one sample.
limit_n : float
    Force at which it saturates; inf is none.
resolution_n : float
    Quantisation step; 0 is none.

"""

STRAIN = kind(
    level_n=FLOAT,
    standing_n=FLOAT,
    zero_n=FLOAT,
    overrange=FLAG,
    plays_n=(FLOAT, (PLAYS,)),
)
"""
State of a load cell between two samples of the trace.

Fields
------
level_n : float
    Output of the low-pass.
standing_n : float
    Value behind the display, before the tare is subtracted.
zero_n : float
    Value that is shown as 0.
overrange : bool
    Whether a sample of the last block reached the limit.
plays_n : array, shape (PLAYS,)
    Plays of the hysteresis.

"""


def cell_of(setting: LoadCellParameters, rate_hz: float) -> Record:
    """Return the constants of a load cell, a record of CELL."""
    return record(
        CELL,
        loop=loop_of(setting.hysteresis, setting.range),
        noise_n=setting.noise_density * math.sqrt(rate_hz / 2.0),
        gain=low_pass_gain(setting.bandwidth, rate_hz),
        drift_n=setting.drift / rate_hz,
        limit_n=setting.range if setting.range > 0.0 else math.inf,
        resolution_n=setting.resolution,
    )


@kernel
def read_force(
    cell: Record, strain: Record, fault: Record, number: int, truth_n: float, noise: float
) -> float:
    """
    Return the reading of one sample, N.

    Parameters
    ----------
    cell, strain, fault : record of CELL, STRAIN, FAULT
        Constants; state, which is changed; what is broken.
    number : int
        Number of the sample, from 1 on.
    truth_n : float
        True force in the spring.
    noise : float
        Unit noise of the reading.

    """
    force_n = truth_n
    if cell.loop.weight > 0.0:
        force_n = follow(cell.loop, strain.plays_n, force_n)
    strain.level_n += cell.gain * (force_n + cell.noise_n * noise - strain.level_n)
    sensed_n = strain.level_n + cell.drift_n * number + fault.offset
    if abs(sensed_n) >= cell.limit_n:
        sensed_n = math.copysign(cell.limit_n, sensed_n)
        strain.overrange = True
    strain.standing_n = standing(fault, strain.standing_n, sensed_n)
    return displayed(fault, strain.standing_n, strain.zero_n, cell.resolution_n)
