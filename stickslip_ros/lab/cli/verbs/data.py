# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that read measurements and recordings."""

from stickslip_ros.lab.cli.options import (
    DRAWS,
    FIGURE,
    LOOK,
    MAP,
    PARAMETERS,
    READING,
    WINDOW,
    either,
    file,
    flag_option,
    many,
    option,
    options_of,
    output,
    titled,
    to_path,
    verb,
)

COMPARE = 'comparison.compare.CompareOptions'
FIT, FREE = 'fitting.fit.FitOptions', 'fitting.free.Free'
RECORDING = 'an MCAP or .db3 file, a bag directory, or a run in parts'

DATA = (
    verb(
        'import',
        'read tables of instruments, write them in SI units',
        'Read tables of instruments and spreadsheets (docs/howto/bring_your_data.md), print the '
        'columns as read, and write them as CSV in SI units. Several tables become one; a '
        'recording is read too.',
        file('tables, or a recording', nargs='+'),
        *MAP,
        *options_of(READING, 'preloads_n', 'rate_hz'),
        output('.csv to write (default: only print the columns)'),
        module='experiment',
    ),
    verb(
        'compare',
        'compare runs, sweeps, experiments and the model',
        'Compare A with B, each a recording (MCAP file or bag, with --map of any program), a '
        'table of a sweep (CSV, Parquet) or a table of an experiment '
        '(docs/howto/bring_your_data.md). Tables are compared by amplitude and preload, runs '
        'over time. The word model for B runs the drive at the points of A, or under the voltage '
        'of A. The voltage comes from --commands, or from a monitor with ten samples a cycle or '
        'more. Without B, a recording is compared with its attached experiment.',
        option(
            'files',
            'A: recording or table, or several experiments by amplitude; then B: recording, '
            'table, or the word model',
            metavar='FILE',
            nargs='+',
        ),
        *MAP,
        *options_of(READING, 'preloads_n', 'rate_hz'),
        output('.html page to read or to print'),
        *FIGURE,
        either(*options_of(COMPARE, 'shift_s', 'align')),
        *options_of(COMPARE, 'offset'),
        WINDOW,
        titled(
            'for the model',
            *options_of(
                READING, 'commands', 'load_n', 'slope_deg', 'frequency_hz', 'steps', 'workers'
            ),
        ),
        DRAWS,
        *PARAMETERS,
    ),
    verb(
        'fit',
        'fit the drive to recordings and tables, with error bars',
        'Fit parameters of the drive to all measurements at once: recordings of any rig and '
        'tables over time, with the driving voltage and the position or force (--map names their '
        'topics), and tables of forces or step lengths by amplitude (docs/howto/fit.md). The '
        'wave is recognised in a voltage monitor with ten samples a cycle or more; else give '
        '--commands. Zero, drift, delay and low-pass of sensors are fitted too; intervals allow '
        'for errors of the model. Quantities of contact, friction_law, runner, load_cell, '
        'actuator, amplifier, feet, stand.load may be freed. Freeing contact.rms_height sets '
        'contact.prefactor to 0, which would hide it.',
        file('recordings, tables over time, tables by amplitude', nargs='+'),
        *MAP,
        *options_of(READING, 'preloads_n', 'load_n', 'slope_deg', 'rate_hz'),
        many(
            '--free',
            'parameters to fit, as contact.friction,runner.damping',
            'NAMES',
            required=True,
        ),
        *options_of(FREE, 'start', 'known'),
        many(
            '--bounds',
            'bounds of a free parameter (default: a decade around its start and its default)',
            'NAME=LOW:HIGH',
        ),
        *options_of(READING, 'commands', 'window_s', 'frequency_hz', 'steps', 'workers'),
        *options_of(FIT, 'assume', 'drift_m_per_s', 'starts'),
        many(
            '-o --output',
            '.json: all results; .html: a page; .yaml: the fitted stand for --params',
            'FILE',
            to_path,
        ),
        *FIGURE,
        *PARAMETERS,
    ),
    verb(
        'info',
        'topics, counts, rates, gaps, parameters of a recording',
        f'Print topics, counts, rates, gaps and parameters of {RECORDING}.',
        file(RECORDING),
        module='recording',
    ),
    verb(
        'plot',
        'draw a recording or a table',
        'Draw a recording, the trace or else its topics at 1 kHz, with the commands (dotted) and '
        'failures; or tables, over time or by amplitude. Thinned curves keep every peak. '
        '--map names the topics of another program, or columns.',
        file('a recording, or tables', nargs='+'),
        WINDOW,
        *MAP,
        *options_of(READING, 'preloads_n', 'rate_hz'),
        output('.png, .svg or .pdf (default: a PNG next to the first file)'),
        *LOOK,
    ),
    verb(
        'draw',
        'draw the stand',
        'Draw a stand to scale, as SVG, or write its frames and bodies as URDF for RViz and other '
        'programs. docs/examples/film.py draws a recording as a film.',
        output('.svg or .urdf to write; needed'),
        *PARAMETERS,
        module='reference',
    ),
    verb(
        'export',
        'write the quantities of a recording or of tables as a table',
        'Write the trace of a recording, or else its topics, as a table with a row for each time '
        'and units in the column names; of tables what was read.',
        file(f'{RECORDING}; or tables', nargs='+'),
        output('.csv, .parquet or .xlsx to write; needed'),
        flag_option(
            '--readings', 'write position, force and voltage of the topics, not the trace'
        ),
        option(
            '--rate',
            'rows per second, each the mean of an interval, at its middle (default: all rows)',
            unit='Hz',
        ),
        WINDOW,
        *MAP,
        *options_of(READING, 'preloads_n'),
    ),
    verb(
        'recover',
        'make an unfinished, cut or damaged recording readable',
        'Copy the readable part of an MCAP file or a bag into a finished, indexed file. The '
        'files are not changed; a whole bag without metadata.yaml gets one.',
        file(RECORDING),
        output('the copy (default: FILE.recovered.mcap)'),
        module='recording',
    ),
    verb(
        'replay',
        'run a recording again, or a measured voltage',
        'Repeat the requests of a recording and compare the data byte for byte; exit status 1 if '
        'they differ. With --set or --params, repeat them on another stand. A table of voltages '
        'or foot displacements over time (docs/howto/replay.md), or a recording of another '
        'program with --map, is played as a waveform; samples of a voltage are played as the '
        'recognised wave, with true falls.',
        file('recording, or table of voltages'),
        *MAP,
        *options_of(READING, 'rate_hz'),
        output('recording to write'),
        flag_option(
            '--from-rest',
            'start a recording that began in mid-run from rest: the data will differ',
        ),
        *PARAMETERS,
    ),
)
