# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A twin beside a drive: windows that are shown, and a fit each period, against the drive."""

from functools import partial

import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S
from stickslip_ros.lab.twin.settings import TwinParameters
from stickslip_ros.lab.twin.twin import Twin
from stickslip_ros.lab.twin.window import Window
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.units import NS_PER_S

SETTINGS = TwinParameters()
SAWTOOTH = Request('sawtooth', (300.0, 500.0, 0.0))


def run(sizes: Sizes) -> Outcome:
    """Processor time per second of the rig: of the drive, of windows, of fits."""
    stand = Parameters().updated({'load_cell.contact': 'absent'})
    bench, twin = Bench(stand), Twin(stand, SETTINGS)
    bench.update(bench.time_ns + stand.block_ns, [SAWTOOTH])
    lead, inside = _trace(bench, LEAD_S), _trace(bench, SETTINGS.window)
    table = np.concatenate((lead, inside))
    end_ns = bench.time_ns
    start_ns = end_ns - to_nanoseconds(SETTINGS.window)
    time_s = table[:, 0] - start_ns / NS_PER_S
    samples = {'voltage_v': (time_s, table[:, 1]), 'position_m': (time_s, table[:, 3])}
    window = Window(start_ns, end_ns, samples)
    programs = [
        Program(partial(_trace, bench, SETTINGS.window), SETTINGS.window),
        Program(partial(twin.look, window), SETTINGS.window),
        Program(partial(twin.fit, twin.look(window)), SETTINGS.period),
    ]
    times = in_turn(programs, sizes)
    rows: list[Row] = [
        {
            'program': program,
            'cpu_s_per_s': float(np.median(times.cpu_seconds[i])),
            **times.ratio(i),
        }
        for i, program in enumerate(('Bench.update', 'Twin.look', 'Twin.fit'))
    ]
    return Outcome(
        'A twin beside a drive, a second of the rig: the drive alone',
        rows,
        notes=[
            f'a saw-tooth of 300 V, 500 Hz; a trace of {stand.trace.sample_rate:g} Hz',
            f'windows of {SETTINGS.window:g} s, a fit each {SETTINGS.period:g} s: {SETTINGS.free}',
        ],
    )


def _trace(bench: Bench, length_s: float) -> Array:
    """Advance a drive and return its trace, shape (n, columns)."""
    blocks = round(length_s * NS_PER_S / bench.parameters.block_ns)
    return np.concatenate(
        [
            bench.update(bench.time_ns + bench.parameters.block_ns).readings.trace
            for _ in range(blocks)
        ]
    )
