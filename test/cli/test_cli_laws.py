"""``stickslip laws``: every profile and law, in one table and one figure."""

import json
from pathlib import Path

import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.parameters import specs

VARIANTS = {*specs()['contact.profile'].choices, *specs()['contact.law'].choices} - {'mdr'}


def test_every_variant_is_run_at_every_preload_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(['laws', '--out', str(tmp_path), '--amplitudes', '1', '--json']) == 0
    points = json.loads(capsys.readouterr().out)['points']
    assert {point['variant'] for point in points} == VARIANTS
    assert len(points) == 3 * len(VARIANTS)
    # No law generates more than friction allows, and the full stroke always generates force.
    assert all(0.0 < p['force_mean_n'] <= 0.8486 * p['preload_n'] for p in points)
    force_n = {(p['variant'], p['preload_n']): p['force_mean_n'] for p in points}
    assert all(force_n['rough', n] < force_n['smooth', n] for n in (0.1, 0.5, 1.0))
    assert (tmp_path / 'laws.csv').read_text().count('\n') == 1 + len(points)
    assert (tmp_path / 'laws.png').read_bytes().startswith(b'\x89PNG')


@pytest.mark.parametrize('words', [['--amplitudes', '0'], ['--out', '/proc/no/such']])
def test_bad_requests_are_refused_in_one_line(
    words: list[str], capsys: pytest.CaptureFixture[str]
):
    assert main(['laws', '--amplitudes', '1', *words]) == 2
    assert capsys.readouterr().err.count('\n') == 1
