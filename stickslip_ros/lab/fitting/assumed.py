# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The errors of the constants that a fit assumes, and their part in the errors of the fitted values.

A motion shows ratios of forces alone: the contact gives their scale. The constants are
marginalised to first order, by the slopes of the predictions at the minimum.

"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.fitting.free import Known, check_quantity, known_value
from stickslip_ros.lab.fitting.problem import STEP, Predicted, Problem
from stickslip_ros.lab.fitting.statistics import (
    QUANTILE_95,
    RANK,
    UNDETERMINED,
    Uncertainty,
    reaching,
)
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
_FEET_SHARE = 0.5
"""The same of the number of feet if they were not described: with the scale, a mass from motion
alone is known to half of itself."""
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


class Tension(NamedTuple):
    """A constant from elsewhere, and the value that the readings alone prefer."""

    name: str
    value: float
    share: float  # relative standard error
    preferred: float
    apart: float  # distance in standard errors


@dataclass(frozen=True, eq=False)
class Assumed:
    """Assumed constants at a minimum."""

    shares: Mapping[str, float]  # relative standard errors, by name
    recorded: Uncertainty  # with the constants taken as exact
    moves: Array  # of the coordinates per relative change of a constant, shape (free, constants)
    left_z: Array  # covariance of the constants after the fit, shape (constants, constants)
    pulls: Array  # relative changes of the constants that the readings prefer, shape (constants,)

    @property
    def covariance_z(self) -> Array:
        """Covariance of coordinates and constants, shape (free + constants, same)."""
        across = self.moves @ self.left_z
        whole = self.recorded.covariance_z + across @ self.moves.T
        return np.block([[whole, across], [across.T, self.left_z]])

    def widened(self) -> Uncertainty:
        """Return the errors, which reach to where the readings would move the constants."""
        whole = self.covariance_z[: len(self.moves), : len(self.moves)]
        errors = np.sqrt(np.diag(whole))
        reach = np.abs(self.moves @ self.pulls) + QUANTILE_95 * errors
        wide = reaching(whole, np.where(np.isfinite(errors), reach, 0.0))
        return replace(self.recorded, covariance_z=wide)

    def tensions(self, problem: Problem, place: Array) -> tuple[Tension, ...]:
        """Return the known and the assumed values about which the readings tell."""
        flat = problem.stand(place).updated(dict(problem.experiments[0].settings)).flat()
        # of known values with the constants as exact, since the minimum is sought with them
        variances = np.diag(self.recorded.covariance_z)
        rows = []
        for k, one in enumerate(problem.free):
            if one.name in problem.known:
                value, share = problem.known[one.name]
                per = one.slope(value) / value
                offset = (place[k] - one.to_coordinate(value)) * per
                rows.append((one.name, value, share, variances[k] * per**2, offset))
        for k, (name, share) in enumerate(self.shares.items()):
            value = float(flat.get(name, 1.0))
            rows.append((name, value, share, self.left_z[k, k], self.pulls[k]))
        found = []
        for name, value, share, left, offset in rows:
            told = 1.0 - left / share**2
            if told > left / UNDETERMINED**2:
                with np.errstate(over='ignore'):
                    preferred = value * float(np.exp(offset / told))
                apart = abs(float(offset)) / (share * math.sqrt(told))
                found.append(Tension(name, value, share, preferred, apart))
        return tuple(found)


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
    free: Iterable[str],
    experiments: Sequence[Experiment],
) -> tuple[str, ...]:
    """Add the error of feet if no feet or contacts were given, and return a note about them."""
    given = parameters.changed().keys() - {*free}
    is_own = all('stand.weight' in one.settings for one in experiments)  # of this package
    if is_own or any(name.startswith(('feet.', 'contact.')) for name in given):
        return ()
    shares.setdefault(FEET_NUMBER, _FEET_SHARE)
    note = 'feet and contacts are those of the paper, as none were described; describe yours with '
    return (note + '--stage or feet.* (docs/howto/which_stage.md)',)


def assume(
    problem: Problem, place: Array, recorded: Uncertainty, shares: Mapping[str, float]
) -> Assumed:
    """Return what the errors of constants do at a minimum; those without an error do nothing."""
    shares = {name: share for name, share in shares.items() if share}
    priors = np.array(list(shares.values()))
    moves, information = np.zeros((len(place), len(shares))), np.diag(priors**-2.0)
    pulled = np.zeros(len(shares))
    active = np.flatnonzero(~(recorded.at_bound | recorded.inert))
    if shares and len(active):
        columns = slopes_of_constants(problem, place, list(shares))
        slopes = problem.slopes(place, central=True)[:, active]
        lengths = np.sqrt(np.sum(slopes**2, axis=0))
        basis, values, directions = np.linalg.svd(slopes / lengths, full_matrices=False)
        seen = values > RANK * values[0]
        along = basis[:, seen].T @ columns
        apart = columns - basis[:, seen] @ along
        back = directions[seen].T / values[seen]
        moves[active] = -(back @ along) / lengths[:, np.newaxis]
        moves[~np.isfinite(np.diag(recorded.covariance_z))] = 0.0
        scale = max(recorded.variance_scale, np.finfo(np.float64).tiny)
        information += apart.T @ apart / scale
        pulled = -apart.T @ problem.residuals(place) / scale
    left_z = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return Assumed(shares, recorded, moves, left_z, left_z @ pulled)


def slopes_of_constants(problem: Problem, place: Array, names: Sequence[str]) -> Array:
    """Return the slopes of the residuals per relative change, shape (residuals, constants)."""
    stand, count = problem.stand(place), len(problem.experiments)
    ends = [(name, math.exp(way)) for name in names for way in (-STEP, STEP)]
    changed = tuple(_changed(stand, one, *end) for end in ends for one in problem.experiments)
    many = replace(problem, experiments=changed, shifts_s=problem.shifts_s * len(ends))
    rows, found = iter(many.predicted([stand])[0]), list[Predicted]()
    for name, factor in ends:
        forces = OF_FORCES if name in FACTORS_ASSUMED else ()  # which ``_changed`` divided
        found.append(
            [
                [
                    replace(each, values=factor * each.values) if seen.unit in forces else each
                    for each, seen in zip(row, one.seen, strict=True)
                ]
                for row, one in zip(islice(rows, count), problem.experiments, strict=True)
            ]
        )
    none = np.zeros_like(place)
    pairs = zip(found[::2], found[1::2], strict=True)
    return np.column_stack(
        [problem.whitened(high, low, none) / (2.0 * STEP) for low, high in pairs]
    )


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
