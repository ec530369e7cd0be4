# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a fit: sections, warnings, the object for JSON, and a ROS parameter file."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

import stickslip_ros
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.figures.plottable import Plottable
from stickslip_ros.lab.fitting.assumed import FACTORS_OF_FORCES, TENSION_MAX
from stickslip_ros.lab.fitting.free import TINY
from stickslip_ros.lab.fitting.missing import ODDS_SURE
from stickslip_ros.lab.fitting.result import FitResult, Ratio
from stickslip_ros.lab.fitting.statistics import Estimate
from stickslip_ros.parameters import dump_yaml
from stickslip_ros.sections import Section, as_json
from stickslip_ros.units import display_unit, unit_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JSON, YAML, HTML = ('.json',), ('.yaml', '.yml'), ('.html', '.htm')
CORRELATED = 0.95  # least strong correlation
OPPOSITE = -0.3  # largest correlation of model and readings of opposite sign
_OF_ROW = re.compile(r' row [0-9]+$')  # row of a table, after the name of its file
_IS_PIECE = re.compile(r'^[0-9.]+ to [0-9.]+ s: (hold|ramp)')  # description of part of a voltage
_CHECK = 'check preload, units of the columns, clocks, and the voltage of the recording'


class Fit(Plottable, FitResult):
    """A fit that can be printed, drawn and saved; its fields are those of ``FitResult``."""

    def sections(self) -> Iterator[Section]:
        """Yield the verdict, the estimates, their figures, and the readings."""
        names = [one.name for one in self.estimates]
        files = (_OF_ROW.sub('', PurePath(one.origin).name) for one in self.experiments)
        title = f'fit of {", ".join(names)} to {", ".join(dict.fromkeys(files))}'
        yield Section(title, notes=[verdict_of(self)])
        header = 'parameter', 'value', 'std error', '95 % low', '95 % high', 'unit'
        if ratios := [_row(one, holds=self.holds) for one in self.ratios]:
            yield Section('what the recording shows, whatever the feet are', ratios, header)
        estimates = [_row(one, holds=self.holds) for one in self.estimates]
        yield Section('fitted parameters', estimates, header, self._notes())
        yield Section('readings (A) and model (B)', draw=self._draw)
        if len(names) > 1 and self.holds:
            yield Section('correlations of the parameters', draw=self._draw_correlations)
        if traces := [_trace_row(*each) for each in self.sensors]:
            columns = 'recording', 'quantity', 'readings', 'noise', 'missed', 'unit', 'late (us)'
            yield Section('readings over time', traces, (*columns, 'drift (per s)'))
        yield Section('quality', list(_quality(self)))

    def _draw(self) -> 'Figure':
        from stickslip_ros.lab.fitting.figure import draw_fit  # noqa: PLC0415 - takes long

        return draw_fit(self)

    def _draw_correlations(self) -> 'Figure':
        from stickslip_ros.lab.fitting.figure import draw_correlations  # noqa: PLC0415

        names = [one.name for one in self.estimates]
        return draw_correlations(names, self.uncertainty.correlation)

    def _notes(self) -> list[str]:
        notes = (f'Note: {note}.' for note in self.notes)
        warnings = (f'Warning: {warning}.' for warning in warnings_of(self))
        return [*_assumed(self), *_together(self), *notes, *warnings]

    def __repr__(self) -> str:
        estimates = (_estimate(one, holds=self.holds) for one in self.estimates)
        return '\n'.join([*estimates, verdict_of(self), *self._notes()])


def verdict_of(fit: FitResult) -> str:
    """Return the verdict: the basis of the errors, or the reasons why a fit does not hold."""
    if fit.reasons:
        return f'The fit does not hold, so no errors are given: {"; ".join(fit.reasons)}.'
    if (errors := fit.problem.allowance) is not None:
        basis = (
            'noise of the readings, and estimated errors of the model: '
            f'{1e9 * errors.shape_m:.2g} nm in each moment of a cycle, '
            f'{100.0 * errors.step_share:.2g} % of a step, and {1e9 * errors.slow_m:.2g} nm that '
            'changes slowly'
        )
    elif not fit.problem.is_estimated:
        basis = 'from the standard errors of the points; intervals of the normal distribution'
    else:
        basis = (
            'scaled by the residuals, as the points have no standard errors; intervals of the t '
            f'distribution with {fit.uncertainty.dof} degrees of freedom; no test of the model'
        )
    return f'The fit holds. Errors: {basis}.'


def _assumed(fit: FitResult) -> Iterator[str]:
    sources = dict[str, list[str]]()
    for one in fit.estimates:
        sources.setdefault(fit.scale_of(one.name), []).append(one.name)
    words = (f'{source}: {", ".join(names)}' for source, names in sources.items())
    yield f'Scale {"; ".join(words)}.'
    shares = fit.uncertainty.shares.items()
    if shares and fit.holds:
        errors = ', '.join(
            f'{name} '
            + (f'{100.0 * each:.3g} %' if each < 1.0 else f'a factor {math.exp(each):.2g}')
            for name, each in shares
        )
        yield (
            f'Assumed errors, also in the covariance: {errors}; '
            '--assume NAME=VALUE+-SHARE% changes them.'
        )


def _together(fit: FitResult) -> Iterator[str]:
    """Yield a sentence on strongly correlated parameters."""
    names = [one.name for one in fit.estimates]
    like = np.abs(fit.uncertainty.correlation) > CORRELATED
    np.fill_diagonal(like, val=False)
    if chosen := [name for name, row in zip(names, like, strict=True) if row.any()]:
        *most, last = chosen
        remedy = 'a second preload separates them'
        if 'runner.mass' in chosen:
            remedy = 'a weighed runner or a second preload separates them'
        yield f'{", ".join(most)} and {last} are strongly correlated: {remedy}.'


def warnings_of(fit: FitResult) -> tuple[str, ...]:
    """Return the warnings of a fit."""
    return (
        *(text for one in fit.experiments for text in one.notes),
        *_lacking(fit),
        *([] if fit.holds else _sign_warnings(fit)),
        *_search_warnings(fit),
        *(text for one in fit.estimates for text in _estimate_warnings(one)),
    )


def _lacking(fit: FitResult) -> Iterator[str]:
    """Yield the likeliest causes of a misfit, or a note that no tested cause explains it."""
    if not fit.missing:
        is_explained = any(each.apart > TENSION_MAX for each in fit.tensions)
        if fit.problem.has_traces and not (fit.holds or is_explained):
            yield f'no tested cause explains the misfit: {_CHECK}'
        return
    best = fit.culprit or fit.missing[0]
    if fit.holds and best.odds < 1.0:
        return
    others = [each.name for each in fit.missing[:3] if each is not best and best.odds < ODDS_SURE]
    odds, rivals = f'{min(best.odds, 1e6):.2g} to 1', ' or '.join(others)
    now, then = (each / fit.readings for each in (best.chi_square, best.expected))
    lacks = f'{best.name} (odds {odds})' + (f', or {rivals}' if rivals else '')
    falls = f'chi-square per reading would fall from {now:.3g} to {then:.3g}'
    if then - 1.0 > 0.5 * (now - 1.0):
        falls += f'; no tested cause explains half of the misfit: {_CHECK}'
    yield f'the stand may lack {lacks}: {falls}'


def _search_warnings(fit: FitResult) -> Iterator[str]:
    if not fit.steady:
        drives = [drive for _, drive in fit.problem.steps]
        is_counted = not all(drive.is_steady for drive in drives)
        depends = ': their forces depend on the number of steps' if is_counted else ''
        yield f'some runs are not steady after {max(each.steps for each in drives)} steps{depends}'


def _sign_warnings(fit: FitResult) -> Iterator[str]:
    """Yield wrong signs against the model at the start, as the fitted model may be at rest."""
    began = fit.problem.predicted_at(fit.problem.start)
    for (one, each, _), model in zip(fit.problem.observed, began, strict=True):
        moves = each.is_trace and np.ptp(model.values) > 0.0
        correlation = np.corrcoef(model.values, each.values)[0, 1] if moves else 0.0
        if correlation < OPPOSITE:
            yield (
                f'{one.origin}: {each.quantity} has the opposite sign of the model '
                f'(correlation {correlation:.2f}): if its sensor counts the other way, give '
                f'{each.quantity}="NAME (-1 {each.unit})"; if the piezo moves against its '
                'voltage, set feet.gain below 0; else check the driving voltage'
            )


def _estimate_warnings(one: Estimate) -> Iterator[str]:
    if one.at_bound and not one.is_limit(one.value):
        where = f'{one.name} sits on its bound, {one.value:.6g} {one.unit}'.rstrip()
        remedy = f'--bounds {one.name}=LOW:HIGH moves it'
        yield f'{where}: it has no interval, and the other intervals hold for this value; {remedy}'
    elif one.inert:
        yield (
            f'{one.name} has no effect on the readings and keeps its start; it is not written to '
            'parameter files'
        )
    elif one.undetermined:
        yield (
            f'{one.name} is not determined by the readings, as other parameters compensate it: '
            f'{one.value:.3g} is one of many values; measure under another preload too, or set '
            'it instead of freeing it'
        )
    elif abs(one.value) < one.standard_error < math.inf:
        yield f'{one.name} has a standard error above its value'


_AS_THEY_ARE = (
    *('noise_of_numbers', 'chi_square', 'reduced_chi_square', 'p_value', 'tensions', 'ratios'),
    *('holds', 'reasons', 'notes', 'evaluations', 'wall_s', 'missing', 'covariance'),
)
"""Properties of a fit that its JSON contains under the same names."""


def as_object(fit: FitResult) -> Any:
    """Return a fit as an object for JSON, with None for infinity and NaN."""
    doubt = fit.uncertainty
    return as_json(
        {
            'estimates': [
                {**vars(one), 'is_log': one.is_log, 'scale': fit.scale_of(one.name)}
                for one in fit.estimates
            ],
            'names': [one.name for one in fit.estimates],
            'coordinates': doubt.z,
            'covariance_of_coordinates': doubt.covariance_z,
            'natural_coordinates': fit.found.coordinates,
            'covariance_of_natural_coordinates': fit.motion_covariance,
            'correlation': doubt.correlation,
            'sigma_known': not fit.problem.is_bare,
            'allowance': fit.problem.allowance,
            'known': fit.problem.known,
            'assumed': doubt.shares,
            'dof': doubt.dof,
            'covariance_scale': doubt.variance_scale,
            'interval_quantile': doubt.quantile,
            **{name: getattr(fit, name) for name in _AS_THEY_ARE},
            'warnings': warnings_of(fit),
            'converged': fit.found.converged,
            'starts': len(fit.searches),
            'bands': _of_bands(fit),
            'points': _points(fit),
            'traces': [
                {
                    'origin': one.origin,
                    'settings': dict(one.settings),
                    'quantity': each.quantity,
                    'readings': len(each.values),
                    'left_out': each.left_out,
                    'driven_by': list(one.drive.notes) if isinstance(one.drive, Voltage) else [],
                    **sensor,
                }
                for one, each, sensor in fit.sensors
            ],
            'parameters': fit.parameters.changed(),
        }
    )


def check_output(path: Path) -> None:
    """Refuse an unknown kind of file, or a file that cannot be written, before the fit."""
    if path.suffix.lower() not in {*JSON, *YAML, *HTML}:
        raise WrongKind('output', str(path), 'a .json, .yaml or .html file', 'end its name so')
    prepare_output(path)


def write_fit(path: Path, fit: Fit, content: dict[str, Any], origin: str, command: str) -> None:
    """Write a page, the object of ``as_object`` as JSON, or the stand as a ROS parameter file."""
    if path.suffix.lower() in HTML:
        fit.save(path, command)
        return
    if path.suffix.lower() in JSON:
        text = json.dumps(content, indent=2) + '\n'
    else:
        made = f'Fitted to {origin} by stickslip fit, version {stickslip_ros.__version__}.\n'
        had = {name for one in fit.experiments for name in one.settings}
        if others := sorted(had - fit.problem.settings_of_all.keys()):
            names = ', '.join(others)
            made += f'The experiments differ in {names}: the file has the values of the stand.\n'
        inert = {one.name for one in fit.estimates if one.inert}
        text = dump_yaml(fit.parameters, f'{made}{fit}', without=inert)
    path.write_text(text, encoding='utf-8')


def _points(fit: FitResult) -> list[dict[str, Any]]:
    """Return an object for each fitted number."""
    return [
        {
            'preload_n': one.settings.get('stand.preload'),
            **one.drive._asdict(),
            'quantity': each.quantity,
            'measured': float(each.values[0]),
            'model': float(model.values[0]),
            'residual': float(model.values[0] - each.values[0]),
            **({} if fit.problem.is_bare else {'sigma': noise}),
        }
        for (one, each, noise), model in zip(fit.problem.observed, fit.predicted, strict=True)
        if not isinstance(one.drive, Voltage)
    ]


def _of_bands(fit: FitResult) -> str:
    """Return a note that bands of draws hold for motions only; empty if also for forces."""
    shares = [fit.uncertainty.shares.get(name, 0.0) for name in FACTORS_OF_FORCES]
    if fit.has_forces or not any(shares):
        return ''
    return (
        'bands hold for motions; forces also have the error of the assumed contact, '
        f'{100.0 * math.hypot(*shares):.2g} %'
    )


def _estimate(one: Estimate, *, holds: bool) -> str:
    name, value, error, low, high, unit = _row(one, holds=holds)
    unit = f' {unit}'.rstrip()
    if low == '-':
        return f'{name}: {value}{unit}, not {"determined" if holds else "reliable"}'
    return f'{name}: {value} ± {error}{unit}, 95 % interval {low} to {high}'


def _row(one: Estimate | Ratio, *, holds: bool) -> tuple[str, ...]:
    doubt = ('unknown' if getattr(one, 'undetermined', False) and holds else '-', '-', '-')
    digits = _digits(one) if holds and np.isfinite(one.standard_error) else 4
    value, low, high = (f'{each:.{digits}g}' for each in (one.value, one.low, one.high))
    if holds and np.isfinite(one.standard_error):
        doubt = (f'{one.standard_error:.2g}', low, high)
    return (one.name, value, *doubt, one.unit)


def _digits(one: Estimate | Ratio) -> int:
    """Return the number of digits that shows a value to the second digit of its error."""
    larger = abs(one.value) / max(one.standard_error, TINY)
    return max(4, min(math.floor(math.log10(max(larger, 1.0))) + 3, 15))


def _trace_row(one: Experiment, each: Readout, sensor: dict[str, float]) -> tuple[str, ...]:
    factor, unit = display_unit(each.unit)
    noise, rms = (f'{factor * sensor[name]:.3g}' for name in ('noise', 'rms'))
    late = f'{1e6 * sensor["late_s"]:.4g}'
    readings, drift = f'{len(each.values)}', f'{factor * sensor["drift_per_s"]:.3g}'
    return (PurePath(one.origin).name, each.quantity, readings, noise, rms, unit, late, drift)


def _quality(fit: FitResult) -> Iterator[tuple[str, object]]:
    doubt = fit.uncertainty
    yield 'points', fit.problem.count
    if not fit.problem.is_bare:
        reduced, p_value = fit.reduced_chi_square, fit.p_value
        per_degree = '' if reduced is None else f', {reduced:.4g} per degree of freedom'
        yield 'chi-square', f'{fit.chi_square:.4g}{per_degree}'
        if p_value is not None:
            yield 'p-value', f'{p_value:.3g}'
    for quantity, noise in fit.noise_of_numbers.items():
        yield f'noise of {quantity}, estimated', f'{noise:.3g} {unit_of(quantity)}'
    yield 'degrees of freedom', doubt.dof
    for each in (one for one in fit.tensions if one.name in fit.problem.known):
        yield (
            f'{each.name}, known and from the readings',
            f'{each.value:.4g} and {each.preferred:.4g}, {each.apart:.2g} standard errors apart',
        )
    yield 'searches', len(fit.searches)
    yield 'stands tried', fit.evaluations
    if drives := [drive for _, drive in fit.problem.steps]:
        is_steady = all(drive.is_steady for drive in drives)
        counts = [drive.steps for drive in drives]
        steps = 'steps until steady' if is_steady else 'steps per run'
        yield steps, f'{min(counts)} to {max(counts)}'
    driven = [one.drive for one in fit.experiments if isinstance(one.drive, Voltage)]
    notes = [note for drive in driven for note in drive.notes if not _IS_PIECE.search(note)]
    if notes:
        yield 'driven by', '\n'.join(dict.fromkeys(notes))
    yield 'time', f'{fit.wall_s:.1f} s'
