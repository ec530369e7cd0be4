"""
Shapes of a periodic wave: one cycle from 0 to 1 and back, as rows of time and height.

The named ones are those of the literature on stick-slip and inertia drives, each with its own
parameters; the spline is free. A row is a corner; straight lines join them, and two rows of the
same time are a jump.

"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind

CURVE_ROWS = 48
"""Rows of each curved part; a converged answer does not depend on them."""
KNOTS_MIN, KNOTS_MAX = 6, 16
"""Knots of a spline in all; the first and the last, which is the first again, count once."""
TIME, HEIGHT = 0, 1
"""Columns of the rows of a shape."""


@dataclass(frozen=True)
class Trait:
    """A parameter of a shape: bounds, published (or else usual) value, and what it says."""

    low: float
    high: float
    usual: float
    text: str


@dataclass(frozen=True)
class Shape:
    """
    A named shape.

    Attributes
    ----------
    make : callable
        Makes its corners, an array of shape (n, 2), from the rows of a curve and its parameters.
    traits : mapping
        Its parameters.
    source : str
        Where it is described.

    """

    make: Callable[..., Array]
    traits: Mapping[str, Trait]
    source: str

    def rows(self, rows: int = CURVE_ROWS, **values: float) -> Array:
        """
        Return one cycle forwards; parameters that are left out have their usual values.

        Raises
        ------
        UnknownName, OutOfRange
            If the shape has no such parameter, or the value is outside its bounds.

        """
        chosen = {name: trait.usual for name, trait in self.traits.items()}
        for name, value in values.items():
            if name not in self.traits:
                hint = f'this shape has {", ".join(self.traits) or "none"}'
                raise UnknownName('parameter of a shape', name, hint)
            trait = self.traits[name]
            if not trait.low <= value <= trait.high:
                limit = f'not from {trait.low:g} to {trait.high:g}'
                raise OutOfRange(name, value, '', limit, trait.text)
            chosen[name] = value
        return self.make(rows, **chosen)


def mirrored(rows: Array) -> Array:
    """Return a cycle that moves the runner the other way: it starts at 1 and goes down."""
    return np.column_stack((rows[:, TIME], 1.0 - rows[:, HEIGHT]))


def shape_of(name: str) -> Shape:
    """Return a named shape; UnknownName lists them."""
    try:
        return SHAPES[name]
    except KeyError:
        raise UnknownName('shape', name, f'known are {", ".join(SHAPES)}') from None


def spline(
    times: Sequence[float] | Array, heights: Sequence[float] | Array, rows: int = CURVE_ROWS
) -> Array:
    """
    Return one cycle through knots: one monotone spline (PCHIP) up and one down.

    Parameters
    ----------
    times, heights : sequences of n + 1 numbers
        Knots from (0, 0) over one of height 1 to (1, 0); n is 6 to 16.
    rows : int
        Rows of each of the two curves, about.

    Raises
    ------
    WrongKind, OutOfRange
        If a number is not finite, the wave does not close, or the knots are out of order.

    """
    knots = np.array([times, heights], dtype=np.float64).T
    _check_knots(knots)
    top = int(np.argmax(knots[:, HEIGHT]))
    share = 2 * rows // (len(knots) - 1) + 1
    between = np.arange(share) / share
    at = (knots[:-1, TIME, None] + np.diff(knots[:, TIME])[:, None] * between).ravel()
    up, down = (PchipInterpolator(*part.T) for part in (knots[: top + 1], knots[top:]))
    height = np.where(at < knots[top, TIME], up(at), down(at))
    return np.vstack((np.column_stack((at, np.clip(height, 0.0, 1.0))), (1.0, 0.0)))


def _check_knots(knots: Array) -> None:
    """Refuse knots that make no closed wave of one rise and one fall."""
    if not KNOTS_MIN <= len(knots) - 1 <= KNOTS_MAX:
        limit = f'not from {KNOTS_MIN} to {KNOTS_MAX}'
        raise OutOfRange('number of knots', len(knots) - 1, '', limit, 'change their number')
    if not np.isfinite(knots).all():
        raise WrongKind('knot', knots[~np.isfinite(knots)][0], 'a finite number', 'correct it')
    ends = (*knots[0], *knots[-1])
    if ends != (0.0, 0.0, 1.0, 0.0):
        expected = 'a closed wave from (0, 0) to (1, 0)'
        raise WrongKind('first and last knot', ends, expected, 'close the wave')
    steps, top = np.diff(knots, axis=0), int(np.argmax(knots[:, HEIGHT]))
    if not (steps[:, TIME] > 0.0).all():
        row = int(np.argmin(steps[:, TIME] > 0.0)) + 1
        limit = f'not after that of knot {row}'
        raise OutOfRange(
            f'time of knot {row + 1}', float(knots[row, TIME]), '', limit, 'let the times rise'
        )
    falls = (steps[:top, HEIGHT] < 0.0).any() or (steps[top:, HEIGHT] > 0.0).any()
    if falls or knots[top, HEIGHT] != 1.0:
        expected = 'one rise to 1 and one fall'
        raise WrongKind('heights of the knots', knots[:, HEIGHT].tolist(), expected, 'order them')


def _corners(*corners: tuple[float, float]) -> Array:
    return np.array(corners, dtype=np.float64)


def _sawtooth(_: int, fall: float) -> Array:
    """Rise evenly; fall evenly in a share of the cycle."""
    return _corners((0.0, 0.0), (1.0 - fall, 1.0), (1.0, 0.0))


def _cycloid(rows: int) -> Array:
    """Trace t = 1/2 + (a - sin a)/2pi, y = (1 + cos a)/2: its cusp is on top."""
    angle: Array = np.linspace(-np.pi, np.pi, 2 * rows + 1, dtype=np.float64)
    time = 0.5 + (angle - np.sin(angle)) / (2.0 * np.pi)
    return np.column_stack((time, 0.5 * (1.0 + np.cos(angle))))


def _parabola(rows: int, rise: float) -> Array:
    """Rise as y = (t/r)^2; fall as the mirror image of it in the rest of the cycle."""
    up: Array = np.linspace(0.0, 1.0, rows + 1, dtype=np.float64)
    rising = np.column_stack((rise * up, up**2))
    falling = np.column_stack((1.0 - (1.0 - rise) * up, up**2))
    return np.vstack((rising, falling[-2::-1]))


def _compensated(rows: int, sine: float) -> Array:
    """Rise as y = t - c sin(2 pi t)/(2 pi); jump back."""
    time: Array = np.linspace(0.0, 1.0, 2 * rows + 1, dtype=np.float64)
    height = time - sine * np.sin(2.0 * np.pi * time) / (2.0 * np.pi)
    return np.vstack((np.column_stack((time, height)), (1.0, 0.0)))


def _freeze_and_kick(_: int, rise: float, freeze: float) -> Array:
    """Rise evenly, hold, jump back, hold: the first hold is a share of what the rise leaves."""
    kick = rise + freeze * (1.0 - rise)
    return _corners((0.0, 0.0), (rise, 1.0), (kick, 1.0), (kick, 0.0), (1.0, 0.0))


def _trapezoid(_: int, rise: float, fall: float, hold: float) -> Array:
    """Rise, hold, fall, hold: the first hold is a share of what rise and fall leave."""
    high = rise + hold * (1.0 - rise - fall)
    return _corners((0.0, 0.0), (rise, 1.0), (high, 1.0), (high + fall, 0.0), (1.0, 0.0))


SHAPES: Mapping[str, Shape] = {
    'sawtooth': Shape(
        _sawtooth,
        {'fall': Trait(0.0, 0.5, 0.0, 'share of the cycle for the fall; 0: at the slew rate')},
        'D. W. Pohl, Rev. Sci. Instrum. 58, 54 (1987)',
    ),
    'cycloid': Shape(_cycloid, {}, 'Ch. Renner et al., Rev. Sci. Instrum. 61, 965 (1990)'),
    'parabola': Shape(
        _parabola,
        {'rise': Trait(0.5, 1.0, 1.0, 'share of the cycle for the rise')},
        'K. Anantheshwara, M. S. Bobji, Sadhana 33, 221 (2008)',
    ),
    'sine-compensated': Shape(
        _compensated,
        {
            'sine': Trait(
                -1.0, 1.0, 1.0, 'share of the sine; at 1 the ramp begins and ends at rest'
            )
        },
        'known to us by its name only',
    ),
    'freeze-and-kick': Shape(
        _freeze_and_kick,
        {
            'rise': Trait(0.05, 0.95, 0.5, 'share of the cycle for the rise'),
            'freeze': Trait(0.0, 1.0, 0.5, 'share of the rest before the kick'),
        },
        'Coatings 8(2), 62 (2018)',
    ),
    'trapezoid': Shape(
        _trapezoid,
        {
            'rise': Trait(0.05, 0.7, 0.6, 'share of the cycle for the rise'),
            'fall': Trait(0.0, 0.3, 0.0, 'share of the cycle for the fall'),
            'hold': Trait(0.0, 1.0, 0.5, 'share of the rest before the fall'),
        },
        'M. Hunstig, Actuators 6(1), 7 (2017)',
    ),
}
"""Shapes by name."""
