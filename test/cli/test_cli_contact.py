"""`stickslip contact`: one hemisphere, against independently computed numbers."""

import json
from typing import Any

import pytest

from stickslip_ros.cli.main import main

#: The reference has six digits, or five behind the point.
RELATIVE = 1e-5
FRACTIONS = '0.1,0.25,0.5,0.75,0.9'
FRICTION = 0.3

#: Profile, normal force N: indentation nm, contact radius um, maximal presliding nm.
TABLE = {
    ('rough', 0.035355): (81.5873, 3.11549, 29.7211),
    ('rough', 0.353553): (263.2160, 8.34539, 95.8858),
    ('smooth', 0.035355): (40.1840, 4.48241, 14.6385),
    ('smooth', 0.353553): (186.5176, 9.65706, 67.9457),
}
#: Stick stiffness 2 G* a, N/um, to four digits.
STIFFNESS = {0.035355: 0.7554, 0.353553: 2.0235}
#: Tangential force over mu F_n at the FRACTIONS of the maximal presliding.
RATIOS = {
    ('rough', 0.035355): (0.20108, 0.46195, 0.78288, 0.95697, 0.99524),
    ('rough', 0.353553): (0.17623, 0.41426, 0.73314, 0.93695, 0.99214),
    ('smooth', 0.035355): (0.14619, 0.35048, 0.64645, 0.87500, 0.96838),
    ('smooth', 0.353553): (0.14619, 0.35048, 0.64645, 0.87500, 0.96838),
}
RATIO_DIGITS = 0.5e-5
DEPTH_DIGITS_M = 0.5e-13
RADIUS_DIGITS_M = 0.5e-11
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


@pytest.mark.parametrize(('profile', 'force_n'), TABLE)
def test_figures_are_those_of_the_reference(capsys: Any, profile: str, force_n: float):
    depth_nm, radius_um, presliding_nm = TABLE[profile, force_n]
    seen = contact(capsys, '--normal-force', str(force_n), '--profile', profile)
    assert seen.keys() == KEYS
    assert seen['indentation_m'] == pytest.approx(depth_nm * 1e-9, rel=RELATIVE)
    assert seen['contact_radius_m'] == pytest.approx(radius_um * 1e-6, rel=RELATIVE)
    assert seen['max_presliding_m'] == pytest.approx(presliding_nm * 1e-9, rel=RELATIVE)


@pytest.mark.parametrize('force_n', STIFFNESS)
def test_stick_stiffness_is_that_of_the_reference(capsys: Any, force_n: float):
    seen = contact(capsys, '--normal-force', str(force_n))
    stiffness = seen['stick_stiffness_n_per_m']
    assert stiffness == pytest.approx(STIFFNESS[force_n] * 1e6, rel=1e-4)  # four digits
    assert stiffness == pytest.approx(
        2.0 * seen['effective_shear_modulus_pa'] * seen['contact_radius_m'], rel=1e-12
    )


def test_moduli_follow_from_the_materials(capsys: Any):
    seen = contact(capsys, '--normal-force', '0.1')
    e1, e2, nu = 210e9, 370e9, 0.3
    assert seen['effective_modulus_pa'] == pytest.approx(
        1.0 / ((1.0 - nu**2) / e1 + (1.0 - nu**2) / e2), rel=1e-12
    )
    g1, g2 = e1 / (2.0 * (1.0 + nu)), e2 / (2.0 * (1.0 + nu))
    assert seen['effective_shear_modulus_pa'] == pytest.approx(
        1.0 / ((2.0 - nu) / (4.0 * g1) + (2.0 - nu) / (4.0 * g2)), rel=1e-12
    )


@pytest.mark.parametrize(('profile', 'force_n'), RATIOS)
def test_the_curve_is_that_of_the_reference(capsys: Any, profile: str, force_n: float):
    words = ('--normal-force', str(force_n), '--profile', profile, '--curve', FRACTIONS)
    seen = contact(capsys, *words)
    assert seen.keys() == KEYS | {'tangential_force_n'}
    limit_n = FRICTION * force_n
    ratios = [each / limit_n for each in seen['tangential_force_n']]
    assert ratios == pytest.approx(RATIOS[profile, force_n], rel=0.0, abs=RATIO_DIGITS)


def test_the_curve_ends_at_full_slip(capsys: Any):
    seen = contact(capsys, '--normal-force', '0.2', '--curve', '0,1,2')
    zero_n, full_n, beyond_n = seen['tangential_force_n']
    assert zero_n == pytest.approx(0.0, abs=1e-12 * full_n)
    assert full_n == pytest.approx(FRICTION * 0.2, rel=1e-9)
    assert beyond_n == full_n


def test_a_smooth_sphere_is_the_same_by_option_and_by_parameter(capsys: Any):
    by_option = contact(capsys, '--normal-force', '0.2', '--profile', 'smooth')
    by_parameter = contact(capsys, '--normal-force', '0.2', '--set', 'contact.profile=smooth')
    assert by_option == by_parameter
    assert by_option != contact(capsys, '--normal-force', '0.2')


def test_a_smooth_sphere_obeys_hertz_for_another_radius(capsys: Any):
    words = ('--profile', 'smooth', '--set', 'contact.radius=2e-3')
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
        (('--normal-force', 'nan'), 'normal force'),
        (('--normal-force', '0.1', '--curve', '0.1,x'), "--curve '0.1,x' is not a list"),
        (('--normal-force', '0.1', '--curve', ''), "--curve '' is not a list of numbers"),
        (('--normal-force', '0.1', '--curve', '-0.1'), '--curve -0.1 is not a fraction'),
        (('--normal-force', '0.1', '--curve', 'nan'), '--curve nan is not a fraction'),
    ],
)
def test_bad_arguments_are_refused(capsys: Any, words: tuple[str, ...], message: str):
    assert main(['contact', *words]) == 2
    out, err = capsys.readouterr()
    assert out == ''
    assert message in err
    assert err.startswith('stickslip: ')
