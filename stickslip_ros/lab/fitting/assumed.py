# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Constants that a fit assumes: their errors, and the slopes of a prediction by them.

A motion shows only ratios of forces; the assumed contact gives their scale.

"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.experiments.friction_loop import LoopRow
from stickslip_ros.lab.fitting.free import (
    LOAD,
    KnownValue,
    check_quantity,
    is_property,
    known_value,
)
from stickslip_ros.lab.fitting.problem import STEP, Predicted, Problem
from stickslip_ros.parameters import Parameters, spec_of, specs

_PRELOAD = 'stand.preload'

_SCALE, FEET_NUMBER = FACTORS_OF_FORCES = 'scale', 'feet'
"""Factors of the stiffness of all contacts, at the same limits of friction, and of the number of
feet, under the same total normal force."""
LOAD_FACTOR = 'load'
"""Factor of the sum of friction and a constant force on the runner, per friction."""
_VOLTAGE, _POSITION = 'voltage', 'position'
CALIBRATIONS: Mapping[str, float] = {_VOLTAGE: 0.01, _POSITION: 0.001}
"""Factors of a voltage monitor and a position sensor, reading per true value; relative errors."""
_FACTORS = *FACTORS_OF_FORCES, LOAD_FACTOR, *CALIBRATIONS
SHOWN = LOAD_FACTOR, *CALIBRATIONS
"""Factors in the errors of quantities that a recording shows whatever the feet are."""
ASSUMED_SHARES: Mapping[str, float] = {
    _SCALE: 0.3,
    **{name: spec.assumed for name, spec in specs().items() if spec.assumed},
}
"""Assumed relative standard errors, of constants that are not free."""
_UNDESCRIBED = {FEET_NUMBER: 0.5, 'contact.radius': 0.5}
"""Assumed relative errors without a description of the feet: together with the scale, they give a
mass from motion alone a relative error of a half."""
_RANGE_OF_VOLTS = 'amplifier.voltage_'  # limits commands, but changes no motion
_RANGE = 2.0 * 1.96  # width of a range in standard errors
_LOAD_SHARE = 0.03
"""Assumed error of the load of a free runner if none is given, for cables and a tilted rail."""
OPPOSING = tuple(name for name, spec in specs().items() if spec.opposes)
"""Parameters that oppose a motion: the motion stays the same if they grow with the forces."""
_FRICTION = 'contact.friction', 'contact.friction_rate', 'contact.friction_ageing'
OF_FORCES = ('N', 'kg', 'J')
"""Units of quantities that show the scale of the forces."""
TENSION_MAX = 3.0
"""Largest distance of an assumed value from that of the readings, in standard errors."""


def assumed_of(
    parameters: Parameters, free: Iterable[str], given: Mapping[str, KnownValue | str]
) -> tuple[Parameters, dict[str, float]]:
    """Return the stand with the assumed values, and relative errors, stated or by default."""
    shares, values, free = dict(ASSUMED_SHARES), dict[str, float](), set(free)
    shares |= shares_of_ranges(parameters)
    for name, stated in given.items():
        what, example = f'--assume {name}', f'write {name}=+-2%, or with a value before +-'
        is_factor = name in _FACTORS
        spec = check_quantity('contact.friction' if is_factor else name, '--assume')
        if name in free:
            hint = f'leave it out, or use --known {name}=VALUE+-2%'
            raise OutOfRange(what, str(stated), '', 'of a free parameter', hint)
        now = value_of(parameters, name)
        value, shares[name] = known_value(what, stated, spec, example, now)
        if not (value and 0.0 <= shares[name] < 1.0 and (value == 1.0 or not is_factor)):
            ones = ', '.join(_FACTORS)
            limit = f'not a value above 0 ({ones}: 1) with an error of 0 to less than 100 %'
            raise OutOfRange(what, str(stated), '', limit, example)
        if value != now:
            values[name] = value
    return parameters.updated(values), {
        name: share for name, share in shares.items() if name not in free
    }


def value_of(stand: Parameters, name: str) -> float:
    """Return the value of a constant; factors are 1."""
    return 1.0 if name in _FACTORS else float(stand.value(name))


def shares_of_ranges(stand: Parameters) -> dict[str, float]:
    """
    Return the relative errors of assumed values with 95 % ranges.

    An array gives an error for each element, but feet.count gives one for the total number.

    """
    found = dict[str, float]()
    for name, (low, high) in stand.ranges.items():
        spec, value = spec_of(name), stand.value(name)
        if name == 'feet.count':
            found[FEET_NUMBER] = math.log(high / low) / _RANGE
        elif (is_property(name) or name in ASSUMED_SHARES) and not name.startswith(
            _RANGE_OF_VOLTS
        ):
            elements = [f'{name}[{k}]' for k in range(len(value))] if spec.is_array else [name]
            for each in elements:
                if now := abs(value_of(stand, each)):
                    width = math.log(high / low) if low > 0.0 else (high - low) / now
                    found[each] = width / _RANGE
    return found


def add_default_errors(
    shares: dict[str, float],
    parameters: Parameters,
    settled: Iterable[str],
    experiments: Sequence[Experiment],
) -> tuple[str, ...]:
    """
    Add errors of calibrations, load and feet that were not given; return a note about the feet.

    ``settled`` are the free parameters and those with a stated error.

    """
    settled = {*settled}
    if _PRELOAD not in settled and all(_PRELOAD in one.settings for one in experiments):
        shares[_PRELOAD] = ASSUMED_SHARES[_PRELOAD]
    given = parameters.changed().keys() - settled
    if all('stand.weight' in one.settings for one in experiments):  # recorded by this package
        return ()
    if all(isinstance(one.drive, LoopRow) for one in experiments):  # one sphere, measured force
        for name in (_SCALE, _PRELOAD):
            shares.pop(name, None)
        return ()
    shares |= {name: share for name, share in CALIBRATIONS.items() if name not in settled}
    has_load = settled & {LOAD_FACTOR, LOAD} or parameters.stand.load
    is_free = parameters.load_cell.contact == 'absent' or any(
        one.settings.get('load_cell.contact') == 'absent' for one in experiments
    )
    if is_free and not (has_load or any(one.load_n for one in experiments)):
        shares[LOAD_FACTOR] = _LOAD_SHARE
    if any(name.startswith(('feet.', 'contact.')) for name in given):
        return ()
    shares |= {name: share for name, share in _UNDESCRIBED.items() if name not in settled}
    note = 'feet and contacts are those of the paper, as none were described; describe yours with '
    return (note + '--stage or feet.* (docs/howto/which_stage.md)',)


def slopes_of_constants(problem: Problem, place: Array, names: Sequence[str]) -> Array:
    """Return the slopes of the residuals per relative change, shape (residuals, constants)."""
    stand = problem.stand(place)
    ends = [(name, math.exp(way)) for name in names for way in (-STEP, STEP)]
    changed = tuple(with_constant(stand, one, *end) for end in ends for one in problem.experiments)
    rows = iter(replace(problem, experiments=changed).predicted([stand])[0])
    found = list[Predicted]()
    for name, factor in ends:
        scaled = OF_FORCES if name in FACTORS_OF_FORCES else ('m',) * (name == _POSITION)
        models = islice(rows, len(problem.observed))
        found.append(
            [
                replace(model, values=factor * model.values) if each.unit in scaled else model
                for (_, each, _), model in zip(problem.observed, models, strict=True)
            ]
        )
    pairs = zip(found[::2], found[1::2], strict=True)
    return np.column_stack([problem.whitened(high, low) / (2.0 * STEP) for low, high in pairs])


def with_constant(stand: Parameters, one: Experiment, name: str, factor: float) -> Experiment:
    """Return an experiment with a constant multiplied by a factor; unchanged if impossible."""
    if name in {_VOLTAGE, 'actuator.gain'} and getattr(one.drive, 'amplitude_m', None):
        return one  # the stroke itself was measured
    there = stand.updated(dict(one.settings))
    flat, load_n = there.flat(), one.load_n
    changes: dict[str, Any] = {}
    if name == _VOLTAGE:
        changes = {'actuator.gain': factor * flat['actuator.gain']}
    elif name == LOAD_FACTOR:
        changes = {LOAD: flat[LOAD] + math.log(factor) * friction_limit_n(there)}
    elif name in FACTORS_OF_FORCES:
        less = (*OPPOSING, *_FRICTION) if name == _SCALE else (*OPPOSING, _PRELOAD)
        changes = {each: flat[each] / factor for each in less}
        if name == _SCALE:
            changes['feet.weight'] = tuple(factor * each for each in flat['feet.weight'])
            changes['feet.friction'] = tuple(each / factor for each in flat['feet.friction'])
        load_n /= factor
    elif name != _POSITION:
        changes = {name: factor * there.value(name)}
        if name == 'contact.radius':
            changes['feet.radius'] = tuple(factor * each for each in flat['feet.radius'])
    try:
        there.updated(changes)
    except StickSlipError:
        return one
    return replace(one, settings={**one.settings, **changes}, load_n=load_n)
