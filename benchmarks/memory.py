# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Largest memory of the verbs that read a recording, of a shorter and of a longer one."""

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.case import AMPLITUDE_M, FREQUENCY_HZ, standard_case
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.lab.runs.sawtooth_run import simulate

ROOT = Path(__file__).resolve().parent.parent
MEASURE = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
"""A small program between, because a process inherits the peak of its parent."""
VERBS = {
    'info': ('info', '{run}'),
    'plot': ('plot', '{run}', '-o', '{folder}/run.png'),
    'export to CSV': ('export', '{run}', '-o', '{folder}/run.csv'),
    'export to Parquet': ('export', '{run}', '-o', '{folder}/run.parquet'),
    'replay': ('replay', '{run}'),
    'compare': ('compare', '{run}', '{run}'),
}


def run(sizes: Sizes) -> Outcome:
    """Measure each verb on both recordings."""
    rows: list[Row] = []
    free, shortest_mb = standard_case({'load_cell.contact': 'absent'}), dict[str, float]()
    for recorded_s in sizes.recorded_s:
        with tempfile.TemporaryDirectory() as folder:
            path, steps = Path(folder, 'run.mcap'), round(recorded_s * FREQUENCY_HZ)
            simulate(
                free, amplitude_m=AMPLITUDE_M, frequency_hz=FREQUENCY_HZ, steps=steps, record=path
            )
            for name, words in VERBS.items():
                given = [each.format(run=path, folder=folder) for each in words]
                found_mb = peak_mb(given)
                ratio = found_mb / shortest_mb.setdefault(name, found_mb)
                rows.append(
                    {'verb': name, 'recorded_s': recorded_s, 'peak_mb': found_mb, 'ratio': ratio}
                )
    title = 'Largest resident memory of verbs of a recording of the free runner'
    return Outcome(title, rows, ['ratio: to the shorter recording; compare holds both as a whole'])


def peak_mb(words: list[str]) -> float:
    """Return the largest resident memory of a verb, MB."""
    command = [sys.executable, '-c', MEASURE, str(Path(sys.executable).with_name('stickslip'))]
    done = subprocess.run([*command, *words], cwd=ROOT, check=True, capture_output=True, text=True)
    return float(done.stdout) / 1e3
