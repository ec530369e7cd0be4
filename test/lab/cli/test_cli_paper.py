# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip figures`` as it is typed."""

import json

import pytest

from stickslip_ros.lab.cli.main import main

TWO_POINTS = ['figures', '--points', '2']


def test_the_json_has_rows_and_files_of_the_chosen_figures(capsys, tmp_path):
    words = ['--output', str(tmp_path), '--only', 'fig2,slew', '--workers', '2', '--json']
    assert main([*TWO_POINTS, *words]) == 0
    result = json.loads(capsys.readouterr().out)
    assert list(result) == ['fig2', 'slew']
    assert result['fig2']['files'] == [
        str(tmp_path / f'fig2.{kind}') for kind in ('csv', 'md', 'png', 'svg')
    ]
    full = result['fig2']['rows'][1]
    assert (full['preload_n'], full['amplitude_m']) == (0.1, 160e-9)
    assert full['force_mean_n'] == pytest.approx(0.061, rel=0.01)
    assert None in [row['zero_steps_m'] for row in result['slew']['rows']]


def test_the_table_names_the_figures_and_the_folder(capsys, tmp_path):
    assert main([*TWO_POINTS, '--output', str(tmp_path / 'new'), '--only', 'fig6b']) == 0
    text = capsys.readouterr().out
    assert 'fig6b' in text
    assert 'folder' in text
    assert (tmp_path / 'new' / 'fig6b.png').stat().st_size > 0
