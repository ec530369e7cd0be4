# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sweeps, 0-amplitudes and bands of draws as they are typed; sweeps are killed and resumed."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from processes import progress_of, start_process
from waiting import wait_until

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.fitting.result import read_draws
from stickslip_ros.lab.runs.bands import LEVELS, band_of
from stickslip_ros.lab.runs.sawtooth_run import run_drive

STICKSLIP = Path(sys.executable).with_name('stickslip')
LONG = ['--preload', '0.1,0.4,0.7,1.0', '--amplitude', '0:160e-9:9', '--steps', '3000']
RUNS = 36
SHORT = ['--preload', '0.1,0.5', '--amplitude', '60e-9,160e-9', '--steps', '20']


def sweep(*words: str) -> int:
    return main(['sweep', *words])


def lines(path: Path) -> int:
    return path.read_bytes().count(b'\n') if path.exists() else 0


def kill_half_way(output: Path) -> None:
    """Start the long sweep, and kill it after some runs."""
    words = [str(STICKSLIP), 'sweep', *LONG, '--workers', '1', '-o', str(output)]
    journal = output.with_name(f'{output.name}.journal')
    with start_process(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:

        def is_half_way() -> bool:
            assert process.poll() is None, process.communicate()
            return lines(journal) >= 5

        wait_until(is_half_way, 'five lines of the journal', progress=progress_of(process))
        process.kill()
        process.communicate()


@pytest.fixture(scope='module')
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Give the table of the long sweep, made in one go."""
    path = tmp_path_factory.mktemp('unbroken') / 'table.csv'
    assert sweep(*LONG, '-o', str(path)) == 0
    return path.read_bytes()


def test_a_killed_sweep_goes_on_and_ends_with_the_table_of_an_unbroken_one(
    unbroken, capsys, tmp_path
):
    path = tmp_path / 'table.csv'
    journal = tmp_path / 'table.csv.journal'
    kill_half_way(path)
    # A line whose writing was interrupted is written again, and counts once.
    whole = journal.read_bytes().rpartition(b'\n')[0].split(b'\n')
    kept = len({json.loads(line)['case'] for line in whole[1:]})
    assert 4 <= kept < RUNS
    assert not path.exists()
    capsys.readouterr()
    assert sweep(*LONG, '--workers', '2', '-o', str(path)) == 0
    assert re.search(rf'taken from the journal +{kept}\n', capsys.readouterr().out)
    assert path.read_bytes() == unbroken
    assert not journal.exists()


def test_the_json_has_the_rows_of_the_file_and_the_stop_rule(capsys, tmp_path):
    path = tmp_path / 'table.csv'
    words = ['--vary', 'load_cell.stiffness=1e4,1e5', '--frequency=-500,500', '-o', str(path)]
    assert sweep(*SHORT, *words, '--json') == 0
    result = json.loads(capsys.readouterr().out)
    assert result['file'] == str(path)
    assert result['stop_rule'] == '20 steps'
    with path.open(newline='', encoding='utf-8') as file:
        table = list(csv.DictReader(line for line in file if not line.startswith('#')))
    assert len(table) == len(result['rows']) == 16
    assert next(iter(table[0])) == 'load_cell.stiffness [N/m]'
    for row, texts in zip(result['rows'], table, strict=True):
        assert {name: str(value) for name, value in row.items()} == texts


def test_the_journal_of_another_sweep_is_refused_unless_fresh(capsys, tmp_path, unbroken):
    path = tmp_path / 'table.csv'
    kill_half_way(path)
    assert sweep(*SHORT, '-o', str(path)) == 2
    error = capsys.readouterr().err
    assert 'table.csv.journal: is no journal, or one of another version' in error
    assert sweep(*LONG, '--set', 'runner.damping=1', '-o', str(path)) == 2
    assert 'or of other parameters or values; start again' in capsys.readouterr().err
    assert not path.exists()
    assert sweep(*SHORT, '--fresh', '-o', str(path)) == 0
    assert lines(path) == 7


def test_a_missing_package_is_told_before_the_work_begins(capsys, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    monkeypatch.setitem(sys.modules, 'distributed', None)
    assert sweep(*SHORT, '-o', str(tmp_path / 'table.parquet')) == 2
    assert 'install it with: pip install pyarrow' in capsys.readouterr().err
    words = ['--scheduler', 'tcp://127.0.0.1:1', '-o', str(tmp_path / 'table.csv')]
    assert sweep(*SHORT, *words) == 2
    assert 'install it with: pip install distributed' in capsys.readouterr().err


def test_zero_amplitude_prints_its_keys(capsys):
    words = ['zero-amplitude', '--preload', '500mN', '--set', 'contact.profile=smooth']
    assert main([*words, '--json']) == 0
    result = json.loads(capsys.readouterr().out)
    assert result['zero_amplitude_m'] == pytest.approx(53e-9, rel=0.0, abs=0.5e-9)
    assert result['max_presliding_lower_m'] == pytest.approx(42.80e-9, rel=0.0, abs=0.01e-9)
    assert (result['preload_n'], result['frequency_hz']) == (0.5, 200.0)
    assert {'slope', 'method', 'zero_amplitude_direct_m', 'fit_from_m', 'fit_to_m'} <= set(result)
    assert main([*words, '--set', 'load_cell.contact=attached']) == 0
    assert "Edeler's extrapolation" in capsys.readouterr().out
    assert main([*words, '--frequency', '0']) == 2
    assert 'frequency 0 Hz is not a frequency' in capsys.readouterr().err


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


def test_a_sweep_has_the_bands_of_runs_of_the_draws(fitted, tmp_path, capsys):
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


def test_a_value_that_draws_vary_is_refused_since_it_would_have_no_band(fitted, tmp_path, capsys):
    stand = tmp_path / 'fitted.yaml'
    stand.write_text('/**: {ros__parameters: {contact.friction: 0.2}}')
    for given in (['--params', str(stand)], ['--set', 'contact.friction=0.2']):
        words = ['simulate', '--amplitude', '1e-7', '--steps', '5', '--draws', str(fitted)]
        assert main([*words, *given]) == 2
        assert 'contact.friction is given, but varies in the draws' in capsys.readouterr().err
    assert main([*words, '--set', 'runner.damping=50']) == 0


def test_the_stand_of_draws_is_the_fitted_one(fitted: Path, capsys: pytest.CaptureFixture[str]):
    friction = json.loads(fitted.read_text())['estimates'][0]['value']
    as_fitted = ['--set', f'contact.friction={friction!r}', '--set', 'stand.preload=0.1']
    told = []
    for chosen in (['--draws', str(fitted)], as_fitted):
        capsys.readouterr()
        words = ['simulate', '--amplitude', '1e-7', '--steps', f'{STEPS}', '--json', *chosen]
        assert main(words) == 0
        told.append(json.loads(capsys.readouterr().out)['force_mean_n'])
    assert told[0] == told[1]
