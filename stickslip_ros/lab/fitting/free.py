# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The free parameters of a fit, their bounds and coordinates, and natural coordinates.

A motion stays the same if stiffness, friction, mass and damping grow by the same factor. In the
logarithms of roughness, friction, mass and damping the minimum is therefore a long curved valley:
another roughness gives another stiffness k, and friction, mass and damping follow. Natural
coordinates are friction and mass divided by k, and damping divided by the mass: along the valley
they are constant, so it is straight.

"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import optimize

from stickslip_ros.arrays import Array
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import Parameters, Scalar, Spec, checked_arguments, spec_of, specs
from stickslip_ros.parameters.typed import to_si_list

LOAD = 'stand.load'
FITTED = ('contact', 'friction_law', 'runner', 'load_cell', 'actuator', 'amplifier', 'feet', LOAD)
"""Groups of parameters, and a parameter, that a fit may change."""
_WIDE = 1e3
"""Factor between the start and its default bounds, which lie within the limits of the model."""
PREFACTOR, RMS_HEIGHT = 'contact.prefactor', 'contact.rms_height'
FROM_ZERO = tuple(name for name, spec in specs().items() if spec.from_zero)
"""Quantities whose 0 is the limit of small values; for others 0 means "none" or "derived"."""
TYPICAL = {name: spec.typical for name, spec in specs().items() if spec.typical}
"""Typical values from data sheets: starts of parameters that are 0 by default."""
OF_A_FALL = 'actuator.resonance', 'actuator.damping_ratio', 'amplifier.bandwidth'
"""Parameters that act in the microseconds after a fall; they can only be fitted together."""
TINY, LOG_MAX = sys.float_info.min, math.log(sys.float_info.max)
"""Smallest number, used for 0 in logarithms, and largest logarithm of a number."""
_MASS, _DAMPING = 'runner.mass', 'runner.damping'
_PER_STIFFNESS = 'contact.friction', _MASS

KnownValue: TypeAlias = tuple[float, float]
"""A value and its relative standard error."""


@checked_arguments
@dataclass(frozen=True)
class Free:
    """A free parameter of a fit. Quantities are numbers in SI units, or texts: ``3g``."""

    name: str
    """Name of the parameter, ``contact.friction``."""
    start: float | str | None = None
    """Start of the first search; by default the value of the stand."""
    low: float | str | None = None
    """Lower bound; by default a thousandth of the start, or the limit of the model."""
    high: float | str | None = None
    """Upper bound; by default a thousand times the start, or the limit of the model."""
    known: KnownValue | str | None = None
    """
    Value from another measurement, and its relative standard error.

    A pair of numbers, ``(3e-3, 0.01)``, or a text, ``3g+-1%``.

    """


FreeParameters: TypeAlias = str | Free | Sequence[str | Free]


@dataclass(frozen=True)
class Coordinate:
    """
    A coordinate of a search: a free parameter, its start, and its bounds, which are allowed.

    The coordinate is ln(value), or value/``size`` if the value may be 0.

    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float

    @property
    def is_log(self) -> bool:
        """Whether it is ln(value)."""
        return self.name not in FROM_ZERO and self.lower >= 0.0

    @property
    def size(self) -> float:
        """Value at which a coordinate that is not a logarithm is 1."""
        return max(abs(self.start), TYPICAL.get(self.name, 0.0)) or self.upper - self.lower

    def to_coordinate(self, value: float) -> float:
        return math.log(max(value, TINY)) if self.is_log else value / self.size

    def to_value(self, coordinate: float) -> float:
        """Return the value of a coordinate, within the bounds."""
        return min(max(self._unbounded(coordinate), self.lower), self.upper)

    def excess(self, coordinate: float) -> float:
        """Return how far a coordinate is beyond its bounds; negative below the lower bound."""
        within = self.to_value(coordinate)
        is_within = math.isclose(self._unbounded(coordinate), within)
        return 0.0 if is_within else coordinate - self.to_coordinate(within)

    def _unbounded(self, coordinate: float) -> float:
        return math.exp(min(coordinate, LOG_MAX)) if self.is_log else coordinate * self.size

    def is_limit(self, value: float) -> bool:
        """Return whether the bound next to a value is also a limit of the model."""
        spec = spec_of(self.name)
        bound = min(self.lower, self.upper, key=lambda end: abs(end - value))
        is_smooth = self.name == PREFACTOR and bound == self.start / _WIDE
        return is_smooth or bound in {spec.minimum, spec.maximum}

    def slope(self, value: float) -> float:
        """Return d value / d coordinate."""
        return value if self.is_log else self.size


@dataclass(frozen=True, eq=False)
class Natural:
    """
    The map between coordinates of free parameters and natural coordinates, both shape (free,).

    ``stand`` gives the fixed parameters of the contacts, and a preload.

    """

    stand: Parameters
    free: tuple[Coordinate, ...]

    def to(self, z: Array) -> Array:
        place = z.copy()
        place[self._numbers(_DAMPING)] *= math.exp(-self._growth(z))
        place[self._numbers(*_PER_STIFFNESS)] -= self._log_stiffness(z)
        return place

    def back(self, place: Array) -> Array:
        """Return the coordinates of the free parameters."""
        z = place.copy()
        z[self._numbers(*_PER_STIFFNESS)] += self._log_stiffness(place)
        z[self._numbers(_DAMPING)] *= math.exp(self._growth(z))
        return z

    def settings(self, place: Array) -> dict[str, float]:
        """Return the values of the free parameters, by name."""
        pairs = zip(self.free, self.back(place).tolist(), strict=True)
        return {one.name: one.to_value(z) for one, z in pairs}

    def slopes(self, place: Array) -> Array:
        """Return the slopes of ``back``, shape (free, free)."""
        return np.asarray(optimize.approx_fprime(place, self.back)).reshape((len(place),) * 2)

    def _numbers(self, *names: str) -> list[int]:
        """Return the indices of those parameters that are free."""
        return [number for number, one in enumerate(self.free) if one.name in names]

    def _growth(self, z: Array) -> float:
        """Return ln(mass/mass at the start); 0 if the mass is not free."""
        masses = [(self.free[number], float(z[number])) for number in self._numbers(_MASS)]
        return sum((x - mass.to_coordinate(mass.start) for mass, x in masses), 0.0)

    def _log_stiffness(self, z: Array) -> float:
        """Return ln(stiffness of all contacts); 0 if no free parameter changes the stiffness."""
        contact = self.stand.contact
        chosen = [
            (one, float(z[k]))
            for k, one in enumerate(self.free)
            if one.name.startswith('contact.') and one.name not in _PER_STIFFNESS
        ]
        if not chosen or contact.law != 'mdr' or contact.profile == 'rough_line':
            return 0.0
        starts = {one.name: one.start for one in self.free}  # a weight may press the contacts
        changed = {one.name: one.to_value(value) for one, value in chosen}
        there = self.stand.updated({**starts, **changed})
        return math.log(sum(each.stick_stiffness_n_per_m for each in contacts_of(there)))


def choose_free(
    parameters: Parameters, free: FreeParameters
) -> tuple[Parameters, tuple[Coordinate, ...], tuple[str, ...]]:
    """
    Return the stand of a fit, its coordinates, and notes about changes of the stand.

    Raises StickSlipError if a parameter cannot be fitted, or a start or a bound is impossible.

    """
    chosen = listed_free(free)
    names = [each.name for each in chosen]
    _check_names(names)
    parameters, notes = _let_roughness_act(parameters, names)
    coordinates = tuple(_coordinate(each, parameters.value(each.name)) for each in chosen)
    off = [name for name in OF_A_FALL if name not in names and not parameters.value(name)]
    if off and not set(OF_A_FALL).isdisjoint(names):
        note = (
            f'{" and ".join(off)} not modelled: the free parameters take over the effect just '
            f'after a fall; free {", ".join(OF_A_FALL)} together, or set the known values'
        )
        notes = (*notes, note)
    return parameters.updated({one.name: one.start for one in coordinates}), coordinates, notes


def listed_free(free: FreeParameters) -> list[Free]:
    """Return free parameters, or their names, as a list."""
    listed = [free] if isinstance(free, str | Free) else free
    return [Free(each) if isinstance(each, str) else each for each in listed]


def known_of(free: Sequence[Free]) -> dict[str, KnownValue]:
    """Return known values and their relative errors; raise StickSlipError if malformed."""
    found = {}
    for one in free:
        if one.known is not None:
            what = f'--known {one.name}'
            example = f'write {one.name}=VALUE+-1%, as 0.25+-1% or 3g+-1%'
            found[one.name] = known_value(what, one.known, spec_of(one.name), example)
            if not min(found[one.name]) > 0.0:
                raise OutOfRange(what, str(one.known), '', 'not above 0', example)
    return found


def known_value(
    what: str, given: KnownValue | str, spec: Spec, example: str, value: float | None = None
) -> KnownValue:
    """Return a value and its relative error; ``value`` is used if a text has only an error."""
    if isinstance(given, str):
        typed, sign, error = given.replace('±', '+-').partition('+-')
        if not sign or not error.strip().endswith('%'):
            raise WrongKind(what, given, 'VALUE+-SHARE%', example)
        if typed.strip() or value is None:
            [value] = to_si_list(what, (typed,), spec.unit)
        [percent] = to_si_list(what, (error.strip().rstrip('%'),), '')
        given = value, 0.01 * percent
    return float(spec.check(what, given[0])), float(given[1])


def check_quantity(name: str, what: str) -> Spec:
    """Return the declaration of a parameter, or of an element; refuse all but quantities."""
    spec = spec_of(name)
    if spec.kind is not float:
        raise WrongKind(what, name, 'a quantity', 'set it with --set, and compare fits')
    if spec.is_array:
        raise WrongKind(what, name, 'a quantity (it is an array)', f'name an element, {name}[0]')
    return spec


def is_property(name: str) -> bool:
    """Return whether a fit may change a parameter."""
    return not {name, name.partition('.')[0]}.isdisjoint(FITTED)


def _check_names(names: Sequence[str]) -> None:
    if not names:
        raise WrongKind('--free', '', 'a list of parameters', 'name one, as contact.friction')
    for name in names:
        check_quantity(name, 'free parameter')
        if not is_property(name):
            limit = 'not a property of the drive'
            hint = f'free quantities of {", ".join(FITTED)}'
            raise OutOfRange('free parameter', name, '', limit, hint)
        if names.count(name) > 1:
            raise OutOfRange('parameter', name, '', 'freed twice', 'name it once')


def _let_roughness_act(
    parameters: Parameters, names: Sequence[str]
) -> tuple[Parameters, tuple[str, ...]]:
    """Set the prefactor to 0 if the rms height is free: a prefactor overrides the height."""
    prefactor, is_free = parameters.contact.prefactor, PREFACTOR in names
    if RMS_HEIGHT not in names or parameters.contact.profile == 'rough_line':
        return parameters, ()
    if is_free or prefactor not in {0.0, spec_of(PREFACTOR).default}:
        value = 'free' if is_free else f'{prefactor:g} m^(1-H)'
        limit = f'without effect while {PREFACTOR} is {value}'
        hint = f'set {PREFACTOR}=0, or free {PREFACTOR} alone'
        raise OutOfRange('free parameter', RMS_HEIGHT, '', limit, hint)
    note = f'{PREFACTOR} was set to 0, so that {RMS_HEIGHT} decides the roughness'
    return parameters.updated({PREFACTOR: 0.0}), (note,) if prefactor else ()


def _coordinate(free: Free, present: Scalar) -> Coordinate:
    """Return the coordinate of a free parameter; by default it starts at its present value."""
    name, spec = free.name, spec_of(free.name)
    given = (present or TYPICAL.get(name, 0.0)) if free.start is None else free.start
    start = float(spec.check(name, given))
    if free.low is None and free.high is None and not start > 0.0:
        limit = 'not above 0, and gives no scale for a search'
        hint = f'give --start {name}=VALUE or --bounds {name}=LOW:HIGH'
        raise OutOfRange(name, start, spec.unit, limit, hint)
    is_from_zero = name in FROM_ZERO and name != PREFACTOR  # a prefactor of 0 is computed
    lower = max(0.0 if is_from_zero else start / _WIDE, spec.minimum or 0.0)
    upper = min(start * _WIDE, spec.maximum or math.inf)
    if free.low is not None:
        lower = float(spec.check(name, free.low))
    if free.high is not None:
        upper = float(spec.check(name, free.high))
    if not lower < upper:
        limit = f'not below the upper one, {upper:g} {spec.unit}'.rstrip()
        raise OutOfRange(f'lower bound of {name}', lower, spec.unit, limit, 'swap them')
    if not lower <= start <= upper:
        limit = f'outside of its bounds, {lower:g} to {upper:g} {spec.unit}'.rstrip()
        hint = f'move one of them: --start {name}=VALUE, --bounds {name}=LOW:HIGH'
        raise OutOfRange(f'start of {name}', start, spec.unit, limit, hint)
    return Coordinate(name, spec.unit, start, lower, upper)
