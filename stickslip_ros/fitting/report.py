"""What a fit says: warnings, the object for JSON, and the stand as a ROS parameter file."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import stickslip_ros
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import prepare_output
from stickslip_ros.fitting.coverage import Coverage
from stickslip_ros.fitting.fit import Fit
from stickslip_ros.fitting.statistics import Estimate
from stickslip_ros.parameters import dump_yaml

JSON, YAML = ('.json',), ('.yaml', '.yml')
CORRELATED = 0.95
CONDITION_MAX = 30.0
"""Condition number from which parameters are collinear (Belsley, Kuh, Welsch 1980)."""
P_VALUE_MIN = 0.01
SHOWN = 0.1  # part of a combination from which a parameter is named


def warnings_of(fit: Fit) -> tuple[str, ...]:
    """Return sentences about what is doubtful in a fit; none if nothing is."""
    return (
        *_search_warnings(fit),
        *(text for one in fit.estimates for text in _estimate_warnings(one)),
        *_trade_warnings(fit),
    )


def as_object(fit: Fit, coverage: Sequence[Coverage] = ()) -> dict[str, Any]:
    """Return a fit as JSON can hold it: None stands for what is infinite or not a number."""
    doubt, points = fit.uncertainty, fit.problem.points
    content = {
        'estimates': [{**vars(one), 'is_log': one.is_log} for one in fit.estimates],
        'names': [one.name for one in fit.estimates],
        'covariance': fit.covariance.tolist(),
        'correlation': fit.uncertainty.correlation.tolist(),
        'sigma_known': points.sigma_n is not None,
        'noise_n': fit.noise_n,
        'chi_square': fit.chi_square,
        'dof': doubt.dof,
        'reduced_chi_square': fit.reduced_chi_square,
        'p_value': fit.p_value,
        'covariance_scale': doubt.variance_scale,
        'interval_quantile': doubt.quantile,
        'singular_values': doubt.singular_values,
        'condition_number': doubt.condition,
        'warnings': warnings_of(fit),
        'notes': list(fit.notes),
        'converged': fit.found.converged,
        'starts': len(fit.searches),
        'starts_in_same_minimum': fit.same,
        'evaluations': fit.evaluations,
        'wall_s': fit.wall_s,
        'points': _points(fit),
        'coverage': [vars(one) for one in coverage],
        'parameters': fit.parameters.changed(),
    }
    return {name: _plain(value) for name, value in content.items()}


def check_output(path: Path) -> None:
    """Refuse a file that is neither JSON nor YAML, or cannot be written, before the work."""
    if path.suffix.lower() not in {*JSON, *YAML}:
        raise WrongKind('output', str(path), 'a .json or .yaml file', 'end its name so')
    prepare_output(path)


def write_fit(path: Path, fit: Fit, content: dict[str, Any], origin: str) -> None:
    """Write what ``as_object`` says as JSON, or the fitted stand as a ROS parameter file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() in JSON:
        text = json.dumps(content, indent=2) + '\n'
    else:
        lines = [f'Fitted to {origin} by stickslip fit, version {stickslip_ros.__version__}.']
        for one in fit.estimates:
            value = f'{one.value:.6g} {one.unit}'.rstrip() + ', not determined'
            if math.isfinite(one.standard_error):
                value = f'{one.value:.6g} ± {one.standard_error:.2g} {one.unit}'.rstrip()
                value += f', 95 % interval {one.low:.6g} to {one.high:.6g}'
            lines.append(f'{one.name}: {value}')
        lines += [f'Note: {note}' for note in content['notes']]
        lines += [f'Warning: {warning}' for warning in content['warnings']]
        text = dump_yaml(fit.parameters, '\n'.join(lines))
    path.write_text(text, encoding='utf-8')


def _search_warnings(fit: Fit) -> Iterator[str]:
    if not fit.found.converged:
        yield 'the search did not converge: raise --starts, or narrow --bounds'
    if not fit.steady:
        is_counted = fit.problem.points.steps is not None
        depends = ': their forces hold for so many steps from rest only' if is_counted else ''
        yield f'some runs are not steady after {max(fit.problem.cycles)} steps{depends}'
    if fit.rivals:
        yield (
            f'{fit.rivals} of {len(fit.searches)} searches ended in another minimum that the '
            'points do not rule out at 95 %: the intervals hold for this one only'
        )
    if fit.p_value is not None and fit.p_value < P_VALUE_MIN:
        yield (
            f'p-value {fit.p_value:.2g}: the model misses the points by more than their standard '
            'errors; either these are too small or the model is wrong, and the intervals with it'
        )


def _estimate_warnings(one: Estimate) -> Iterator[str]:
    if one.at_bound:
        where = f'{one.name} sits on its bound, {one.value:.6g} {one.unit}'.rstrip()
        if one.is_limited(one.value):
            yield f'{where}: no standard error, and the other intervals hold for this value only'
        else:
            yield f'{where}: no estimate, no intervals; give wider --bounds {one.name}=LOW:HIGH'
    elif one.inert:
        yield f'{one.name} does not change the forces at all'
    elif one.undetermined:
        yield f'{one.name} is not determined: others make up for any change of it'
    elif abs(one.value) < one.standard_error < math.inf:
        yield f'{one.name} has a standard error above its value'


def _trade_warnings(fit: Fit) -> Iterator[str]:
    names = [one.name for one in fit.estimates]
    for row, column in zip(*np.triu_indices(len(names), k=1), strict=True):
        together = float(fit.uncertainty.correlation[row, column])
        if abs(together) > CORRELATED:
            yield f'{names[row]} and {names[column]} are correlated by {together:+.3f}'
    doubt = fit.uncertainty
    if doubt.condition > CONDITION_MAX:
        parts = [
            f'{part:+.2f} {name}'
            for name, part in zip(names, doubt.weakest, strict=True)
            if abs(part) > SHOWN
        ]
        yield (
            f'condition number {doubt.condition:.3g}, above {CONDITION_MAX:g}: the points hardly '
            f'determine the combination {" ".join(parts)} (effects scaled to equal size)'
        )


def _points(fit: Fit) -> list[dict[str, float]]:
    points = fit.problem.points
    columns = {
        'preload_n': points.preload_n,
        'amplitude_m': points.amplitude_m,
        'frequency_hz': points.frequency_hz,
        'force_n': points.force_n,
        'model_n': fit.model_n,
        'residual_n': fit.model_n - points.force_n,
        'steps': fit.problem.cycles,
    }
    if points.sigma_n is not None:
        columns['force_sigma_n'] = points.sigma_n
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return value
