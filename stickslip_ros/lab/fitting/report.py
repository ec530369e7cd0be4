# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a fit says: sections, warnings, the object for JSON, and a ROS parameter file."""

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
from stickslip_ros.lab.fitting.free import PREFACTOR, RMS_HEIGHT
from stickslip_ros.lab.fitting.missing import Trial
from stickslip_ros.lab.fitting.result import MISSED_MOST, P_VALUE_MIN, FitResult
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
EXPLAINED = 0.5  # share of it that the best parameter may leave, to be a cause
OPPOSITE = -0.3  # correlation of model and readings below which they go opposite ways
_ALIKE = 0.05  # share by which a parameter of another minimum differs to be told
_CHECK = 'check the preload, the units of the columns, their clocks, and what drove the recording'
_DOES_NOT_HOLD = (
    'DO NOT USE THESE VALUES: the fit does not hold, so that no error is told; see below.'
)
SHOWN = 0.1  # part of a combination from which a parameter is named


class Fit(Plottable, FitResult):
    """
    What a fit comes to.

    Attributes
    ----------
    problem : Problem
        What was fitted, with the cycles of each run.
    searches, refined : tuple of Minimum
        Where each search ended, and those that went on from the best with more cycles.
    others : tuple of Minimum
        Other minima that traces do not rule out.
    steady : bool
        Whether all runs had cycles enough.
    uncertainty : Uncertainty
        Slopes at the minimum and what follows from them.
    predicted : list of lists of Prediction
        What the fitted stand shows, for each experiment and what was seen there.
    missing : tuple of Missing
        What the stand may lack, the most telling first.
    trial : Trial or None
        A second fit with resonance and bandwidth free too, where something is missing.
    wall_s : float
        Time it took.
    notes : tuple of str
        What was changed in the stand for it.

    """

    def sections(self) -> Iterator[Section]:
        """Yield the estimates, their quality, what was seen, correlations, what is missing."""
        header = 'parameter', 'estimate', 'std error', '95 % low', '95 % high', 'unit'
        estimates = [_row(one, holds=self.holds) for one in self.estimates]
        title = f'fit of {", ".join(one.name for one in self.estimates)}'
        yield Section(title, estimates, header, self._said(), self._draw)
        yield Section('quality', list(_quality(self)))
        if traces := [_trace_row(*each) for each in self.sensors]:
            header_of = 'recording', 'quantity', 'readings', 'noise', 'missed', 'unit', 'late (us)'
            yield Section('what was seen over time', traces, header_of)
            drove = [
                (PurePath(one.origin).name, said)
                for one in self.experiments
                if isinstance(one.drive, Voltage)
                for said in one.drive.said
            ]
            yield Section('what drove it', drove)
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
            title = 'what the stand may lack: chi-square per reading, noise and sensor alone'
            rows = [
                (each.name, *(f'{value / self.readings:.4g}' for value in each[1:3]))
                for each in self.missing
            ]
            yield Section(title, rows, ('parameter', 'now', 'if it were free'))

    def _draw(self) -> 'Figure':
        from stickslip_ros.lab.fitting.figure import draw_fit  # noqa: PLC0415 - takes long

        return draw_fit(self)

    def _said(self) -> list[str]:
        notes = (f'Note: {note}.' for note in self.notes)
        warnings = (f'Warning: {warning}.' for warning in warnings_of(self))
        basis = f'Errors: {basis_of(self)}.' if self.holds else _DOES_NOT_HOLD
        return [basis, *notes, *warnings]

    def __repr__(self) -> str:
        estimates = (_estimate(one, holds=self.holds) for one in self.estimates)
        return '\n'.join([*estimates, *self._said()])


def warnings_of(fit: FitResult) -> tuple[str, ...]:
    """Return sentences about what is doubtful in a fit; none if nothing is."""
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
    """Return a fit as JSON can hold it: None stands for what is infinite or not a number."""
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
    """Refuse a file of another kind, or that cannot be written, before the work."""
    if path.suffix.lower() not in {*JSON, *YAML, *HTML}:
        raise WrongKind('output', str(path), 'a .json, .yaml or .html file', 'end its name so')
    prepare_output(path)


def write_fit(path: Path, fit: Fit, content: dict[str, Any], origin: str, command: str) -> None:
    """Write a page, what ``as_object`` says as JSON, or the stand as a ROS parameter file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() in HTML:
        fit.save(path, command)
        return
    if path.suffix.lower() in JSON:
        text = json.dumps(content, indent=2) + '\n'
    else:
        made = f'Fitted to {origin} by stickslip fit, version {stickslip_ros.__version__}.\n'
        had = {name for one in fit.experiments for name in one.settings}
        if others := sorted(had - fit.settings_of_all.keys()):
            made += f'The experiments differ in {", ".join(others)}, not taken over from them.\n'
        text = dump_yaml(fit.parameters, f'{made}{fit}')
    path.write_text(text, encoding='utf-8')


def _search_warnings(fit: FitResult) -> Iterator[str]:
    if not fit.found.converged:
        yield 'the search did not converge: raise --starts, or narrow --bounds'
    if not fit.steady:
        drives = [one.drive for one in fit.experiments if isinstance(one.drive, SawtoothSteps)]
        is_counted = not all(drive.is_steady for drive in drives)
        depends = ': their forces hold for so many steps from rest only' if is_counted else ''
        most = max(drive.steps for drive in drives)
        yield f'some runs are not steady after {most} steps{depends}'
    if fit.others:
        other = fit.others[0]
        there = ', '.join(_elsewhere(fit, fit.problem.values(other.place)))
        yield (
            f'{len(fit.others)} other minima are not ruled out at 95 %, the next is chi-square '
            f'{other.chi_square - fit.chi_square:.2g} above: {there or "near this one"}; the '
            'intervals reach all of them'
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
                    f'{factor * sensor["noise"]:.2g} {unit}, and none of the parameters that '
                    'were tried explains it: the intervals rest on the allowance'
                )


def _misfit_warnings(fit: FitResult) -> Iterator[str]:
    """Yield why nothing of a fit may be believed, and what to do about it."""
    readings, is_unlikely = fit.readings, fit.p_value is not None and fit.p_value < P_VALUE_MIN
    if is_unlikely:
        yield from _divided_monitors(fit)
        yield (
            f'p-value {fit.p_value:.2g}: the model misses the points by more than their standard '
            'errors; either these are too small or the model is wrong: neither values nor '
            'intervals hold'
        )
    worst = fit.missing[0] if fit.missing else None
    if worst and fit.is_another and fit.trial and fit.trial.found < worst.expected:
        yield _other_drive(fit, fit.trial)
    elif worst and not fit.holds:
        yield (
            f'the stand lacks something: freeing {worst.name} would lower chi-square per reading '
            f'from {worst.chi_square / readings:.3g} to {worst.expected / readings:.3g}; until '
            'then no interval holds'
        )
    elif fit.problem.has_traces and is_unlikely:
        yield f'no parameter that was tried explains what the model misses: {_CHECK}'
    if worst and fit.is_missing_much and worst.expected > EXPLAINED * worst.chi_square:
        yield f'no parameter explains half of what the model misses: {_CHECK}'
    if is_unlikely:
        yield from _opposite_ways(fit)
    for one, drift_m_per_s in fit.drifts:
        yield (
            f'{one.origin}: the fit takes most of the motion for a drift of the sensor, '
            f'{1e6 * drift_m_per_s:.3g} um/s: no value holds; {_CHECK}'
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
    """Return what a trial with more free parameters finds instead."""
    there = ', '.join(_elsewhere(fit, trial.values))
    return (
        f'the stand lacks something: with {", ".join(trial.names)} free too, chi-square per '
        f'reading falls from {trial.chi_square / fit.readings:.3g} to '
        f'{trial.found / fit.readings:.3g}, and another drive is found: {there}; free them'
    )


def _elsewhere(fit: FitResult, values: Sequence[float]) -> Iterator[str]:
    """Yield the parameters that have other values elsewhere."""
    for one, value in zip(fit.estimates, values, strict=True):
        if not math.isclose(value, one.value, rel_tol=_ALIKE):
            yield f'{one.name} {value:.4g}'


def _opposite_ways(fit: FitResult) -> Iterator[str]:
    """Yield what goes against the stand at the start: the fitted one may stand still."""
    [began] = fit.problem.predicted([fit.problem.stand(fit.problem.start)])
    for number, one, each, _ in fit.problem.seen:
        model = began[number][one.seen.index(each)].values
        if each.is_trace and np.ptp(model) > 0.0:
            together = float(np.corrcoef(model, each.values)[0, 1])
            if together < OPPOSITE:
                yield (
                    f'{one.origin}: {each.quantity} goes against the model (correlation '
                    f'{together:.2f}): if its sensor counts the other way, change the sign of '
                    'the readings; else check what drove it'
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
        yield f'{one.name} changes nothing of what was seen; the others hold for this value of it'
    elif one.undetermined and holds:
        yield (
            f'{one.name} is not determined by what was seen: others make up for a change of it; '
            f'{one.value:.3g} is one value of many; measure under another preload too '
            '(--plan 5 says what tells most), or set it and do not free it'
        )
    elif abs(one.value) < one.standard_error < math.inf:
        yield f'{one.name} has a standard error above its value'


def _trade_warnings(fit: FitResult) -> Iterator[str]:
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


def _points(fit: FitResult) -> list[dict[str, Any]]:
    """Return the numbers that were fitted, one object each."""
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
    """Return what is to be known of bands of draws; nothing of most fits."""
    preloads = {one.settings.get('stand.preload') for one in fit.experiments}
    names = {one.name for one in fit.estimates}
    is_curved = 'contact.friction' in names and not names.isdisjoint((PREFACTOR, RMS_HEIGHT))
    if not (fit.problem.has_traces and len(preloads) == 1 and is_curved):
        return ''
    return (
        'the fit is of one preload, which tells friction and roughness along a curve that draws '
        'leave: bands may be up to twice as wide as need be; a second preload mends that'
    )


def _traces(fit: FitResult) -> list[dict[str, Any]]:
    """Return what was seen over time and how the sensors are, one object each."""
    return [
        {
            'origin': one.origin,
            'settings': dict(one.settings),
            'quantity': each.quantity,
            'readings': len(each.values),
            'left_out': each.left_out,
            **sensor,
            'driven_by': list(one.drive.said),
        }
        for one, each, sensor in fit.sensors
        if isinstance(one.drive, Voltage)
    ]


def _estimate(one: Estimate, *, holds: bool) -> str:
    if not holds:
        return f'{one.name}: {one.value:.6g} {one.unit}'.rstrip() + ', which does not hold'
    if not math.isfinite(one.standard_error):
        return f'{one.name}: {one.value:.6g} {one.unit}'.rstrip() + ', not determined'
    value = f'{one.name}: {one.value:.6g} ± {one.standard_error:.2g} {one.unit}'.rstrip()
    return f'{value}, 95 % interval {one.low:.6g} to {one.high:.6g}'


def _row(one: Estimate, *, holds: bool) -> tuple[str, ...]:
    doubt = ('not determined' if one.undetermined and holds else '-', '-', '-')
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
    """Return a sentence that says what the errors rest on."""
    allowance, doubt = fit.problem.allowance, fit.uncertainty
    if allowance is not None:
        return (
            f'noise of the readings, and an allowance for what the model is wrong by: '
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
        kinds = f'the best followed to their ends, {fit.rivals} to other minima that fit as well'
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
