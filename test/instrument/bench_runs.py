# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Update a bench with requests at given times, and collect its output."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Event, Output, Status

MS = 1_000_000
PERFECT = {
    f'{sensor}.{name}': 0.0
    for sensor in ('interferometer', 'load_cell')
    for name in ('noise_density', 'resolution', 'bandwidth')
}
"""Sensors that read the truth."""


@dataclass
class BenchRun:
    """Output of a bench in a run: trace (n, 5), ramps (n, 3), events, status after each update."""

    trace: np.ndarray
    ramps: np.ndarray
    events: list[Event]
    status: list[Status]
    outputs: list[Output]


def drive_bench(
    bench: Bench, end_ns: int, requests: Mapping[int, Sequence[Request]], step_ns: int = MS
) -> BenchRun:
    """Update in steps to ``end_ns``; ``requests`` come at their times since the call."""
    start_ns = bench.time_ns
    outputs = []
    while bench.time_ns < start_ns + end_ns:
        due = requests.get(bench.time_ns - start_ns, ())
        outputs.append(bench.update(bench.time_ns + step_ns, due))
    return BenchRun(
        trace=np.concatenate([output.readings.trace for output in outputs]),
        ramps=np.concatenate([output.ramps for output in outputs]),
        events=[event for output in outputs for event in output.events],
        status=[output.status for output in outputs],
        outputs=outputs,
    )


def sawtooth(voltage_v: float, frequency_hz: float, steps: int = 0) -> Request:
    return Request('sawtooth', (voltage_v, frequency_hz, float(steps)))


def load(force_n: float) -> Request:
    return Request('load', (force_n, 0.0, 0.0, 0.0, 0.0, 0.0))


def steps(count: int) -> Request:
    return Request('steps', (float(count),))
