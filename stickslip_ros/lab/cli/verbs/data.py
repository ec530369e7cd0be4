# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that read what was measured or recorded."""

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
    many,
    option,
    options_of,
    output,
    switch,
    titled,
    to_path,
    verb,
)

COMPARE = 'comparison.compare.CompareOptions'
FIT, FREE = 'fitting.fit.FitOptions', 'fitting.free.Free'
RECORDING = 'an MCAP file, a bag directory, or a run in parts'

DATA = (
    verb(
        'import',
        'read tables of instruments, write them in our form',
        'Read tables as instruments and spreadsheets write them (docs/howto/bring_your_data.md), '
        'say what was understood, and write them as CSV with our columns in SI units. Several '
        'tables by amplitude become one.',
        file('tables', nargs='+'),
        *MAP,
        *options_of(READING, 'preloads_n'),
        output('.csv to write (default: only say what was understood)'),
        module='experiment',
    ),
    verb(
        'compare',
        'compare runs, sweeps, experiments and the model',
        'Compare A with B, each a recording (MCAP file or bag, of any program: --map says which '
        'topic is what), a table of a sweep (CSV, Parquet) or a table of an experiment '
        '(docs/howto/bring_your_data.md). Tables are compared by amplitude and preload, '
        'runs over time. The word model for B runs the drive at the points of A, or under the '
        'voltage that drove A: --commands, or the wave read off a monitor with ten samples a '
        'cycle or more. Without B, a recording is compared with the experiment that it carries.',
        option(
            'files',
            'A: recording or table, or several experiments by amplitude; and last B: another '
            'one, or the word model',
            metavar='FILE',
            nargs='+',
        ),
        *MAP,
        *options_of(READING, 'preloads_n'),
        output('page to read or to print: .html'),
        *FIGURE,
        either(*options_of(COMPARE, 'shift_s', 'align')),
        *options_of(COMPARE, 'offset'),
        WINDOW,
        titled(
            'for the model',
            *options_of(READING, 'commands', 'frequency_hz', 'steps', 'workers'),
        ),
        DRAWS,
        *PARAMETERS,
    ),
    verb(
        'fit',
        'fit the drive to recordings and tables, with error bars',
        'Fit parameters of the drive to all that was measured, at once: recordings of any rig and '
        'tables over time, with the voltage that drove it and the position or force that was '
        'seen (--map says which topic is what), and tables of forces or step lengths by '
        'amplitude (docs/howto/fit.md). The wave is read off a voltage monitor with ten samples a '
        'cycle or more; else give --commands. Zero, drift, delay, low-pass of sensors are found '
        'with the parameters; intervals allow for errors of the model. Quantities of '
        'contact, friction_law, runner, load_cell, actuator, amplifier may be freed. Freeing '
        'contact.rms_height sets contact.prefactor to 0, which would hide it.',
        file('recordings, tables over time, tables by amplitude', nargs='+'),
        *MAP,
        *options_of(READING, 'preloads_n'),
        many(
            '--free',
            'parameters to fit, as contact.friction,runner.damping',
            'NAMES',
            required=True,
        ),
        *options_of(FREE, 'start', 'known'),
        many(
            '--bounds',
            'bounds of a free parameter (default: a decade below and above its start)',
            'NAME=LOW:HIGH',
        ),
        *options_of(
            READING, 'commands', 'window_s', 'frequency_hz', 'steps', 'outliers', 'workers'
        ),
        *options_of(FIT, 'shape_m', 'step_share', 'starts', 'seed'),
        option(
            '--plan',
            'choose N measurements that would make the parameters surest',
            int,
            default=0,
        ),
        many(
            '-o --output',
            '.json: everything; .html: a page; .yaml: the fitted stand for --params',
            'FILE',
            to_path,
        ),
        *FIGURE,
        *PARAMETERS,
    ),
    verb(
        'info',
        'topics, counts, rates, gaps, parameters of a recording',
        f'Say what is in {RECORDING}.',
        file(RECORDING),
        module='recording',
    ),
    verb(
        'plot',
        'draw a recording against time',
        'Draw a recording: the trace where there is one, else the topics at 1 kHz; below, and '
        'dotted, the commands and the status bits. However many samples there are, no peak is '
        'lost. Of a recording of another program --map says which topic is what.',
        file('the recording'),
        WINDOW,
        *MAP,
        output('.png, .svg or .pdf (default: beside the recording, as PNG)'),
        *LOOK,
        module='recording',
    ),
    verb(
        'draw',
        'draw the stand',
        'Draw a stand to scale, as SVG. As URDF: frames and bodies for RViz and other programs. '
        'docs/examples/film.py draws a recording as a film.',
        output('.svg or .urdf to write', required=True),
        *PARAMETERS,
    ),
    verb(
        'export',
        'write the quantities of a recording as a table',
        'Write what a recording holds over time as a table, a row for each time, with units in '
        'the names of the columns: the trace where there is one, else the topics.',
        file(RECORDING),
        output('.csv, .parquet or .xlsx to write', required=True),
        switch('--readings', 'position, force and voltage of the topics, not the trace'),
        option(
            '--rate',
            'rows per second: each is the mean of an interval, at its middle (default: all rows)',
            unit='Hz',
        ),
        WINDOW,
        *MAP,
    ),
    verb(
        'recover',
        'make an unfinished, cut or damaged recording readable',
        'Copy what can be read of an MCAP file or a bag into a finished, indexed one. The '
        'original is only read; nothing is overwritten.',
        file(RECORDING),
        output('the copy (default: FILE.recovered.mcap)'),
        module='recording',
    ),
    verb(
        'replay',
        'run a recording again, or a measured voltage',
        'Without --set, the requests of a recording give the same data again, byte for byte; the '
        'exit status is 1 if they do not. With --set or --params they answer what another stand '
        'would have done. A table of voltages or displacements of the feet over time (see '
        'docs/howto/compare.md), or a recording of another program with --map, is played as a '
        'waveform; in samples of a voltage the wave is recognised first, with its true falls.',
        file('recording, or table of voltages'),
        *MAP,
        output('recording to write'),
        switch(
            '--from-rest',
            'replay a recording that began in the middle of a run from rest: not the same run',
        ),
        *PARAMETERS,
    ),
)
