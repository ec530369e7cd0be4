"""`stickslip contact`: one hemisphere, against the printed figures of the specification."""

import json
from typing import Any

import pytest
from evidence.published import CONTACTS

from stickslip_ros.cli.main import main

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


@pytest.mark.parametrize('figures', CONTACTS, ids=lambda row: str(row[0]))
def test_figures_and_curve_are_those_of_the_specification(capsys: Any, figures: Any):
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


def test_moduli_follow_from_the_materials(capsys: Any):
    seen = contact(capsys, '--normal-force', '0.1')
    assert seen.keys() == KEYS
    e1, e2, nu = 210e9, 370e9, 0.3
    assert seen['effective_modulus_pa'] == pytest.approx(
        1.0 / ((1.0 - nu**2) / e1 + (1.0 - nu**2) / e2), rel=1e-12
    )
    g1, g2 = e1 / (2.0 * (1.0 + nu)), e2 / (2.0 * (1.0 + nu))
    assert seen['effective_shear_modulus_pa'] == pytest.approx(
        1.0 / ((2.0 - nu) / (4.0 * g1) + (2.0 - nu) / (4.0 * g2)), rel=1e-12
    )
    assert seen['stick_stiffness_n_per_m'] == pytest.approx(
        2.0 * seen['effective_shear_modulus_pa'] * seen['contact_radius_m'], rel=1e-12
    )


def test_the_curve_ends_at_full_slip(capsys: Any):
    seen = contact(capsys, '--normal-force', '0.2', '--curve', '0,1,2')
    zero_n, full_n, beyond_n = seen['tangential_force_n']
    assert zero_n == pytest.approx(0.0, abs=1e-12 * full_n)
    assert full_n == pytest.approx(FRICTION * 0.2, rel=1e-9)
    assert beyond_n == full_n


def test_a_smooth_sphere_obeys_hertz_for_another_radius(capsys: Any):
    words = ('--set', 'contact.profile=smooth', '--set', 'contact.radius=2mm')
    seen = contact(capsys, '--normal-force', '0.2', *words)
    a = seen['contact_radius_m']
    assert a == pytest.approx(
        (3.0 * 0.2 * 2e-3 / (4.0 * seen['effective_modulus_pa'])) ** (1 / 3), rel=1e-9
    )
    assert seen['indentation_m'] == pytest.approx(a**2 / 2e-3, rel=1e-9)


def test_the_table_shows_the_same_figures_in_readable_units(capsys: Any):
    assert main(['contact', '--normal-force', '0.353553', '--curve', '0.5']) == 0
    shown = capsys.readouterr().out
    assert '263.21' in shown
    assert '95.885' in shown
    assert 'tangential force at 0.5 u_max' in shown
    assert 'N/um' in shown


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (('--normal-force', '0'), 'normal force'),
        (('--normal-force', '-0.1'), 'normal force'),
        (('--normal-force', 'nan'), "--normal-force 'nan' is not a finite number in N"),
        (('--normal-force', '0.1', '--curve', '0.1,x'), "--curve 'x' is not a finite number"),
        (('--normal-force', '0.1', '--curve', ''), "--curve '' is not a finite number"),
        (('--normal-force', '0.1', '--curve', '-0.1'), '--curve -0.1 is below 0'),
        (('--normal-force', '0.1', '--curve', 'nan'), "--curve 'nan' is not a finite number"),
    ],
)
def test_bad_arguments_are_refused(capsys: Any, words: tuple[str, ...], message: str):
    assert main(['contact', *words]) == 2
    out, err = capsys.readouterr()
    assert out == ''
    assert message in err
    assert err.startswith('stickslip: ')
