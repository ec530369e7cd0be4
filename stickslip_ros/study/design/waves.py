"""Waves that a search may try: a shape with its numbers, a voltage, a frequency, a preload."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import slew_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.checks import FREQUENCY_MIN_HZ
from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.study.design.shapes import (
    CURVE_ROWS,
    KNOTS_MAX,
    KNOTS_MIN,
    mirrored,
    shape_of,
    spline,
)
from stickslip_ros.study.design.steady_cycle import playable

SPLINE = 'spline'
SHORTEST = 1e-3
"""Time between two knots of a spline, relative to the longest one of it."""
LOWEST = 1e-3
"""Height between two knots, relative to the largest possible, before all are scaled."""
SMALLEST = 0.02
"""Smallest voltage of a wave, as a share of the largest."""
SLEW_SHARE = 0.9
"""Share of a cycle that rise and fall at the slew rate may take."""


@dataclass(frozen=True)
class PeriodicWave:
    """
    A periodic wave.

    Attributes
    ----------
    shape : str
        ``spline``, or one of SHAPES.
    values : mapping
        Parameters of the shape; of a spline its knots.
    voltage_v : float
        Peak to peak, from ``amplifier.voltage_min`` on.
    frequency_hz : float
        Cycles per second.
    preload_n : float
        Preload under which it is played, N.

    """

    shape: str
    values: Mapping[str, float] | Mapping[str, list[float]]
    voltage_v: float
    frequency_hz: float
    preload_n: float

    def rows(
        self, stand: Parameters, *, backwards: bool = False, curve_rows: int = CURVE_ROWS
    ) -> Array:
        """Return one cycle as rows of time (s) and voltage (V), as ``playable`` makes them."""
        make = spline if self.shape == SPLINE else shape_of(self.shape).rows
        unit = make(rows=curve_rows, **self.values)
        if backwards:
            unit = mirrored(unit)
        return playable(unit, stand, self.voltage_v, self.frequency_hz)

    def under(self, stand: Parameters) -> Parameters:
        """Return a stand with the preload of the wave."""
        return stand.updated({'stand.preload': self.preload_n})


@dataclass(frozen=True)
class Space:
    """
    The waves of one shape within the limits of a stand; its places are points of a unit cube.

    Attributes
    ----------
    shape : str
        ``spline``, or one of SHAPES.
    stand : Parameters
        Its amplifier gives range and slew rate.
    frequencies_hz : (float, float)
        Lowest and highest frequency.
    preloads_n : (float, float)
        Lowest and highest preload, N.
    knots : int
        Of a spline.

    """

    shape: str
    stand: Parameters
    frequencies_hz: tuple[float, float]
    preloads_n: tuple[float, float]
    knots: int = 8

    def __post_init__(self) -> None:
        """Refuse limits that no wave keeps."""
        if not KNOTS_MIN <= self.knots <= KNOTS_MAX:
            limit = f'not from {KNOTS_MIN} to {KNOTS_MAX}'
            raise OutOfRange('number of knots', self.knots, '', limit, 'change --knots')
        highest_hz = self.stand.amplifier.frequency_max
        for name, unit, (low, high), (least, most) in (
            ('frequency', 'Hz', self.frequencies_hz, (FREQUENCY_MIN_HZ, highest_hz)),
            ('preload', 'N', self.preloads_n, _bounds_of('stand.preload')),
        ):
            for value in (low, high):
                if not least <= value <= most:
                    limit = f'not from {least:g} to {most:g} {unit}'
                    raise OutOfRange(name, value, unit, limit, 'stay in these limits')
            if low > high:
                limit = f'above the end of its range, {high:g} {unit}'
                raise OutOfRange(name, low, unit, limit, 'give the lower one first')

    @property
    def plain(self) -> PeriodicWave:
        """The usual shape at the largest voltage, frequency and preload."""
        return self.wave(self.start)

    @property
    def start(self) -> Array:
        """Place of the shape with its usual numbers; a spline starts as a saw-tooth."""
        return np.array([*self._own(), *(1.0 for low, high in self._ranges() if low < high)])

    def wave(self, place: Sequence[float] | Array) -> PeriodicWave:
        """Return the wave of a place."""
        shares = [float(share) for share in place]
        own = shares[: len(self._own())]
        free = iter(shares[len(own) :])
        frequency_hz, share, preload_n = (
            low * (high / low) ** next(free) if low < high else low for low, high in self._ranges()
        )
        return PeriodicWave(
            self.shape,
            knots_of(own) if self.shape == SPLINE else self._traits(own),
            share * self.largest_v(frequency_hz),
            frequency_hz,
            preload_n,
        )

    def largest_v(self, frequency_hz: float) -> float:
        """Return the largest voltage that range and slew rate allow at a frequency, V."""
        amplifier = self.stand.amplifier
        range_v = amplifier.voltage_max - amplifier.voltage_min
        return min(range_v, 0.5 * SLEW_SHARE * slew_of(self.stand) / frequency_hz)

    def _ranges(self) -> tuple[tuple[float, float], ...]:
        """Return frequencies, shares of the largest voltage, preloads."""
        return self.frequencies_hz, (SMALLEST, 1.0), self.preloads_n

    def _own(self) -> list[float]:
        """Return where the shape itself starts."""
        if self.shape == SPLINE:
            rises = self.knots // 2
            return [1.0] * rises + [0.0] * (self.knots - rises) + [0.5] * self.knots
        traits = shape_of(self.shape).traits.values()
        return [(trait.usual - trait.low) / (trait.high - trait.low) for trait in traits]

    def _traits(self, shares: Sequence[float]) -> dict[str, float]:
        traits = shape_of(self.shape).traits.items()
        return {
            name: trait.low + (trait.high - trait.low) * share
            for (name, trait), share in zip(traits, shares, strict=True)
        }


def knots_of(shares: Sequence[float]) -> dict[str, list[float]]:
    """
    Return the knots of a spline from 2 n shares: n times between knots, n heights between them.

    The times are logarithmic, from 1/1000 of the longest on. The first half of the knots rises.

    """
    count = len(shares) // 2
    lasts = SHORTEST ** (1.0 - np.array(shares[:count]))
    heights = LOWEST + np.array(shares[count:])
    rises = count // 2
    up, down = np.cumsum(heights[:rises]), np.cumsum(heights[rises:])
    times = np.cumsum(lasts)
    return {
        'times': [0.0, *(times[:-1] / times[-1]).tolist(), 1.0],
        'heights': [
            0.0,
            *(up[:-1] / up[-1]).tolist(),
            1.0,
            *(1.0 - down[:-1] / down[-1]).tolist(),
            0.0,
        ],
    }


def _bounds_of(name: str) -> tuple[float, float]:
    spec = spec_of(name)
    return spec.minimum or 0.0, spec.maximum or math.inf
