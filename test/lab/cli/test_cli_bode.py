# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip bode`` as it is typed."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from stickslip_ros.lab.cli.main import main

pytestmark = pytest.mark.usefixtures('compiled_kernels')


def test_it_measures_writes_and_draws(capsys: Any, tmp_path: Path):
    table, picture = tmp_path / 'bode.csv', tmp_path / 'bode.png'
    words = ['--frequency', '1000:5000:3', '--at-voltage', '60', '--preload', '0.25']
    assert main(['bode', *words, '-o', str(table), '--figure', str(picture), '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['at_voltage_v'] == 60.0
    assert told['largest_deviation'] < 0.01
    assert [row['frequency_hz'] for row in told['rows']] == [1000.0, 3000.0, 5000.0]
    written = pd.read_csv(table, comment='#', float_precision='round_trip')
    assert written.to_dict('records') == told['rows']
    assert picture.read_bytes().startswith(b'\x89PNG')


def test_without_frequencies_it_looks_around_the_resonance(capsys: Any):
    assert main(['bode', '--no-load-cell', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    hertz = [row['frequency_hz'] for row in told['rows']]
    assert told['cell_n_per_m'] == 0.0
    assert hertz[0] < 0.1 * told['resonance_hz'] < 2.0 * told['resonance_hz'] < hertz[-1]


def test_what_it_finds_is_a_table(capsys: Any):
    assert main(['bode', '--frequency', '20000']) == 0
    shown = capsys.readouterr().out
    assert 'resonance of the runner' in shown
    assert 'deviation' not in shown  # nothing below the resonance
