# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""`stickslip contact`: one hemisphere, against the printed figures of the specification."""

import json
from typing import Any

import pytest
from evidence.published import CONTACTS

from stickslip_ros.lab.cli.main import main

RELATIVE = 1e-5
"""The reference has six digits, or five behind the point; of the stiffness it has four."""
FRACTIONS = '0.1,0.25,0.5,0.75,0.9'
FRICTION = 0.3
KEYS = {
    'indentation_m',
    'contact_radius_m',
    'max_presliding_m',
    'stick_stiffness_n_per_m',
    'effective_modulus_pa',
    'effective_shear_modulus_pa',
}


def contact(capsys: Any, *words: str) -> dict[str, Any]:
    assert main(['contact', *words, '--json']) == 0
    return json.loads(capsys.readouterr().out)


def test_figures_and_curve_are_those_of_the_specification(capsys: Any):
    figures: Any = CONTACTS[0]
    case, depth, radius, presliding, stiffness, ratios = figures
    force_n = case['force_n']
    profile = ('--set', f'contact.profile={case["profile"]}')
    words = ('--normal-force', str(force_n), *profile, '--curve', FRACTIONS)
    seen = contact(capsys, *words)
    assert seen.keys() == KEYS | {'tangential_force_n'}
    assert seen['indentation_m'] == pytest.approx(float(depth) * 1e-9, rel=RELATIVE)
    assert seen['contact_radius_m'] == pytest.approx(float(radius) * 1e-6, rel=RELATIVE)
    assert seen['max_presliding_m'] == pytest.approx(float(presliding) * 1e-9, rel=RELATIVE)
    if stiffness:
        stick = pytest.approx(float(stiffness) * 1e6, rel=1e-4)
        assert seen['stick_stiffness_n_per_m'] == stick
    found = [each / (FRICTION * force_n) for each in seen['tangential_force_n']]
    assert found == pytest.approx([float(each) for each in ratios], rel=0.0, abs=0.5e-5)


def test_the_table_shows_the_same_figures_in_readable_units(capsys: Any):
    assert main(['contact', '--normal-force', '0.353553', '--curve', '0.5']) == 0
    shown = capsys.readouterr().out
    assert '263.21' in shown
    assert '95.885' in shown
    assert 'tangential force at 0.5 u_max' in shown
    assert 'N/um' in shown
