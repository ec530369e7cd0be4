# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The report of a fit: sections, warnings, the object for JSON, and a ROS parameter file."""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

import stickslip_ros
from stickslip_ros.drive.records import VOLTAGE
from stickslip_ros.errors import WrongKind
from stickslip_ros.files import prepare_output
from stickslip_ros.lab.experiments.experiment import Experiment, SawtoothSteps, Seen, Voltage
from stickslip_ros.lab.fitting.assumed import APART_MAX, FACTORS_ASSUMED
from stickslip_ros.lab.fitting.free import PREFACTOR, RMS_HEIGHT
from stickslip_ros.lab.fitting.missing import Trial
from stickslip_ros.lab.fitting.result import MISSED_MOST, P_VALUE_MIN, FitResult, Ratio
from stickslip_ros.lab.fitting.statistics import Estimate
from stickslip_ros.lab.runs.plottable import Plottable
from stickslip_ros.lab.waveform.recognise import LOW_SHARE
from stickslip_ros.parameters import dump_yaml
from stickslip_ros.sections import Section, plain
from stickslip_ros.units import display_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JSON, YAML, HTML = ('.json',), ('.yaml', '.yml'), ('.html', '.htm')
CORRELATED = 0.95
CONDITION_MAX = 30.0
"""Condition number from which parameters are collinear (Belsley, Kuh, Welsch 1980)."""
EXPLAINED = 0.5  # largest share of chi-square that the cause of a misfit leaves
OPPOSITE = -0.3  # largest correlation of model and readings of opposite sign
_SIMILAR = 0.05  # largest relative difference of equal parameters of two minima
_CHECK = 'check preload, units of the columns, clocks, and the voltage of the recording'
_FAILED = 'The fit failed its checks, so no errors are given: see the warnings below.'
SHOWN = 0.1  # least part of a parameter in a combination that is named


class Fit(Plottable, FitResult):
    """
    The result of a fit.

    Attributes
    ----------
    problem : Problem
        The problem, with the cycles of each run.
    searches, refined : tuple of Minimum
        Ends of the searches, and of those continued from the best with more cycles.
    others : tuple of Minimum
        Other minima that traces do not rule out.
    steady : bool
        Whether all runs had enough cycles.
    uncertainty : Uncertainty
        Slopes at the minimum and their consequences.
    predicted : list of lists of Prediction
        Predictions of the fitted stand, for each experiment and each quantity.
    missing : tuple of Missing
        Parameters that the stand may lack, the best first.
    trial : Trial or None
        A second fit with resonance and bandwidth free too, if a parameter is missing.
    wall_s : float
        Duration, s.
    notes : tuple of str
        Changes of the stand for the fit.

    """

    def sections(self) -> Iterator[Section]:
        """Yield estimates, quality, readings over time, correlations, missing parameters."""
        header = 'parameter', 'estimate', 'std error', '95 % low', '95 % high', 'unit'
        if ratios := [_row(one, holds=self.holds) for one in self.ratios]:
            yield Section('what the recording shows, whatever the feet are', ratios, header)
        estimates = [_row(one, holds=self.holds) for one in self.estimates]
        title = f'fit of {", ".join(one.name for one in self.estimates)}'
        yield Section(title, estimates, header, self._notes(), self._draw)
        yield Section('quality', list(_quality(self)))
        if traces := [_trace_row(*each) for each in self.sensors]:
            header_of = 'recording', 'quantity', 'readings', 'noise', 'missed', 'unit', 'late (us)'
            yield Section('readings over time', traces, header_of)
            drove = [
                (PurePath(one.origin).name, note)
                for one in self.experiments
                if isinstance(one.drive, Voltage)
                for note in one.drive.notes
            ]
            yield Section('driving voltage', drove)
        if told := [
            (each.name, *(f'{value:.4g}' for value in each[1:])) for each in self.tensions
        ]:
            heads = (
                'known or assumed',
                'value',
                'relative error',
                'readings prefer',
                'std errors apart',
            )
            yield Section('constants about which the readings tell', told, heads)
        if len(self.estimates) > 1:
            names = [one.name for one in self.estimates]
            rows = [
                (f'{k} {name}', *('-' if np.isnan(value) else f'{value:+.2f}' for value in row))
                for k, (name, row) in enumerate(
                    zip(names, self.uncertainty.correlation, strict=True), 1
                )
            ]
            yield Section('correlation', rows, ('', *range(1, len(names) + 1)))
        if self.missing:
            title = 'possibly missing parameters: chi-square per reading, noise and sensor alone'
            rows = [
                (each.name, *(f'{value / self.readings:.4g}' for value in each[1:3]))
                for each in self.missing
            ]
            yield Section(title, rows, ('parameter', 'now', 'if free'))

    def _draw(self) -> 'Figure':
        from stickslip_ros.lab.fitting.figure import draw_fit  # noqa: PLC0415 - takes long

        return draw_fit(self)

    def _notes(self) -> list[str]:
        notes = (f'Note: {note}.' for note in self.notes)
        warnings = (f'Warning: {warning}.' for warning in warnings_of(self))
        basis = f'Errors: {basis_of(self)}.' if self.holds else _FAILED
        return [basis, *self._assumed(), *notes, *warnings]

    def _assumed(self) -> Iterator[str]:
        sources = dict[str, list[str]]()
        for one in self.estimates:
            sources.setdefault(self.scale_of(one.name), []).append(one.name)
        words = (f'{source}: {", ".join(names)}' for source, names in sources.items())
        yield f'Scale {"; ".join(words)}.'
        shares = self.assumed.shares.items()
        if shares and self.holds:
            errors = ', '.join(f'{name} {100.0 * share:.3g} %' for name, share in shares)
            yield (
                f'Assumed errors, also in covariance and draws: {errors}; '
                '--assume NAME=VALUE+-SHARE% changes them.'
            )

    def __repr__(self) -> str:
        estimates = (_estimate(one, holds=self.holds) for one in self.estimates)
        return '\n'.join([*estimates, *self._notes()])


def warnings_of(fit: FitResult) -> tuple[str, ...]:
    """Return sentences about the doubts of a fit."""
    lacks = fit.missing[0].name if fit.missing else ''
    return (
        *(text for one in fit.experiments for text in one.notes),
        *_misfit_warnings(fit),
        *_search_warnings(fit),
        *(
            text
            for one in fit.estimates
            for text in _estimate_warnings(one, lacks, holds=fit.holds)
        ),
        *_trade_warnings(fit),
    )


def as_object(fit: FitResult) -> Any:
    """Return a fit as an object for JSON: None stands for infinity and not a number."""
    doubt = fit.uncertainty
    return plain(
        {
            'estimates': [{**vars(one), 'is_log': one.is_log} for one in fit.estimates],
            'names': [one.name for one in fit.estimates],
            'coordinates': fit.found.coordinates,
            'covariance_of_coordinates': doubt.covariance_z,
            'covariance': fit.covariance,
            'correlation': fit.uncertainty.correlation,
            'sigma_known': fit.problem.noise.known,
            'noise_n': fit.noise_n,
            'allowance': fit.problem.allowance,
            'known': fit.problem.known,
            'assumed': fit.assumed.shares,
            'tensions': fit.tensions,
            'ratios': fit.ratios,
            'chi_square': fit.chi_square,
            'dof': doubt.dof,
            'reduced_chi_square': fit.reduced_chi_square,
            'p_value': fit.p_value,
            'holds': fit.holds,
            'covariance_scale': doubt.variance_scale,
            'interval_quantile': doubt.quantile,
            'singular_values': doubt.singular_values,
            'condition_number': doubt.condition,
            'warnings': warnings_of(fit),
            'notes': fit.notes,
            'converged': fit.found.converged,
            'starts': len(fit.searches),
            'starts_in_same_minimum': fit.same,
            'evaluations': fit.evaluations,
            'wall_s': fit.wall_s,
            'missing': fit.missing,
            'trial': fit.trial,
            'bands': _of_bands(fit),
            'points': _points(fit),
            'traces': _traces(fit),
            'parameters': fit.parameters.changed(),
        }
    )


def check_output(path: Path) -> None:
    """Refuse a file of another kind, or a file that cannot be written, before the work."""
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
        if others := sorted(had - fit.settings_of_all.keys()):
            made += f'The experiments differ in {", ".join(others)}: the stand keeps its own.\n'
        text = dump_yaml(fit.parameters, f'{made}{fit}')
    path.write_text(text, encoding='utf-8')


def _search_warnings(fit: FitResult) -> Iterator[str]:
    if not fit.found.converged:
        yield 'the search did not converge: raise --starts, or narrow --bounds'
    if not fit.steady:
        drives = [one.drive for one in fit.experiments if isinstance(one.drive, SawtoothSteps)]
        is_counted = not all(drive.is_steady for drive in drives)
        depends = ': their forces are those after this number of steps' if is_counted else ''
        most = max(drive.steps for drive in drives)
        yield f'some runs are not steady after {most} steps{depends}'
    if fit.others:
        other = fit.others[0]
        there = ', '.join(_other_minima(fit, fit.problem.values(other.place)))
        yield (
            f'{len(fit.others)} other minima are not ruled out at 95 %, the next with a '
            f'chi-square {other.chi_square - fit.chi_square:.2g} above: '
            f'{there or "near this one"}; the intervals cover all of them'
        )
    elif fit.rivals:
        yield (
            f'{fit.rivals} of {len(fit.searches)} searches ended in another minimum that the '
            'points do not rule out at 95 %: the intervals hold for this one only'
        )
    if fit.holds and not fit.missing and fit.problem.allowance is not None:
        for one, each, sensor in fit.sensors:
            least = fit.problem.allowance.reading_m if each.unit == 'm' else 0.0
            if sensor['rms'] > MISSED_MOST * max(sensor['noise'], least):
                factor, unit = display_unit(each.unit)
                yield (
                    f'{one.origin}: the model misses {each.quantity} by '
                    f'{factor * sensor["rms"]:.2g} {unit}, its noise is '
                    f'{factor * sensor["noise"]:.2g} {unit}, and no tested parameter explains '
                    'it: the intervals rest on the allowance'
                )


def _misfit_warnings(fit: FitResult) -> Iterator[str]:
    """Yield the reasons against a fit, with remedies."""
    readings, is_unlikely = fit.readings, fit.p_value is not None and fit.p_value < P_VALUE_MIN
    if is_unlikely:
        yield from _divided_monitors(fit)
        yield (
            f'p-value {fit.p_value:.2g}: the model misses the points by more than their standard '
            'errors; either these are too small or the model is wrong: values and intervals are '
            'not reliable'
        )
    for each in fit.tensions:
        if each.apart > APART_MAX:
            yield (
                f'{each.name} is {each.value:.4g} +- {100.0 * each.share:.3g} %, but the '
                f'readings prefer {each.preferred:.3g}, {each.apart:.3g} standard errors off: '
                'check it, describe feet and contacts (--stage, feet.*, contact.*), or free '
                'contact.radius'
            )
    worst = fit.missing[0] if fit.missing else None
    if worst and fit.is_trial_different and fit.trial and fit.trial.found < worst.expected:
        yield _other_drive(fit, fit.trial)
    elif worst and not fit.holds:
        yield (
            f'the model is incomplete: freeing {worst.name} would lower chi-square per reading '
            f'from {worst.chi_square / readings:.3g} to {worst.expected / readings:.3g}; until '
            'then no interval is reliable'
        )
    elif fit.problem.has_traces and is_unlikely:
        yield f'no tested parameter explains the misfit: {_CHECK}'
    if worst and fit.is_missing_much and worst.expected > EXPLAINED * worst.chi_square:
        yield f'no parameter explains half of the misfit: {_CHECK}'
    if is_unlikely:
        yield from _opposite_ways(fit)
    for one, drift_m_per_s in fit.drifts:
        yield (
            f'{one.origin}: the fit explains most of the motion as a drift of the sensor, '
            f'{1e6 * drift_m_per_s:.3g} um/s: no value is reliable; {_CHECK}'
        )


def _divided_monitors(fit: FitResult) -> Iterator[str]:
    amplifier = fit.parameters.amplifier
    range_v = amplifier.voltage_max - amplifier.voltage_min
    for one in fit.experiments:
        if not isinstance(one.drive, Voltage):
            continue
        covered_v = float(np.ptp(one.drive.rows[:, VOLTAGE]))
        if covered_v < LOW_SHARE * range_v:
            yield (
                f'{one.origin}: its voltage covers {covered_v:.3g} V of the {range_v:g} V of the '
                'amplifier: if the monitor is divided, give its unit, as voltage_v="NAME (100 V)"'
            )


def _other_drive(fit: FitResult, trial: Trial) -> str:
    """Return a warning about a trial with more free parameters and another result."""
    there = ', '.join(_other_minima(fit, trial.values))
    return (
        f'the model is incomplete: with {", ".join(trial.names)} free too, chi-square per '
        f'reading falls from {trial.chi_square / fit.readings:.3g} to '
        f'{trial.found / fit.readings:.3g}, with other values: {there}; free them'
    )


def _other_minima(fit: FitResult, values: Sequence[float]) -> Iterator[str]:
    """Yield the parameters with other values at another minimum."""
    for one, value in zip(fit.estimates, values, strict=True):
        if not math.isclose(value, one.value, rel_tol=_SIMILAR):
            yield f'{one.name} {value:.4g}'


def _opposite_ways(fit: FitResult) -> Iterator[str]:
    """Yield quantities of opposite sign to the stand at the start: the fitted stand may rest."""
    [began] = fit.problem.predicted([fit.problem.stand(fit.problem.start)])
    for number, one, each, _ in fit.problem.seen:
        model = began[number][one.seen.index(each)].values
        if each.is_trace and np.ptp(model) > 0.0:
            correlation = float(np.corrcoef(model, each.values)[0, 1])
            if correlation < OPPOSITE:
                yield (
                    f'{one.origin}: {each.quantity} has the opposite sign of the model '
                    f'(correlation {correlation:.2f}): if its sensor counts the other way, give '
                    f'{each.quantity}="NAME (-1 {each.unit})"; if the piezo moves against its '
                    'voltage, set feet.gain below 0; else check the driving voltage'
                )


def _estimate_warnings(one: Estimate, lacks: str, *, holds: bool) -> Iterator[str]:
    if one.at_bound:
        where = f'{one.name} sits on its bound, {one.value:.6g} {one.unit}'.rstrip()
        if one.is_limited(one.value):
            yield f'{where}: no standard error, and the other intervals hold for this value only'
        else:
            remedy = f'free {lacks}, which the stand may lack, before its bounds are widened'
            wider = f'give wider --bounds {one.name}=LOW:HIGH'
            yield f'{where}: no estimate, no intervals; {remedy if lacks else wider}'
    elif one.inert:
        yield f'{one.name} has no effect on the readings; the others hold for this value of it'
    elif one.undetermined and holds:
        yield (
            f'{one.name} is not determined by the readings: others compensate a change of it, and '
            f'{one.value:.3g} is an example; measure under another preload too (--plan 5 lists '
            'the best measurements), or set it instead of freeing it'
        )
    elif abs(one.value) < one.standard_error < math.inf:
        yield f'{one.name} has a standard error above its value'


def _trade_warnings(fit: FitResult) -> Iterator[str]:
    names = [one.name for one in fit.estimates]
    for row, column in zip(*np.triu_indices(len(names), k=1), strict=True):
        correlation = float(fit.assumed.recorded.correlation[row, column])
        if abs(correlation) > CORRELATED:
            yield f'{names[row]} and {names[column]} are correlated by {correlation:+.3f}'
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


def _points(fit: FitResult) -> list[dict[str, Any]]:
    """Return an object for each fitted number."""
    rows = list[dict[str, Any]]()
    for number, one, each, noise in fit.problem.seen:
        if isinstance(one.drive, Voltage):
            continue
        measured = float(each.values[0])
        modelled = float(fit.predicted[number][one.seen.index(each)].values[0])
        rows.append(
            {
                'preload_n': one.settings['stand.preload'],
                **one.drive._asdict(),
                'quantity': each.quantity,
                'measured': measured,
                'model': modelled,
                'residual': modelled - measured,
                **({'sigma': noise} if fit.problem.noise.known else {}),
            }
        )
    return rows


def _of_bands(fit: FitResult) -> str:
    """Return a note on bands of draws; empty if they are as wide as the readings allow."""
    notes = list[str]()
    if not (fit.has_forces or fit.assumed.shares.keys().isdisjoint(FACTORS_ASSUMED)):
        notes.append(
            'draws have the errors of the assumed contact, so bands of a motion are too wide; '
            'fit with --assume scale=+-0% --assume feet=+-0% for narrow ones'
        )
    preloads = {one.settings.get('stand.preload') for one in fit.experiments}
    names = {one.name for one in fit.estimates}
    is_curved = 'contact.friction' in names and not names.isdisjoint((PREFACTOR, RMS_HEIGHT))
    if fit.problem.has_traces and len(preloads) == 1 and is_curved:
        notes.append(
            'the fit has one preload, so friction and roughness lie on a curve that draws leave: '
            'bands may be up to twice too wide; add a second preload'
        )
    return '; '.join(notes)


def _traces(fit: FitResult) -> list[dict[str, Any]]:
    """Return an object for each trace, with its sensor."""
    return [
        {
            'origin': one.origin,
            'settings': dict(one.settings),
            'quantity': each.quantity,
            'readings': len(each.values),
            'left_out': each.left_out,
            **sensor,
            'driven_by': list(one.drive.notes),
        }
        for one, each, sensor in fit.sensors
        if isinstance(one.drive, Voltage)
    ]


def _estimate(one: Estimate, *, holds: bool) -> str:
    if not holds:
        return f'{one.name}: {one.value:.6g} {one.unit}'.rstrip() + ', not reliable'
    if not math.isfinite(one.standard_error):
        return f'{one.name}: {one.value:.6g} {one.unit}'.rstrip() + ', not determined'
    value = f'{one.name}: {one.value:.6g} ± {one.standard_error:.2g} {one.unit}'.rstrip()
    return f'{value}, 95 % interval {one.low:.6g} to {one.high:.6g}'


def _row(one: Estimate | Ratio, *, holds: bool) -> tuple[str, ...]:
    doubt = ('not determined' if getattr(one, 'undetermined', False) and holds else '-', '-', '-')
    if holds and np.isfinite(one.standard_error):
        doubt = (f'{one.standard_error:.2g}', f'{one.low:.6g}', f'{one.high:.6g}')
    return (one.name, f'{one.value:.6g}', *doubt, one.unit)


def _trace_row(one: Experiment, each: Seen, sensor: dict[str, float]) -> tuple[str, ...]:
    factor, unit = display_unit(each.unit)
    noise, rms = (f'{factor * sensor[name]:.3g}' for name in ('noise', 'rms'))
    late = f'{1e6 * sensor["late_s"]:.4g}'
    readings = f'{len(each.values)}'
    return (PurePath(one.origin).name, each.quantity, readings, noise, rms, unit, late)


def basis_of(fit: FitResult) -> str:
    """Return a sentence on the basis of the errors."""
    allowance, doubt = fit.problem.allowance, fit.uncertainty
    if allowance is not None:
        return (
            f'noise of the readings, and an allowance for errors of the model: '
            f'{1e9 * allowance.shape_m:g} nm in each moment of a cycle, '
            f'{100.0 * allowance.step_share:g} % of a step'
        )
    if fit.problem.noise.known:
        return 'from the standard errors of the points; intervals of the normal distribution'
    return (
        'scaled by the residuals, as the points have no standard errors; intervals of the t '
        f'distribution with {doubt.dof} degrees of freedom; no test of the model'
    )


def _quality(fit: FitResult) -> Iterator[tuple[str, object]]:
    doubt = fit.uncertainty
    yield 'points', fit.problem.count
    yield 'degrees of freedom', doubt.dof
    if fit.noise_n is None:
        reduced, p_value = fit.reduced_chi_square, fit.p_value
        yield 'chi-square', f'{fit.chi_square:.4g}'
        yield 'chi-square per degree', '-' if reduced is None else f'{reduced:.4g}'
        yield 'p-value', '-' if p_value is None else f'{p_value:.3g}'
    else:
        yield 'noise of a point, estimated', f'{fit.noise_n:.3g} N'
    yield 'condition number', f'{doubt.condition:.3g}'
    yield 'singular values', ' '.join(f'{value:.3g}' for value in doubt.singular_values)
    if fit.problem.has_traces:
        kinds = f'the best continued, {fit.rivals} to other minima that fit as well'
    else:
        worse = len(fit.searches) - fit.same - fit.rivals
        kinds = f'{fit.same} to this minimum, {fit.rivals} to others that fit as well, '
        kinds += f'{worse} to worse ones'
    yield 'searches', f'{len(fit.searches)}: {kinds}'
    yield 'stands tried', fit.evaluations
    cycles = [one.drive.steps for one in fit.experiments if isinstance(one.drive, SawtoothSteps)]
    if cycles:
        is_steady = all(
            one.drive.is_steady for one in fit.experiments if isinstance(one.drive, SawtoothSteps)
        )
        steps = 'steps until steady' if is_steady else 'steps per run'
        yield steps, f'{min(cycles)} to {max(cycles)}'
    yield 'time', f'{fit.wall_s:.1f} s'
