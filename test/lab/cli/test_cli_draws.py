# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a fit knows of a stand is carried on: bands of runs, tables and 0-amplitudes."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.fitting.result import read_draws
from stickslip_ros.lab.runs.bands import LEVELS, band_of
from stickslip_ros.lab.runs.sawtooth_run import run_drive

STEPS = 12
AMPLITUDE_M = 1.2e-7


@pytest.fixture(scope='module')
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a fit of a friction that is known to some per cent."""
    folder = tmp_path_factory.mktemp('fitted')
    table, path = folder / 'points.csv', folder / 'fitted.json'
    rows = [(0.1, 8e-8, 0.0205), (0.1, 1.2e-7, 0.0213), (0.1, 1.6e-7, 0.0216)]
    frame = pd.DataFrame(rows, columns=['preload_n', 'amplitude_m', 'force_n'])
    frame.assign(force_sigma_n=1e-3).to_csv(table, index=False)
    words = ['--free', 'contact.friction', '--starts', '1', '--steps', f'{STEPS}']
    assert main(['fit', str(table), *words, '-o', str(path)]) == 0
    return path


def test_bands_hold_what_they_promise():
    values = np.random.default_rng(1).normal(size=20_000)
    band = band_of(values)
    assert list(band) == list(LEVELS)
    inside_95 = np.mean((values > band['low_95']) & (values < band['high_95']))
    inside_68 = np.mean((values > band['low_68']) & (values < band['high_68']))
    assert inside_95 == pytest.approx(0.95, rel=0.0, abs=1e-3)
    assert inside_68 == pytest.approx(0.68, rel=0.0, abs=1e-3)


def test_a_sweep_has_the_bands_of_runs_of_the_draws(
    fitted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    path = tmp_path / 'sweep.csv'
    words = ['--amplitude', f'{AMPLITUDE_M}', '--steps', f'{STEPS}', '--draws', str(fitted)]
    assert main(['sweep', *words, '-o', str(path)]) == 0
    [row] = pd.read_csv(path, comment='#').to_dict('records')
    runs = [run_drive(each, AMPLITUDE_M, 1000.0, STEPS) for each in read_draws(fitted, 100)]
    band = band_of([run.force_mean_n for run in runs])
    assert {name: row[f'force_mean_n_{name}'] for name in LEVELS} == pytest.approx(band)
    assert row['force_mean_n_low_95'] < row['force_mean_n'] < row['force_mean_n_high_95']


def test_a_run_and_a_0_amplitude_say_their_bands(fitted: Path, capsys: pytest.CaptureFixture[str]):
    words = ['--steps', f'{STEPS}', '--draws', str(fitted)]
    assert main(['simulate', '--amplitude', f'{AMPLITUDE_M}', *words]) == 0
    told = capsys.readouterr().out
    assert '100 draws of' in told
    assert 'low_95' in told
    assert main(['zero-amplitude', '--steps', '20', '--draws', str(fitted)]) == 0
    assert '20 draws of' in capsys.readouterr().out


def test_the_stand_of_draws_is_the_fitted_one(fitted: Path, capsys: pytest.CaptureFixture[str]):
    friction = json.loads(fitted.read_text())['estimates'][0]['value']
    words = ['--amplitude', '1e-7', '--steps', f'{STEPS}', '--json']
    told = []
    as_fitted = ['--set', f'contact.friction={friction!r}', '--set', 'stand.preload=0.1']
    for chosen in (['--draws', str(fitted)], as_fitted):
        capsys.readouterr()
        assert main(['simulate', *words, *chosen]) == 0
        told.append(json.loads(capsys.readouterr().out)['force_mean_n'])
    assert told[0] == told[1]
