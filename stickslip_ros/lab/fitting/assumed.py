# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The constants that a fit assumes, their errors, and what a change of them does to a prediction.

A motion shows ratios of forces alone: the contact gives their scale.

"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.fitting.free import Known, check_quantity, known_value
from stickslip_ros.lab.fitting.problem import STEP, Predicted, Problem
from stickslip_ros.parameters import Parameters

_SCALE, FEET_NUMBER = 'scale', 'feet'
"""The stiffness of all contacts at the same limits of friction, and the number of feet under the
same normal force together, both per that of the stand."""
FACTORS_ASSUMED = _SCALE, FEET_NUMBER
ASSUMED_SHARES: Mapping[str, float] = {
    _SCALE: 0.3,
    'contact.radius': 0.1,
    'contact.young_runner': 0.1,
    'contact.young_sphere': 0.1,
    'stand.preload': 0.05,
}
"""Assumed relative standard errors, of constants that are not free."""
_UNDESCRIBED = {FEET_NUMBER: 0.5, 'contact.radius': 0.5}
"""The same of feet that were not described: with the scale, a mass from motion alone is known to
half of itself."""
_OPPOSING = (
    *('friction_law.bristle_damping', 'friction_law.viscous', 'stand.load'),
    *('stand.stop_stiffness', 'frame.mass', 'runner.mass', 'runner.damping'),
    *('actuator.stiffness', 'actuator.mass', 'load_cell.stiffness'),
)
"""Whatever moves under a force: contacts of twice the force move twice of it in the same way."""
_FRICTION = 'contact.friction', 'contact.friction_rate', 'contact.friction_ageing'
OF_FORCES = ('N', 'kg', 'J')
"""Units of quantities that show the scale of the forces."""
APART_MAX = 3.0
"""Most standard errors between an assumed value and that of the readings in a fit that holds."""


def assumed_of(
    parameters: Parameters, free: Iterable[str], given: Mapping[str, Known | str]
) -> tuple[Parameters, dict[str, float]]:
    """Return a stand with assumed values, and the relative errors that are stated or usual."""
    shares, values, free = dict(ASSUMED_SHARES), dict[str, float](), set(free)
    flat = parameters.flat()
    for name, stated in given.items():
        what, example = f'--assume {name}', f'write {name}=+-2%, or with a value before +-'
        is_factor = name in FACTORS_ASSUMED
        spec = check_quantity('contact.friction' if is_factor else name, '--assume')
        if name in free:
            hint = f'leave it out, or use --known {name}=VALUE+-2%'
            raise OutOfRange(what, str(stated), '', 'of a free parameter', hint)
        now = float(flat.get(name, 1.0))
        value, shares[name] = known_value(what, stated, spec, example, now)
        if not (value > 0.0 and 0.0 <= shares[name] < 1.0 and (value == 1.0 or not is_factor)):
            limit = 'not a value above 0 (scale, feet: 1) with an error of 0 to less than 100 %'
            raise OutOfRange(what, str(stated), '', limit, example)
        if value != now:
            values[name] = value
    return parameters.updated(values), {
        name: share for name, share in shares.items() if name not in free
    }


def doubt_feet(
    shares: dict[str, float],
    parameters: Parameters,
    settled: Iterable[str],
    experiments: Sequence[Experiment],
) -> tuple[str, ...]:
    """
    Add the errors of feet if no feet or contacts were given, and return a note about them.

    Parameters that are free, and errors that are stated, are ``settled``.

    """
    settled = {*settled}
    given = parameters.changed().keys() - settled
    is_own = all('stand.weight' in one.settings for one in experiments)  # of this package
    if is_own or any(name.startswith(('feet.', 'contact.')) for name in given):
        return ()
    shares |= {name: share for name, share in _UNDESCRIBED.items() if name not in settled}
    note = 'feet and contacts are those of the paper, as none were described; describe yours with '
    return (note + '--stage or feet.* (docs/howto/which_stage.md)',)


def slopes_of_constants(problem: Problem, place: Array, names: Sequence[str]) -> Array:
    """Return the slopes of the residuals per relative change, shape (residuals, constants)."""
    stand = problem.stand(place)
    ends = [(name, math.exp(way)) for name in names for way in (-STEP, STEP)]
    changed = tuple(_changed(stand, one, *end) for end in ends for one in problem.experiments)
    rows = iter(replace(problem, experiments=changed).predicted([stand])[0])
    found = list[Predicted]()
    for name, factor in ends:
        forces = OF_FORCES if name in FACTORS_ASSUMED else ()  # which ``_changed`` divided
        models = islice(rows, len(problem.seen))
        found.append(
            [
                replace(model, values=factor * model.values) if each.unit in forces else model
                for (_, each, _), model in zip(problem.seen, models, strict=True)
            ]
        )
    pairs = zip(found[::2], found[1::2], strict=True)
    return np.column_stack([problem.whitened(high, low) / (2.0 * STEP) for low, high in pairs])


def _changed(stand: Parameters, one: Experiment, name: str, factor: float) -> Experiment:
    """Return an experiment with a constant times a factor; unchanged if that is impossible."""
    there = stand.updated(dict(one.settings))
    flat, load_n = there.flat(), one.load_n
    if name in FACTORS_ASSUMED:
        less = (*_OPPOSING, *_FRICTION) if name == _SCALE else (*_OPPOSING, 'stand.preload')
        changes = {each: flat[each] / factor for each in less}
        if name == _SCALE:
            changes['feet.weight'] = tuple(factor * each for each in flat['feet.weight'])
        load_n /= factor
    else:
        changes = {name: factor * flat[name]}
        if name == 'contact.radius':
            changes['feet.radius'] = tuple(factor * each for each in flat['feet.radius'])
    try:
        there.updated(changes)
    except StickSlipError:
        return one
    return replace(one, settings={**one.settings, **changes}, load_n=load_n)
