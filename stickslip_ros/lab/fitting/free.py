# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The free parameters of a fit, with their bounds and coordinates."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import Parameters, Scalar, Spec, reading, spec_of
from stickslip_ros.parameters.typed import to_si_list

LOAD = 'stand.load'
FITTED = ('contact', 'friction_law', 'runner', 'load_cell', 'actuator', 'amplifier', LOAD)
"""What a fit may change: groups of parameters, and a parameter."""
_SMOOTH = 1e-4  # least prefactor per that at the start: no roughness; 0 means another
_WIDE = 1e3
"""Default bounds are this factor below and above the start, within the limits of the model."""
PREFACTOR, RMS_HEIGHT = 'contact.prefactor', 'contact.rms_height'
FROM_ZERO = (
    PREFACTOR,
    RMS_HEIGHT,
    'friction_law.bristle_damping',
    'friction_law.viscous',
    'runner.damping',
    'actuator.hysteresis',
    'actuator.creep',
)
"""
Quantities with 0 as the limit of small values; for others 0 means "none" or "derived".

The stiffness of a contact hardly changes with a small roughness, but then evenly.

"""
TYPICAL: Mapping[str, float] = {
    'runner.damping': 20.0,
    'actuator.hysteresis': 0.05,
    'actuator.creep': 0.01,
    'actuator.resonance': 2e5,
    'actuator.damping_ratio': 0.05,
    'actuator.gain_tolerance': 0.01,
    'amplifier.bandwidth': 2e5,
}
"""Starts of parameters that are 0 by default: assumed, of the size in data sheets."""
OF_A_FALL = 'actuator.resonance', 'actuator.damping_ratio', 'amplifier.bandwidth'
"""Parameters that act in the microseconds after a fall, and can only be found together."""
_ROUNDED = 1e-12  # difference of equal values
_LEAST, _MOST = 1e-300, 300.0  # a value without a logarithm, and a logarithm without a value

Known: TypeAlias = tuple[float, float]
"""A value and its relative standard error."""


@reading
@dataclass(frozen=True)
class Free:
    """A parameter that a fit may change. Quantities are numbers in SI units, or typed: ``3g``."""

    name: str
    """Name of the parameter, ``contact.friction``."""
    start: float | str | None = None
    """Start of the first search; by default the value of the stand."""
    low: float | str | None = None
    """Lower bound; by default a thousandth of the start, or the limit of the model."""
    high: float | str | None = None
    """Upper bound; by default a thousand times the start, or the limit of the model."""
    known: Known | str | None = None
    """
    Value from another measurement, and its relative standard error.

    A pair of numbers, ``(3e-3, 0.01)``, or typed, ``3g+-1%``.

    """


FreeParameters: TypeAlias = str | Free | Sequence[str | Free]
"""Free parameters as a fit takes them."""


@dataclass(frozen=True)
class Coordinate:
    """
    A coordinate of a search: a free parameter, its start, and its bounds, both allowed.

    It is ln(value); of a part that may be absent the value per ``size``, as 0 has no logarithm.

    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float

    @property
    def is_log(self) -> bool:
        """Whether the coordinate is ln(value)."""
        return self.name not in FROM_ZERO and self.lower >= 0.0

    @property
    def size(self) -> float:
        """Unit of a coordinate that is no logarithm."""
        return max(abs(self.start), TYPICAL.get(self.name, 0.0)) or self.upper - self.lower

    def to_coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        return math.log(max(value, _LEAST)) if self.is_log else value / self.size

    def to_value(self, coordinate: float) -> float:
        """Return the value of a coordinate, within the bounds."""
        return min(max(self._unbounded(coordinate), self.lower), self.upper)

    def beyond(self, coordinate: float) -> float:
        """Return how far a coordinate is beyond a bound; below the lower one it is negative."""
        within = self.to_value(coordinate)
        is_within = math.isclose(self._unbounded(coordinate), within, rel_tol=_ROUNDED)
        return 0.0 if is_within else coordinate - self.to_coordinate(within)

    def _unbounded(self, coordinate: float) -> float:
        return math.exp(min(coordinate, _MOST)) if self.is_log else coordinate * self.size

    def is_limit(self, value: float) -> bool:
        """Return whether the bound next to a value is also a limit of the model."""
        spec = spec_of(self.name)
        bound = min(self.lower, self.upper, key=lambda end: abs(end - value))
        return bound in {spec.minimum, spec.maximum, _SMOOTH * self.start}

    def slope(self, value: float) -> float:
        """Return d value / d coordinate."""
        return value if self.is_log else self.size


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
    flat = parameters.flat()
    coordinates = [
        _coordinate(each, flat[each.name] or TYPICAL.get(each.name, 0.0)) for each in chosen
    ]
    off = [name for name in OF_A_FALL if name not in names and not flat[name]]
    if off and not set(OF_A_FALL).isdisjoint(names):
        note = (
            f'{" and ".join(off)} not modelled: the others take over its effect just after a '
            f'fall; free {", ".join(OF_A_FALL)} together, or set the known values'
        )
        notes = (*notes, note)
    starts = {one.name: one.start for one in coordinates}
    return parameters.updated(starts), tuple(coordinates), notes


def listed_free(free: FreeParameters) -> list[Free]:
    """Return free parameters, or their names, as a list."""
    listed = [free] if isinstance(free, str | Free) else free
    return [Free(each) if isinstance(each, str) else each for each in listed]


def known_of(free: FreeParameters) -> dict[str, Known]:
    """Return known values and their relative errors; raise StickSlipError if malformed."""
    found = {}
    for one in listed_free(free):
        if (given := one.known) is None:
            continue
        what, example = f'--known {one.name}', f'write {one.name}=VALUE+-1%, as 0.25+-1% or 3g+-1%'
        value_si, share = known_value(what, given, spec_of(one.name), example)
        if not (share > 0.0 and value_si > 0.0):
            raise OutOfRange(what, str(one.known), '', 'not above 0', example)
        found[one.name] = (value_si, share)
    return found


def known_value(
    what: str, given: Known | str, spec: Spec, example: str, value: float | None = None
) -> Known:
    """Return a value and its relative error, as given or typed; ``value`` if none is typed."""
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
    """Return the declaration of a parameter; refuse what is no quantity."""
    spec = spec_of(name)
    if spec.kind is not float or spec.is_array:
        hint = 'set it with --set, and compare fits'
        found = 'an array' if spec.is_array else 'no float'
        raise WrongKind(what, name, f'a quantity (it is {found})', hint)
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
    """Set the prefactor to 0 if the rms height is free, as it would hide it."""
    prefactor = parameters.contact.prefactor
    if RMS_HEIGHT not in names or parameters.contact.profile == 'rough_line':
        return parameters, ()
    if PREFACTOR in names:
        limit = f'without effect while {PREFACTOR} is free'
        raise OutOfRange('free parameter', RMS_HEIGHT, '', limit, 'free one of the two')
    if not prefactor:
        return parameters, ()
    if prefactor != spec_of(PREFACTOR).default:
        limit = f'without effect while {PREFACTOR} is {prefactor:g} m^(1-H)'
        hint = f'set {PREFACTOR}=0, or free {PREFACTOR} instead'
        raise OutOfRange('free parameter', RMS_HEIGHT, '', limit, hint)
    note = f'{PREFACTOR} was set to 0, so that {RMS_HEIGHT} decides the roughness'
    return parameters.updated({PREFACTOR: 0.0}), (note,)


def _coordinate(free: Free, present: Scalar) -> Coordinate:
    """Return the coordinate of a free parameter; by default it starts at its present value."""
    name, spec = free.name, spec_of(free.name)
    start = float(spec.check(name, present if free.start is None else free.start))
    if free.low is None and free.high is None and not start > 0.0:
        limit = 'not above 0, and gives no scale for a search'
        hint = f'give --start {name}=VALUE or --bounds {name}=LOW:HIGH'
        raise OutOfRange(name, start, spec.unit, limit, hint)
    least = 0.0 if name in FROM_ZERO else 1.0 / _WIDE
    lower = max(start * (_SMOOTH if name == PREFACTOR else least), spec.minimum or 0.0)
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
