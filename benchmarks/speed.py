"""How fast the drive is, and how exact, at several time steps."""

from collections.abc import Callable
from functools import partial

from benchmarks.case import (
    ACCURACY,
    AMPLITUDE_M,
    FREQUENCY_HZ,
    PERIOD_S,
    Ours,
    last_error,
    standard_case,
    worst_error,
)
from benchmarks.clock import Array, Program, in_turn
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes
from stickslip_ros.runs.sawtooth_run import DriveRun, SawtoothRun, run_drive, simulate

FASTER_THAN_REAL_TIME = 100.0
AIM = 200.0


def run(sizes: Sizes) -> Outcome:
    """Measure the drive alone, with its set-up, and with its sensors."""
    reference_n = Ours(standard_case({'sim.dt': sizes.converged_s}), sizes.cycles)()
    names, programs, accuracies = _drives(sizes, reference_n)
    parameters = standard_case()
    work_s = sizes.cycles * PERIOD_S
    with_sensors = partial(
        simulate,
        parameters,
        amplitude_m=AMPLITUDE_M,
        frequency_hz=FREQUENCY_HZ,
        steps=sizes.cycles,
    )
    default = f'{parameters.sim.dt * 1e6:g} us'
    calls: dict[str, Callable[[], DriveRun | SawtoothRun]] = {
        'run_drive': lambda: run_drive(parameters, AMPLITUDE_M, FREQUENCY_HZ, sizes.cycles),
        'simulate, no file': lambda: with_sensors(is_recorded=False).result,
        'simulate': lambda: with_sensors().result,
    }
    names += [(name, default) for name in calls]
    programs += [Program(call, work_s) for call in calls.values()]
    results = [call() for call in calls.values()]
    accuracies += [
        {
            'error': abs(result.force_mean_n / float(reference_n[-1]) - 1.0),
            'worst_error': float('nan'),
            'energy_residual': abs(result.energy_residual),
        }
        for result in results
    ]
    times = in_turn(programs, sizes)
    rows: list[Row] = []
    for i, ((name, step), accuracy) in enumerate(zip(names, accuracies, strict=True)):
        speeds = 1.0 / times.seconds[i]
        rows.append(
            {
                'program': name,
                'longest_step': step,
                'times_real_time': 1.0 / times.median(i),
                'lowest': float(speeds.min()),
                'highest': float(speeds.max()),
                **accuracy,
            }
        )
    fast = max(
        float(row['times_real_time']) for row in rows if float(row['worst_error']) <= ACCURACY
    )
    words = 'drive.advance, times real time, within 1e-3'
    return Outcome(
        'Speed and accuracy of the standard case (equivalent rough profile)',
        rows,
        [Verdict(words, FASTER_THAN_REAL_TIME, fast), Verdict(f'{words} (aim)', AIM, fast)],
        [
            (
                f'errors against longest_step = {sizes.converged_s * 1e6:g} us: `error` of the '
                'last cycle, `worst_error` of all cycles'
            ),
            (
                'run_drive and simulate are timed as whole calls, with set-up; simulate runs the '
                'sensors and records to a temporary file, unless it says no file'
            ),
        ],
    )


def _drives(
    sizes: Sizes, reference_n: Array
) -> tuple[list[tuple[str, str]], list[Program], list[dict[str, float]]]:
    """Return names, programs and accuracies of the drive alone at every step."""
    names: list[tuple[str, str]] = []
    programs: list[Program] = []
    accuracies: list[dict[str, float]] = []
    for step_s in sizes.steps_s:
        ours = Ours(standard_case({'sim.dt': step_s}), sizes.cycles)
        forces_n = ours()
        names.append(('drive.advance', f'{step_s * 1e6:g} us'))
        programs.append(Program(ours, ours.work_s))
        accuracies.append(
            {
                'error': last_error(forces_n, reference_n),
                'worst_error': worst_error(forces_n, reference_n),
                'energy_residual': ours.energy_residual(),
            }
        )
    return names, programs, accuracies
