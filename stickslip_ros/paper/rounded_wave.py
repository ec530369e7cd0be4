"""
A saw-tooth with rounded corners: the amplifier's output behind a first-order low-pass.

The output of the amplifier is a saw-tooth whose fall takes a finite time, so it consists of two
straight stretches. Behind a low-pass of time constant tau a straight input a + b t becomes
a + b (t - tau) + C exp(-t/tau); that the wave repeats itself fixes C. The drive rides along
straight stretches, so the wave is cut into pieces, short where it bends.

"""

import math
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, RAMP_START, ride
from stickslip_ros.drive.passes import allow_passes

PIECES = 64
"""Pieces of the fall; after it come twice as many."""
BEND_TAUS = 12.0
"""Time constants after the fall in which the wave bends; what is left of the bend is 6e-6."""
END_SLACK = 1e-9
"""A node nearer to the end of the period than this share of it is the end."""


@dataclass(frozen=True)
class RoundedWave:
    """
    One period of a saw-tooth behind a first-order low-pass, in its periodic state.

    Attributes
    ----------
    amplitude_v : float
        Height of the saw-tooth before the low-pass.
    period_s : float
        Its period.
    slew_v_per_s : float
        Slope of its fall.
    tau_s : float
        Time constant 1/(2 pi bandwidth); 0 is no low-pass.

    """

    amplitude_v: float
    period_s: float
    slew_v_per_s: float
    tau_s: float

    @property
    def fall_s(self) -> float:
        """Time from the top until the falling output meets the next ramp, s."""
        return self.amplitude_v / (self.slew_v_per_s + self.amplitude_v / self.period_s)

    @property
    def mean_v(self) -> float:
        """Mean of the wave, V: a low-pass leaves it alone."""
        bottom_v = self.amplitude_v * self.fall_s / self.period_s
        return 0.5 * (self.amplitude_v + bottom_v)

    def voltage_v(self, time_s: Array) -> Array:
        """
        Return the wave, V; time 0 is the top of the saw-tooth before the low-pass.

        Parameters
        ----------
        time_s : array
            Times from 0 to the period, any shape.

        """
        time_s = np.asarray(time_s, dtype=float)
        fall_s, fall, ramp = self.fall_s, -self.slew_v_per_s, self.amplitude_v / self.period_s
        after_s = np.maximum(time_s - fall_s, 0.0)
        lag_v = self._lag_at_top()
        bottom_lag_v = fall * self.tau_s + (lag_v - fall * self.tau_s) * self._decay(fall_s)
        falling_v = self.amplitude_v + fall * (time_s - self.tau_s)
        falling_v += (fall * self.tau_s - lag_v) * self._decay(time_s)
        rising_v = ramp * (time_s - self.tau_s)
        rising_v += (ramp * self.tau_s - bottom_lag_v) * self._decay(after_s)
        return np.where(time_s < fall_s, falling_v, rising_v)

    def nodes_s(self, pieces: int = PIECES) -> Array:
        """Return the ends of the straight pieces, s: one period, short pieces where it bends."""
        fall_s = self.fall_s
        bend_s = min(BEND_TAUS * self.tau_s, self.period_s - fall_s)
        nodes = np.linspace(0.0, fall_s, pieces + 1)
        if bend_s > 0.0:
            # The chord of a piece of length h misses h^2 exp(-t/tau): alike on all pieces.
            share = np.linspace(0.0, 1.0, 2 * pieces + 1)[1:]
            left = 1.0 - np.exp(-0.5 * bend_s / self.tau_s)
            bending = fall_s - 2.0 * self.tau_s * np.log(1.0 - share * left)
            nodes = np.append(nodes, bending)
        before_end = nodes[nodes < self.period_s * (1.0 - END_SLACK)]
        return np.append(before_end, self.period_s)

    def table(self, pieces: int = PIECES) -> tuple[Array, Array]:
        """
        Return the wave in straight pieces, from its lowest point on.

        Parameters
        ----------
        pieces : int
            Pieces of the fall.

        Returns
        -------
        tuple of array, each of shape (n,)
            Voltage at the start of each piece, V, and its length, s. The last one leads back to
            the first voltage.

        """
        nodes_s = self.nodes_s(pieces)
        voltages_v = self.voltage_v(nodes_s[:-1])
        lowest = int(np.argmin(voltages_v))
        return np.roll(voltages_v, -lowest), np.roll(np.diff(nodes_s), -lowest)

    def _lag_at_top(self) -> float:
        """Return by how much the wave is below the saw-tooth at its top, V."""
        fall_s, slew = self.fall_s, self.slew_v_per_s
        ramp = self.amplitude_v / self.period_s
        ramp_decay = float(self._decay(self.period_s - fall_s))
        whole_decay = float(self._decay(self.period_s))
        lag = ramp - (slew + ramp) * ramp_decay + slew * whole_decay
        return self.tau_s * lag / (1.0 - whole_decay)

    def _decay(self, time_s: Array | float) -> Array:
        """Return exp(-t/tau); without a low-pass a bend is over at once."""
        if self.tau_s == 0.0:
            return np.zeros_like(time_s, dtype=float)
        return np.asarray(np.exp(-np.asarray(time_s) / self.tau_s))


def time_constant_s(bandwidth_hz: float) -> float:
    """Return the time constant of a first-order low-pass, s; that of an infinite one is 0."""
    return 1.0 / (2.0 * math.pi * bandwidth_hz)


@entry_point
def ride_pieces(
    plants: Record, states: Record, voltages_v: Array, spans_s: Array, log: Array
) -> None:
    """
    Advance the drive along a wave in pieces, one period per row of the log.

    Parameters
    ----------
    plants, states : array of one record of PLANT, of STATE
        The drive, at the first voltage; its state is changed in place.
    voltages_v, spans_s : array, shape (n,)
        Start and length of each piece; the last one leads back to the first voltage.
    log : array, shape (periods, 3)
        Receives position at the start, mean and final position of each period, m.

    """
    plant, state, pieces = plants[0], states[0], len(spans_s)
    for period in range(len(log)):
        log[period, RAMP_START] = state.position_m
        before_m_s = state.sums.position_m_s
        whole_s = 0.0
        for i in range(pieces):
            start_v, end_v = voltages_v[i], voltages_v[(i + 1) % pieces]
            rate_v_per_s = (end_v - start_v) / spans_s[i]
            allow_passes(plant, state, 0, spans_s[i])
            ride(plant, state, start_v, rate_v_per_s, 0.0, spans_s[i])
            whole_s += spans_s[i]
        log[period, RAMP_MEAN] = (state.sums.position_m_s - before_m_s) / whole_s
        log[period, RAMP_END] = state.position_m
