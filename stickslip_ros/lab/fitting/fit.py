"""A fit of the drive to experiments: the best of many searches, and how good it is."""

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.experiments.clocks import lone_outliers
from stickslip_ros.lab.experiments.experiment import (
    Experiment,
    Seen,
    Voltage,
    noise_of,
    rounding_of,
)
from stickslip_ros.lab.experiments.reading import DriveSource, read_experiments
from stickslip_ros.lab.experiments.sensor_clock import lateness_of, sensor_near
from stickslip_ros.lab.fitting.free import Free, choose_free, choose_known
from stickslip_ros.lab.fitting.metric import Allowance, slower
from stickslip_ros.lab.fitting.missing import missing_from
from stickslip_ros.lab.fitting.problem import (
    FINEST,
    Problem,
    StandardErrors,
    pose,
    silent,
)
from stickslip_ros.lab.fitting.profile import profile
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.result import RULED_OUT_BY, Minimum, best_of
from stickslip_ros.lab.fitting.statistics import uncertainty
from stickslip_ros.lab.runs.batch import Progress, pool_of, run_batch
from stickslip_ros.lab.tables.experiment import MeasuredTable, Reading
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import Show, progress_of

if TYPE_CHECKING:
    from stickslip_ros.lab.tables.formats import Table

STARTS_MAX = 1000
ROUNDS = 6  # searches with ever more cycles, until they suffice at the minimum
WIDENED_MAX = 4  # times that a search goes on beyond bounds that nobody has given
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, at which a search ends: a thousandth of
a standard error."""
_EVALUATIONS_MAX = 60  # steps of a search, from which it is said not to have converged
LOOSE = Allowance(2e-8, 0.3), Allowance(4e-9, 0.05)
"""What the model may be wrong by in the first searches of traces. Steps that are a little too
short add up to a large miss, and a search that is to mend it at once ends elsewhere: from places
up to 1.6 times off in five parameters 6 of 6 searches so found the truth, of those up to 3.3 times
off 9 of 12."""
LOOSE_EVALUATIONS_MAX = 25
AROUND = 1.0
"""Coordinates around the start in which other searches of traces begin: 2.7 times, mostly."""
OTHER = 2.0  # standard errors from which a minimum that is not ruled out is another one
FOLLOWED_MAX = 3  # minima of the first searches from which one goes on
APART = 0.05  # coordinates from which two minima are different ones
CLOSE_S = 5e-7  # change of a clock that asks for another search
ROUNDS_OF_NOISE = 5
TRIED_SLOW_S = (2.5e-5, 8e-5, 2.5e-4)
"""Time constants of sensors that are tried from the start where others leave too much: 6 kHz to
640 Hz. A low-pass hides the ringing of the runner, and a search without it ends elsewhere."""
SAID_SLOW_S = 2e-5  # from which a slow sensor is said: 8 kHz, where a runner rings
UNEXPLAINED = 10.0
"""Chi-square per reading above 1, per root of the readings, from which that is too much: noise
comes to 4."""


class Searching(NamedTuple):
    """How minima are looked for: from how many places, by which chance, in how many processes."""

    starts: int = 8
    seed: int = 1
    workers: int = 0  # 0 is one per core


def fit(
    experiment: 'Table | Experiment | Sequence[Table | Experiment]',
    free: Sequence[str],
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    parameters: Parameters | None = None,
    start: Mapping[str, float | str] | None = None,
    bounds: Mapping[str, tuple[float, float] | str] | None = None,
    known: Mapping[str, tuple[float, float] | str] | None = None,
    commands: 'Table | None' = None,
    frequency_hz: float = 1000.0,
    frequency_max_hz: float | None = None,
    steps: int = 0,
    window_s: tuple[float, float] | None = None,
    outliers: float = 6.0,
    shape_m: float = 5e-10,
    step_share: float = 3e-3,
    starts: int = 8,
    seed: int = 1,
    workers: int = 0,
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> Fit:
    """
    Fit parameters of the drive to recordings of its motion and to measured numbers, all at once.

    Parameters
    ----------
    experiment : path-like, DataFrame, Experiment or sequence of them
        Recordings and tables over time, with a voltage and what was seen; and tables of forces or
        step lengths by amplitude, as docs/howto/fit.md says.
    free : sequence of str
        Parameters to fit, ``['contact.friction']``.
    headers : mapping of str to str, optional
        Headers of columns in files that do not tell, ``{'force_n': 'CH2 (mN)'}``, and topics of
        recordings of other programs, ``{'position_m': '/rig/encoder.point.x'}``.
    preloads_n : sequence of float
        Preloads of files without such a column, N: one of all, or one of each.
    parameters : Parameters, optional
        The stand; by default that of the paper.
    start, bounds : mapping
        Start, and low and high, of free parameters; by default the stand's value, and a decade
        below and above it.
    known : mapping
        Free parameters that were measured otherwise: value and its relative standard error, or
        both as typed, ``3g+-1%``.
    commands : path-like or DataFrame, optional
        What drove the recordings, where it is known: times and voltages.
    frequency_hz : float
        SawtoothSteps per second of points that have none.
    frequency_max_hz : float, optional
        Largest number of steps per second, for a monitor so slow that others look alike.
    steps : int
        Cycles that the drive had made from rest when a number was read; 0: until it was steady.
    window_s : tuple of float, optional
        Start and end of the stretch of recordings that counts, s.
    outliers : float
        Robust standard deviations from which a lone reading is left out; 0 keeps all.
    shape_m : float
        What the model's motion may be wrong by in each moment of a cycle, m.
    step_share : float
        The same of the length of a step, as a share.
    starts : int
        Searches: from the present values, and from a Latin hypercube in the bounds.
    seed : int
        Seed of the hypercube.
    workers : int
        Searches at once; 0 is one per core.
    report : callable, optional
        Called with each ``MeasuredTable`` when it has been read, before anything is computed.
    progress : bool or callable
        Whether to show how far it has come; or what is called with the runs made so far, and 0:
        nobody knows how many the searches will need.

    Raises
    ------
    StickSlipError
        If an experiment cannot be read, or a parameter cannot be fitted.

    """
    reading = Reading(headers or {}, preloads_n, report, is_run=True)
    stand = parameters or Parameters()
    source = DriveSource(commands, frequency_max_hz, window_s=window_s)
    experiments = read_experiments(
        experiment, stand, reading, source, frequency_hz, steps, outliers
    )
    stand, chosen, notes = choose_free(stand, free, start, bounds)
    with progress_of(progress, 'runs') as show:
        fitted = fit_experiments(
            stand,
            chosen,
            experiments,
            known=choose_known(known or {}, chosen),
            allowance=Allowance(shape_m, step_share),
            outliers=outliers,
            how=Searching(starts, seed, workers),
            progress=show,
        )
    return replace(fitted, notes=(*notes, *fitted.notes))


def fit_experiments(
    parameters: Parameters,
    free: tuple[Free, ...],
    experiments: Sequence[Experiment],
    *,
    known: Mapping[str, tuple[float, float]] | None = None,
    allowance: Allowance = Allowance(),  # noqa: B008 - it does not change
    outliers: float = 6.0,
    how: Searching = Searching(),  # noqa: B008 - it does not change
    progress: Show | None = None,
) -> Fit:
    """Do what ``fit`` does to experiments, and to what ``choose_free`` returns."""
    started_s = time.perf_counter()
    computed, searched = itertools.count(1), 0

    def tick() -> None:
        if progress is not None:
            progress(next(computed), 0, f'{searched} of {how.starts} searches ended')

    def count(done: int, _: int) -> None:
        nonlocal searched
        searched = done

    if not 1 <= how.starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', how.starts, '', limit, 'change --starts')
    problem = pose(parameters, free, experiments, known, tick)
    problem, notes = _with_clocks(problem)
    places = [problem.start]  # the present values, then a Latin hypercube in the bounds
    if how.starts > 1:
        shares = qmc.LatinHypercube(d=len(free), seed=how.seed).random(how.starts - 1)
        lower, upper = problem.bounds
        if problem.has_traces:
            lower, upper = (
                np.clip(problem.start + way, lower, upper) for way in (-AROUND, AROUND)
            )
        places += list(qmc.scale(shares, lower, np.maximum(upper, lower + 1e-9)))
    first = replace(problem, allowance=LOOSE[0]) if problem.has_traces else problem
    searches = run_batch(
        partial(_search_or_nothing, first), places, workers=how.workers, progress=count
    )
    with pool_of(how.workers) as pool:
        problem = replace(problem, pool=pool)
        here, refined, steady = best_of(searches), list[Minimum](), True
        rivals: tuple[Minimum, ...] = ()
        if problem.has_traces:
            problem, refined, rivals, noted = _tightened(
                problem, searches, allowance, outliers, how.workers
            )
            here, notes = refined[-1], notes + noted
        problem, more, steady = _refine(problem, here)
        refined += more
        here = refined[-1] if refined else here
        for _ in range(WIDENED_MAX):
            values = problem.values(here.place)
            wider = problem.widened(values)
            if wider.free == problem.free:
                break
            beyond = _search_or_nothing(wider, wider.coordinates(values))
            if not beyond.coordinates:
                break
            problem, more, steady = _refine(wider, beyond)
            refined += [beyond, *more]
            here = refined[-1]
        problem = replace(problem, tick=silent)
        [predicted] = problem.predicted([problem.stand(here.place)])
        doubt = uncertainty(problem, here.place, here.chi_square)
        rivals = tuple(
            each
            for each in rivals
            if np.any(np.abs(each.place - here.place) > OTHER * doubt.errors_z)
        )
        missing = missing_from(problem, here.place)
    return Fit(
        problem=replace(problem, pool=None),
        searches=tuple(searches),
        refined=tuple(refined),
        others=rivals,
        steady=steady,
        uncertainty=doubt,
        predicted=predicted,
        missing=missing,
        wall_s=time.perf_counter() - started_s,
        notes=notes,
    )


def search(problem: Problem, start: Array, most: int = _EVALUATIONS_MAX) -> Minimum:
    """Search from coordinates: a bounded trust region, with one-sided differences."""
    place = np.clip(start, *problem.bounds)
    if problem.has_traces and not problem.metrics:
        problem = problem.measured_at(problem.predicted([problem.stand(place)])[0])
    ended = optimize.least_squares(
        problem.residuals,
        place,
        jac=problem.slopes,
        bounds=problem.bounds,
        method='trf',
        x_scale='jac',
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE**2,
        max_nfev=most,
    )
    return Minimum(
        tuple(ended.x.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def _search_or_nothing(problem: Problem, start: Array) -> Minimum:
    """Search, and find nothing at a stand that cannot be, unless it is the user's own."""
    most = _EVALUATIONS_MAX if problem.allowance is None else LOOSE_EVALUATIONS_MAX
    try:
        return search(problem, start, most)
    except StickSlipError:
        if np.array_equal(start, problem.start):
            raise
        return Minimum((), math.inf, converged=False, evaluations=0)


def _refine(problem: Problem, best: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Search on from a minimum with more cycles, as long as its runs need them."""
    refined: list[Minimum] = []
    here = best.place
    for _ in range(ROUNDS):
        longer, steady = problem.steady_at(here)
        if longer.experiments == problem.experiments:
            break
        problem = longer
        refined.append(search(problem, here))
        here = refined[-1].place
    return problem, refined, steady


def _with_clocks(problem: Problem) -> tuple[Problem, tuple[str, ...]]:
    """Return the problem with what the clocks of the sensors are late, by the falls they show."""
    shifts, notes = list[float](), list[str]()
    for one in problem.experiments:
        found = None
        if isinstance(one.drive, Voltage):
            found = lateness_of(one.seen[0], one.drive)
        if found is None or not found.is_clear:
            shifts.append(0.0)
            continue
        shifts.append(found.late_s)
        text = f'{one.origin}: the clock of {one.seen[0].quantity} is about '
        text += f'{1e3 * found.late_s:.3g} ms late, by the falls of the voltage'
        if found.has_rival:
            text += f'; {1e3 * found.rival_s:.3g} ms fits nearly as well'
        notes.append(text)
    return replace(problem, shifts_s=tuple(shifts)), tuple(notes)


def _tightened(
    problem: Problem,
    searches: Sequence[Minimum],
    allowance: Allowance,
    outliers: float,
    workers: int,
) -> tuple[Problem, list[Minimum], tuple[Minimum, ...], tuple[str, ...]]:
    """
    Return where searches end that allow ever less, other minima, and the problem with its noise.

    From each of the first minima one search goes on to one that knows noise and sensor only. The
    best of these says how large the noise is, which readings are outliers, and where the last
    search begins, which allows what is stated. The others are tried there too: allowing for
    errors of the model may well leave two minima.

    """
    chains = run_batch(
        partial(_to_plain, replace(problem, pool=None)), _distinct(searches), workers=workers
    )
    unexplained = 1.0 + UNEXPLAINED / math.sqrt(problem.count)
    if min(chain[1][-1].chi_square for chain in chains) > unexplained * problem.count:
        sensors = [(problem.shifts_s, slow_s) for slow_s in TRIED_SLOW_S]
        sensors += [(_latest(problem), slow_s) for slow_s in (0.0, TRIED_SLOW_S[0])]
        with_sensor = partial(_with_sensor, replace(problem, pool=None))
        chains += run_batch(with_sensor, sensors, workers=workers)
    chains.sort(key=lambda chain: chain[1][-1].chi_square)
    problem, found = replace(chains[0][0], pool=problem.pool), chains[0][1]
    [predicted] = problem.predicted([problem.stand(found[-1].place)])
    if grid := profile(problem.measured_at(predicted), found[-1].place):
        more = [search(problem, each, LOOSE_EVALUATIONS_MAX) for each in grid.best(1)]
        found += [each for each in more if each.chi_square < found[-1].chi_square]
    for _ in range(ROUNDS_OF_NOISE):
        here, before_s = found[-1].place, _sensors_of(problem)
        problem = _with_noise(replace(problem, allowance=None), here, outliers)
        problem = replace(problem, allowance=allowance, metrics=())
        problem = problem.measured_at(problem.predicted([problem.stand(here)])[0])
        found.append(search(problem, here))
        if np.all(np.abs(np.subtract(_sensors_of(problem), before_s)) < CLOSE_S):
            break
    ends = [found[-1]]
    for _, chain in chains[1:FOLLOWED_MAX]:
        ends.append(search(problem, chain[-1].place, LOOSE_EVALUATIONS_MAX))
    best, *others = sorted(_distinct(ends), key=lambda each: each.chi_square)
    if best is not found[-1]:
        found.append(best)
    notes = [
        f'{one.origin}: {each.left_out} of {len(each.values) + each.left_out} readings of '
        f'{each.quantity} were left out as outliers'
        for one in problem.experiments
        for each in one.seen
        if each.left_out
    ]
    for _, one, each, noise in problem.seen:
        if each.is_trace and each.unit == 'm' and noise < allowance.reading_m:
            notes.append(
                f'{one.origin}: {each.quantity} shows a noise of {1e9 * noise:.2g} nm; a reading '
                f'counts as {1e9 * allowance.reading_m:.2g} nm, for the model may be wrong by that'
            )
        if each.slow_s > SAID_SLOW_S:
            notes.append(
                f'{one.origin}: the sensor of {each.quantity} is slow, as behind a low-pass of '
                f'{0.5 / (math.pi * each.slow_s):.2g} Hz'
            )
    rivals = [each for each in others if each.chi_square - best.chi_square < RULED_OUT_BY]
    return problem, found, tuple(rivals), tuple(notes)


def _to_plain(problem: Problem, loose: Minimum) -> tuple[Problem, list[Minimum]]:
    """Search on from a loose minimum with a smaller allowance, then with none; clocks follow."""
    problem, found = _on_time(problem, loose.place), [loose]
    for stage in (LOOSE[1], None):
        problem = replace(problem, allowance=stage, metrics=())
        found.append(search(problem, found[-1].place, LOOSE_EVALUATIONS_MAX))
    return problem, found[1:]


def _distinct(searches: Sequence[Minimum]) -> list[Minimum]:
    """Return the first minima that lie apart, the best first."""
    kept = list[Minimum]()
    for each in sorted(searches, key=lambda found: found.chi_square):
        is_new = all(np.max(np.abs(each.place - one.place)) > APART for one in kept)
        if each.coordinates and is_new and len(kept) < FOLLOWED_MAX:
            kept.append(each)
    return kept


def _on_time(problem: Problem, place: Array) -> Problem:
    """Return the problem with sensors that let the motion from sample to sample agree best."""
    stand, shifts, experiments = problem.stand(place), list[float](), list[Experiment]()
    for number, one in enumerate(problem.experiments):
        late_s, told = 0.0, one
        if isinstance(one.drive, Voltage):
            late_s, slow_s = sensor_near(one, stand, problem.shift_s(number))
            first, *others = one.seen
            told = replace(one, seen=(replace(first, slow_s=slow_s), *others))
        shifts.append(late_s)
        experiments.append(told)
    return replace(problem, experiments=tuple(experiments), shifts_s=tuple(shifts), metrics=())


def _sensors_of(problem: Problem) -> list[float]:
    """Return what the clocks are late, and the time constants of the sensors, s."""
    return [*problem.shifts_s, *(each.slow_s for _, _, each, _ in problem.seen)]


def _latest(problem: Problem) -> tuple[float, ...]:
    """Return what the clocks are late by the falls, s, be it clear or not."""
    found = (
        lateness_of(one.seen[0], one.drive) if isinstance(one.drive, Voltage) else None
        for one in problem.experiments
    )
    return tuple(each.late_s if each else 0.0 for each in found)


def _with_sensor(
    problem: Problem, sensor: tuple[tuple[float, ...], float]
) -> tuple[Problem, list[Minimum]]:
    """Search from the present values with clocks that are late and one low-pass of all sensors."""
    shifts_s, slow_s = sensor
    experiments = (
        replace(one, seen=tuple(replace(each, slow_s=slow_s) for each in one.seen))
        for one in problem.experiments
    )
    problem = replace(problem, experiments=tuple(experiments), shifts_s=shifts_s, metrics=())
    loose = _search_or_nothing(replace(problem, allowance=LOOSE[0]), problem.start)
    return _to_plain(problem, loose)


def _with_noise(problem: Problem, place: Array, outliers: float) -> Problem:
    """Return the problem with noise, clocks and outliers as the residuals at a place tell them."""
    [predicted] = problem.predicted([problem.stand(place)])
    problem = problem.measured_at(predicted)
    metrics, shifts = iter(problem.metrics), list(problem.shifts_s)
    experiments, errors = list[Experiment](), list[tuple[float, ...]]()
    missed_numbers: dict[str, list[float]] = {}
    for number, (one, known) in enumerate(
        zip(problem.experiments, problem.noise.values, strict=True)
    ):
        seen, noises = list[Seen](), list[float]()
        for each, found, noise in zip(one.seen, predicted[number], known, strict=True):
            if not each.is_trace:
                missed = float(found.values[0] - each.values[0])
                missed_numbers.setdefault(each.quantity, []).append(missed)
                seen.append(each)
                noises.append(noise)
                continue
            sizes, left = next(metrics).of_sensor(found.values - each.values)
            late_s, slow_s = slower(each.slow_s, *sizes[2:4].tolist())
            if not seen:
                shifts[number] += late_s
            out = lone_outliers(left, outliers or math.inf)
            kept = replace(
                each,
                values=each.values[~out],
                time_s=each.time_s[~out],
                left_out=each.left_out + int(out.sum()),
                slow_s=slow_s,
            )
            seen.append(kept)
            white = max(noise_of(left[~out]), rounding_of(kept.values))
            noises.append(max(each.sigma or white or noise, FINEST))
        experiments.append(replace(one, seen=tuple(seen)))
        errors.append(tuple(noises))
    for number, one in enumerate(experiments):  # numbers that do not tell their error
        errors[number] = tuple(
            noise
            if each.is_trace or each.sigma is not None
            else float(np.sqrt(np.mean(np.square(missed_numbers[each.quantity]))))
            for each, noise in zip(one.seen, errors[number], strict=True)
        )
    return replace(
        problem,
        experiments=tuple(experiments),
        noise=StandardErrors(known=True, values=tuple(errors)),
        shifts_s=tuple(shifts),
        metrics=(),
    )
