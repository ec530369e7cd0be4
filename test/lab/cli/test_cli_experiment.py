# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip import``, and what other verbs say of a table before they compute."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from mcap_records import foreign_numbers

from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.tables import read_experiment


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a table of a German spreadsheet in the working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / 'messung.csv'
    text = 'Messung 7\n\nHub (nm);Kraft (mN);Temp (°C)\n60;1,5;21\n90;22,25;21\n'
    path.write_bytes(text.encode('cp1252'))
    return path


def test_import_says_what_it_understood_and_writes_our_form(capsys: Any, table: Path):
    Path('out').mkdir()
    assert main(['import', 'messung.csv', '--preload', '0.5', '-o', 'out/clean.csv']) == 0
    out, err = capsys.readouterr()
    assert err == ''
    assert 'messung.csv: experiment by amplitude, 2 rows' in out
    assert "amplitude_m is 'Hub (nm)' in nm, times 1e-09; first row 6e-08 m" in out
    assert "force_n is 'Kraft (mN)' in mN, times 0.001; first row 0.0015 N" in out
    assert "unused  'Temp (°C)'" in out
    clean = Path('out/clean.csv')
    assert clean.read_text(encoding='utf-8') == (
        "# column 'Temp (°C)' was not read\n"
        'preload_n,amplitude_m,force_n\n0.5,6e-08,0.0015\n0.5,9e-08,0.02225\n'
    )
    again = read_experiment(clean)
    assert again.columns['force_n'].tolist() == [0.0015, 0.02225]


def test_import_without_output_only_tells(capsys: Any, table: Path):
    assert main(['import', 'messung.csv', 'messung.csv', '--preload', '0.1,0.5', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['output'] == ''
    assert [each['file'] for each in told['files']] == ['messung.csv'] * 2
    assert told['files'][0]['unused'] == ['Temp (°C)']
    assert [each['name'] for each in told['files'][0]['columns']] == ['amplitude_m', 'force_n']
    assert [path.name for path in table.parent.iterdir()] == ['messung.csv']


def test_compare_takes_one_file_per_preload_and_says_first_what_it_read(capsys: Any, table: Path):
    words = ['--preload', '0.1,0.5', '--steps', '20']
    assert main(['compare', 'messung.csv', 'messung.csv', 'model', *words]) == 0
    out, err = capsys.readouterr()
    assert out.startswith('comparison of messung.csv, messung.csv and model\n')
    assert re.search(r'^rows +4 ', out, re.MULTILINE)
    assert err.count("force_n is 'Kraft (mN)' in mN, times 0.001; first row 0.0015 N") == 2
    assert "unused  'Temp (°C)'" in err


def test_a_given_column_is_played(capsys: Any, tmp_path: Path):
    scope = tmp_path / 'scope.csv'
    scope.write_text('x-axis,1\nsecond,Volt\n0.0,0.0\n1e-3,0.5\n2e-3,1.0\n', encoding='ascii')
    words = ['replay', str(scope), '-o', str(tmp_path / 'run.mcap')]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert f'{scope}: line 1: there is no voltage_v or foot_m; columns of numbers: ' in said
    assert 'preload_n' not in said
    assert main([*words, '--map', 'voltage_v=1 (100 V)']) == 0
    out, err = capsys.readouterr()
    assert "voltage_v is '1' in 100 V, times 100; first row 0 V" in err
    assert 'run.mcap' in out


def test_import_reads_a_recording_once_its_topics_are_mapped(tmp_path: Path, capsys: Any):
    path = foreign_numbers(tmp_path / 'run.mcap', [(10**6 * k, k, float(k)) for k in range(3)])
    for each in (path, tmp_path / 'none'):
        assert main(['import', str(each)]) == 2
    assert main(['import', str(path)]) == 2
    told = capsys.readouterr().err
    topic = re.findall(r'it holds (\S+);', told)[-1]
    words = ['--map', f'voltage_v={topic}.data (mV)', '-o', str(tmp_path / 'o.csv')]
    assert main(['import', str(path), *words]) == 0
    assert 'voltage_v is' in capsys.readouterr().out
    rows = (tmp_path / 'o.csv').read_text().splitlines()
    assert rows == ['time_s,voltage_v', '0.0,0', '0.001,0.001', '0.002,0.002']


def test_rows_without_times_are_counted_at_a_rate(tmp_path: Path, capsys: Any):
    path = tmp_path / 'rig.csv'
    path.write_text('/rig/u,n\n1,7\n2,7\n3,7\n', encoding='ascii')
    words = ['import', str(path), '--map', 'voltage_v=/rig/u (V)', '-o', str(tmp_path / 'o.csv')]
    assert main([*words, '--rate', '10kHz']) == 0
    assert "time_s is 'row number' in 0.0001 s" in capsys.readouterr().out
    rows = (tmp_path / 'o.csv').read_text().splitlines()
    assert rows[-3:] == ['0.0,1', '0.0001,2', '0.0002,3']
    recording = foreign_numbers(tmp_path / 'run.mcap', [(0, 0, 1.0)])
    assert main(['replay', str(recording), '--rate', '10kHz']) == 2
    assert '--rate 10000 Hz is without effect on recordings' in capsys.readouterr().err
