"""A fit as an object for JSON, and the fitted stand as a ROS parameter file."""

import dataclasses
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import stickslip_ros
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.parameters import dump_yaml
from stickslip_ros.study.fitting.coverage import Coverage
from stickslip_ros.study.fitting.fit import Estimate, Fit
from stickslip_ros.study.fitting.warnings import warnings_of

JSON, YAML = ('.json',), ('.yaml', '.yml')


def as_object(
    fit: Fit, notes: Sequence[str] = (), coverage: Sequence[Coverage] = ()
) -> dict[str, Any]:
    """
    Return a fit as JSON can hold it: None stands for what is infinite or not a number.

    Parameters
    ----------
    fit : Fit
        The fit.
    notes : sequence of str
        What was changed for it.
    coverage : sequence of Coverage
        What fits of synthetic data gave, if any were made.

    """
    doubt, points = fit.uncertainty, fit.problem.points
    content = {
        'estimates': [dataclasses.asdict(one) for one in fit.estimates],
        'names': [one.name for one in fit.estimates],
        'covariance': fit.covariance.tolist(),
        'correlation': fit.correlation.tolist(),
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
        'notes': list(notes),
        'converged': fit.converged,
        'starts': len(fit.searches),
        'starts_in_same_minimum': fit.same,
        'evaluations': fit.evaluations,
        'wall_s': fit.wall_s,
        'points': _points(fit),
        'coverage': [dataclasses.asdict(one) for one in coverage],
        'parameters': fit.parameters.changed(),
    }
    return {name: _plain(value) for name, value in content.items()}


def interval_text(one: Estimate) -> str:
    """Return an estimate with its interval in words."""
    if not math.isfinite(one.standard_error):
        return f'{one.value:.6g} {one.unit}'.rstrip() + ', not determined'
    between = f'95 % interval {one.low:.6g} to {one.high:.6g}'
    return f'{one.value:.6g} ± {one.standard_error:.2g} {one.unit}'.rstrip() + f', {between}'


def check_output(path: Path) -> None:
    """
    Refuse a file that is neither JSON nor YAML, before the work is done.

    Raises
    ------
    WrongKind
        If its name has another ending.
    RecordingError
        If it cannot be written.

    """
    if path.suffix.lower() not in {*JSON, *YAML}:
        raise WrongKind('output', str(path), 'a .json or .yaml file', 'end its name so')
    make_room(path)


def write_fit(path: Path, fit: Fit, content: dict[str, Any], origin: str) -> None:
    """
    Write a fit: everything as JSON, or the fitted stand as a ROS parameter file.

    Parameters
    ----------
    path : Path
        The file; its ending decides.
    fit : Fit
        The fit.
    content : dict
        What ``as_object`` made of it.
    origin : str
        Where the points came from, for the heading.

    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() in JSON:
        text = json.dumps(content, indent=2) + '\n'
    else:
        text = dump_yaml(fit.parameters, _heading(fit, content, origin))
    path.write_text(text, encoding='utf-8')


def _heading(fit: Fit, content: dict[str, Any], origin: str) -> str:
    lines = [f'Fitted to {origin} by stickslip fit, version {stickslip_ros.__version__}.']
    lines += [f'{one.name}: {interval_text(one)}' for one in fit.estimates]
    lines += [f'Note: {note}' for note in content['notes']]
    lines += [f'Warning: {warning}' for warning in content['warnings']]
    return '\n'.join(lines)


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
