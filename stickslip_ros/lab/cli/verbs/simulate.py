# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that compute, without ROS, and compare the model with the paper and references."""

from stickslip_ros.lab.cli.options import (
    DRAWS,
    FIGURE,
    NO_LOAD_CELL,
    PARAMETERS,
    PRELOAD,
    WORKERS,
    either,
    flag_option,
    folder,
    many,
    option,
    options_of,
    output,
    to_path,
    verb,
)

VALUES = 'VALUES'
_SLEW = option(
    '--slew', 'set amplifier.slew_rate, as 150V/us', metavar='V/S', dest='amplifier.slew_rate'
)
BOTH_WAYS = flag_option('--both-ways', 'run backwards too, and state the step length both ways')
RUNNERS = either(
    WORKERS,
    option(
        '--scheduler',
        'run on a Dask cluster instead, as tcp://HOST:8786; needs: pip install distributed',
        metavar='ADDRESS',
        default='',
    ),
)
FRESH = flag_option('--fresh', 'discard FILE.journal')

SIMULATE_IN_PYTHON = 'runs.sawtooth_run.simulate'

SIMULATE = (
    verb(
        'contact',
        'indentation, contact radius and presliding of a hemisphere',
        'Solve the contact of a hemisphere under a constant normal force.',
        option('--normal-force', 'normal force F_n', unit='N', metavar='NEWTON', required=True),
        option(
            '--curve',
            'tangential force at these fractions of the maximal presliding, as 0.1,0.5',
            metavar='FRACTIONS',
        ),
        *PARAMETERS,
    ),
    verb(
        'simulate',
        'drive the stand with a saw-tooth; force and step length',
        'Drive the virtual stand with a saw-tooth or another wave, without ROS. The generated '
        'force is k x, the force in the load-cell spring.',
        PRELOAD,
        either(
            *options_of(SIMULATE_IN_PYTHON, 'amplitude_m', 'voltage_v'),
            option('--waveform', 'one cycle as a table of time and voltage', to_path),
            required=True,
        ),
        _SLEW,
        *options_of(SIMULATE_IN_PYTHON, 'frequency_hz', 'steps'),
        BOTH_WAYS,
        NO_LOAD_CELL,
        DRAWS,
        output('record the run as MCAP'),
        *PARAMETERS,
    ),
    verb(
        'sweep',
        'run the drive at every combination of values; a table',
        'Run the drive alone, without sensors, at every combination of values. VALUES are a list, '
        '0.1N,0.5N, or a range start:stop:count with both ends, 0:160nm:33. A run ends when it is '
        'steady: mean force of a cycle (free runner: step length) within 0.02% of its limit, by '
        'the last 40 steps; 200 to 5000 steps; --steps sets their number. FILE.journal keeps '
        'finished runs: after Ctrl-C or a crash the same command continues. A name without ending '
        'is a folder of Parquet files, a data set of any size; workers of Dask write to it.',
        option('--preload', 'vary stand.preload', metavar=VALUES),
        option('--amplitude', 'peak-to-peak displacements', metavar=VALUES, required=True),
        option('--frequency', 'steps per second', metavar=VALUES, default='1kHz'),
        many(
            '--vary',
            'vary any parameter; the first varies slowest',
            f'GROUP.NAME={VALUES}',
        ),
        *options_of('runs.sweep.sweep', 'steps'),
        BOTH_WAYS,
        NO_LOAD_CELL,
        DRAWS,
        output('.csv, .parquet or a folder of .parquet to write; needed'),
        option(
            '--part', 'of a folder, make only the third of 20 files, as 3/20', metavar='N/COUNT'
        ),
        RUNNERS,
        FRESH,
        *PARAMETERS,
        module='simulate',
    ),
    verb(
        'zero-amplitude',
        'the amplitude below which a free runner makes no steps',
        "Find the 0-amplitude of a free runner in two ways. Edeler's way: fit a straight line to "
        'step lengths at 17 amplitudes, in the upper half of those that step, and extrapolate it '
        'to zero. Directly: find the smallest amplitude with a net step above 1e-10 m. The load '
        'cell is always removed.',
        PRELOAD,
        _SLEW,
        *options_of('runs.zero_amplitude.zero_amplitude', 'frequency_hz', 'steps'),
        DRAWS,
        *PARAMETERS,
        module='simulate',
    ),
    verb(
        'optimise',
        'find the best periodic wave',
        'Find the best periodic wave within range, slew rate and current of the amplifier, among '
        'monotone splines and named shapes. OBJECTIVE is speed, force, step, vibration, energy '
        'or flatness (docs/howto/best_wave.md). Frequency and preload can be searched between two '
        'limits. Ctrl-C writes the best wave so far. Needs: pip install cma.',
        option('objective', 'quantity to optimise', metavar='OBJECTIVE'),
        *options_of('design.objectives.WaveGoal', 'load_n', 'speed_m_per_s'),
        option('--frequency', 'cycles per second', metavar='LOW:HIGH', default='1kHz'),
        option('--preload', 'stand.preload, or its limits', metavar='LOW:HIGH'),
        *options_of('design.search.WaveSearch', 'knots', 'evaluations', 'seed'),
        DRAWS,
        output('.csv of the wave; needed'),
        RUNNERS,
        *PARAMETERS,
    ),
    verb(
        'bode',
        'frequency response of the stuck drive, computed and measured',
        'Compute the frequency response of the stuck runner to voltage and load in closed form, '
        'and measure it with small sines. Frequencies are a list, 100Hz,1kHz, '
        'or a range start:stop:count.',
        PRELOAD,
        *options_of('linear.linearise.linearise', 'at_voltage_v'),
        option('--frequency', 'default: 25 around the resonance', metavar=VALUES),
        NO_LOAD_CELL,
        *FIGURE,
        output('.csv or .parquet'),
        WORKERS,
        *PARAMETERS,
    ),
    verb(
        'compile',
        'compile the kernels before the first run',
        'Compile the kernels of the drive and keep them on the disk, as part of an installation. '
        'Kernels compiled by root serve all users of the machine. Exit status 1: no folder can '
        'keep them.',
        reports_compilation=True,
    ),
)

EVIDENCE = (
    verb(
        'figures',
        "the paper's figures",
        "Make the paper's Figs 2, 6 and 7. Writes for each figure DIR/NAME.csv (all digits, SI), "
        'DIR/NAME.png, DIR/NAME.svg, and DIR/NAME.md with the caption. Names: fig2, fig6a, fig6b, '
        'fig7.',
        folder('runs/figures'),
        option('--only', 'figures to make (default: all)', metavar='NAMES'),
        option('--points', 'points along an axis (default: those of each figure)', int, default=0),
        WORKERS,
        *PARAMETERS,
        module='evidence',
    ),
    verb(
        'validate',
        'self-test: contact and drive against references',
        'Compare results of this installation with its references: closed forms, single springs, '
        '3-D solutions, codes of others, printed values. Writes a page (validation.html) and '
        'validation.csv. Exit status 1 if a result is wrong.',
        folder('runs/validation'),
        module='evidence',
    ),
)
