# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which parameters a fit may change, between which bounds, and in which coordinate."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.parameters.typed import to_si_list

FITTED_GROUPS = ('contact', 'friction_law', 'runner', 'load_cell', 'actuator', 'amplifier')
"""Groups whose quantities a fit may change; all others are no properties of the stand."""
DECADE = 10.0
"""Default bounds are this factor below and above the start and the default of the model."""
FROM_ZERO = (
    'friction_law.bristle_damping',
    'friction_law.viscous',
    'runner.damping',
    'actuator.hysteresis',
    'actuator.creep',
)
"""Quantities whose 0 is the limit of small values; of others it means "none" or "derived"."""
TYPICAL: Mapping[str, float] = {
    'runner.damping': 20.0,
    'actuator.hysteresis': 0.05,
    'actuator.creep': 0.01,
    'actuator.resonance': 2e5,
    'actuator.damping_ratio': 0.05,
    'actuator.gain_tolerance': 0.01,
    'amplifier.bandwidth': 2e5,
}
"""Starts of what a stand does not have by default: assumed, of the size that data sheets state."""
PREFACTOR, RMS_HEIGHT = 'contact.prefactor', 'contact.rms_height'
OF_A_FALL = 'actuator.resonance', 'actuator.damping_ratio', 'amplifier.bandwidth'
"""What shows in the microseconds after a fall; one of them cannot be told without the others."""


@dataclass(frozen=True)
class Free:
    """
    A parameter that a fit may change: where the first search starts, bounds, both allowed.

    Bounds that nobody has given are ``movable``: a search that ends on one goes on beyond it.

    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float
    movable: bool = field(default=False, kw_only=True)

    @property
    def is_log(self) -> bool:
        """Whether the coordinate of the search is ln(value); else it is a share of the range."""
        return self.lower > 0.0

    @property
    def coordinates(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        return self.to_coordinate(self.lower), self.to_coordinate(self.upper)

    def to_coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        return math.log(value) if self.is_log else value / (self.upper - self.lower)

    def to_value(self, coordinate: float) -> float:
        """Return the value of a coordinate, inside the bounds in spite of rounding."""
        value = self.unbounded_value(coordinate)
        return min(max(value, self.lower), self.upper)

    def unbounded_value(self, coordinate: float) -> float:
        """Return the value of a coordinate, wherever it is."""
        return math.exp(coordinate) if self.is_log else coordinate * (self.upper - self.lower)

    def widened(self, value: float, share: float) -> 'Free':
        """Return it with the bound moved on which a value sits, within a share of the range."""
        spec, z = spec_of(self.name), self.to_coordinate(value)
        low, high = self.coordinates
        lower, upper = self.lower, self.upper
        if not self.movable:
            return self
        if z - low <= share * (high - low):
            lower = 0.0 if self.name in FROM_ZERO else max(lower / DECADE, spec.minimum or 0.0)
        elif high - z <= share * (high - low):
            upper = min(upper * DECADE, math.inf if spec.maximum is None else spec.maximum)
        return replace(self, lower=lower, upper=upper)

    def is_limited(self, value: float) -> bool:
        """Return whether the bound beside a value is a limit of the model too."""
        spec = spec_of(self.name)
        bound = min(self.lower, self.upper, key=lambda end: abs(end - value))
        return bound in {spec.minimum, spec.maximum}

    def slope(self, value: float) -> float:
        """Return d value / d coordinate."""
        return value if self.is_log else self.upper - self.lower


def choose_free(
    parameters: Parameters,
    names: Sequence[str],
    starts: Mapping[str, float | str] | None = None,
    bounds: Mapping[str, tuple[float, float] | str] | None = None,
) -> tuple[Parameters, tuple[Free, ...], tuple[str, ...]]:
    """
    Return the stand of a fit, its free parameters, and notes about what was changed for it.

    Starts and bounds are numbers or what was typed, bounds as ``low:high``. Without them a
    parameter starts from the stand's value, a decade below and above its start and its default.
    Raises StickSlipError if a parameter cannot be fitted, or a start or a bound does not fit.

    """
    starts, bounds = starts or {}, bounds or {}
    _check_names(names, {'--start': starts, '--bounds': bounds})
    parameters, notes = _let_roughness_act(parameters, names)
    flat = parameters.flat()
    free = []
    for name in names:
        start = spec_of(name).check(name, starts.get(name, flat[name] or TYPICAL.get(name, 0.0)))
        free.append(_free(name, float(start), bounds.get(name)))
    off = [name for name in OF_A_FALL if name not in names and not flat[name]]
    if off and not set(OF_A_FALL).isdisjoint(names):
        note = (
            f'{" and ".join(off)} taken as none: what shows just after a fall then counts as '
            f'the others; free {", ".join(OF_A_FALL)} together, or set what is known'
        )
        notes = (*notes, note)
    return parameters.updated({one.name: one.start for one in free}), tuple(free), notes


def choose_known(
    known: Mapping[str, tuple[float, float] | str], free: Sequence[Free]
) -> dict[str, tuple[float, float]]:
    """
    Return values of free parameters that were measured otherwise, and relative standard errors.

    Typed they are ``3g+-1%``. Raises StickSlipError if one is not free, or no such pair.

    """
    found = {}
    for name, given in known.items():
        spec, what = spec_of(name), f'--known {name}'
        example = f'write {name}=VALUE+-1%, as 0.25+-1% or 3g+-1%'
        if name not in {one.name for one in free}:
            raise OutOfRange(what, str(given), '', 'not free', f'set it with --set {name}=VALUE')
        if isinstance(given, str):
            value, sign, error = given.replace('±', '+-').partition('+-')
            if not sign or not error.strip().endswith('%'):
                raise WrongKind(what, given, 'VALUE+-SHARE%', example)
            [number] = to_si_list(what, (value,), spec.unit)
            [percent] = to_si_list(what, (error.strip().rstrip('%'),), '')
            pair = number, 0.01 * percent
        else:
            pair = given
        value_si, share = float(spec.check(name, pair[0])), float(pair[1])
        if not (share > 0.0 and value_si > 0.0):
            raise OutOfRange(what, str(given), '', 'not above 0', example)
        found[name] = (value_si, share)
    return found


def _check_names(names: Sequence[str], others: Mapping[str, Mapping[str, Any]]) -> None:
    if not names:
        raise WrongKind('--free', '', 'a list of parameters', 'name one, as contact.friction')
    for name in names:
        if spec_of(name).kind is not float:
            hint = 'set it with --set, and compare fits'
            raise WrongKind('free parameter', name, 'a quantity (it is no float)', hint)
        if name.partition('.')[0] not in FITTED_GROUPS:
            limit = 'no property of the drive that a force tells of'
            hint = f'free quantities of {", ".join(FITTED_GROUPS)}'
            raise OutOfRange('free parameter', name, '', limit, hint)
        if list(names).count(name) > 1:
            raise OutOfRange('parameter', name, '', 'freed twice', 'name it once')
    for option, given in others.items():
        for name in given:
            spec_of(name)
            if name not in names:
                hint = f'add it to --free, or set it with --set {name}=VALUE'
                raise OutOfRange(f'parameter of {option}', name, '', 'not free', hint)


def _let_roughness_act(
    parameters: Parameters, names: Sequence[str]
) -> tuple[Parameters, tuple[str, ...]]:
    """Take the roughness from its rms height where that is free: a prefactor would hide it."""
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


def _free(name: str, start: float, bounds: tuple[float, float] | str | None) -> Free:
    spec = spec_of(name)
    if bounds is not None:
        lower, upper = _checked_bounds(name, bounds)
    elif start > 0.0:
        lowest, highest = spec.minimum or 0.0, spec.maximum or math.inf
        known = float(spec.default) or start  # 0 has no logarithm: a search moves its bound there
        lower = max(min(start, known) / DECADE, lowest)
        upper = min(max(start, known) * DECADE, highest)
    else:
        limit = 'a start without a scale'
        hint = f'give --start {name}=VALUE or --bounds {name}=LOW:HIGH'
        raise OutOfRange(name, start, spec.unit, limit, hint)
    if not lower <= start <= upper:
        limit = f'outside of its bounds, {lower:g} to {upper:g} {spec.unit}'.rstrip()
        hint = f'move one of them: --start {name}=VALUE, --bounds {name}=LOW:HIGH'
        raise OutOfRange(f'start of {name}', start, spec.unit, limit, hint)
    return Free(name, spec.unit, start, lower, upper, movable=bounds is None)


def _checked_bounds(name: str, given: Sequence[float] | str) -> tuple[float, float]:
    spec, what = spec_of(name), f'bounds of {name}'
    if isinstance(given, str):
        low, colon, high = given.partition(':')
        if not colon:
            raise WrongKind(what, given, 'LOW:HIGH', f'write --bounds {name}=LOW:HIGH')
        given = to_si_list(what, (low, high), spec.unit)
    lower, upper = (float(spec.check(name, each)) for each in given)
    if not lower < upper:
        limit = f'not below the upper one, {upper:g} {spec.unit}'.rstrip()
        raise OutOfRange(f'lower bound of {name}', lower, spec.unit, limit, 'swap them')
    return lower, upper
