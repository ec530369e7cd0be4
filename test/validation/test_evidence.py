"""Every check passes, the document shows it, and a wrong physics makes one fail."""

import csv
from math import nan
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.cli.validate import failure_text
from stickslip_ros.contact.hemisphere import elasticity_of
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import deflect
from stickslip_ros.contact.mdr import Elasticity
from stickslip_ros.contact.memory import lost_energy
from stickslip_ros.contact.roughness import Spectrum
from stickslip_ros.contact.springs import move_springs
from stickslip_ros.drive.build import plant_of
from stickslip_ros.validation.checks import EXCESS, Check, Tolerance, forget, printed
from stickslip_ros.validation.drive import DRIVE
from stickslip_ros.validation.evidence import EVIDENCE
from stickslip_ros.validation.foreign import (
    ANSWERED,
    FOREIGN,
    SPHERE_LOADS_N,
    STANDS_FOR,
    STORED,
    answers,
    equivalent,
)
from stickslip_ros.validation.friction_laws import FRICTION_LAWS
from stickslip_ros.validation.half_space import HALF_SPACE
from stickslip_ros.validation.load_curves import TANGENTIAL_LOAD
from stickslip_ros.validation.memory import ENERGY
from stickslip_ros.validation.published import REFERENCE_TABLE
from stickslip_ros.validation.roughness import ROUGHNESS, SPECTRA
from stickslip_ros.validation.spring_bank import SPRING_BANK
from stickslip_ros.validation.springs import (
    LINE_SPRINGS,
    ONE_BY_ONE,
    Springs,
    pull,
    rough_line_contact,
)

move_springs = entry_point(move_springs)
deflect = entry_point(deflect)

ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / 'docs' / 'validation.md'
PACKAGE = 'stickslip_ros.validation'
LOOSEST = 0.05
"""The loosest tolerance, but for an assumption, is that of counting 45 elements."""
PERCENT = Tolerance(0.01, 'a test')
CHECKS = [(family, check) for family in EVIDENCE for check in family.checks]


@pytest.fixture(scope='module', autouse=True)
def nothing_is_kept_for_other_tests():
    yield
    forget()


def names_of_failed(family, words=''):
    """Run the checks with words in their names on whatever physics there is now."""
    forget()
    failed = [c.name for c in family.checks if words in c.name and not c.run().passed]
    forget()
    return failed


@pytest.mark.parametrize(
    'check', [pytest.param(check, id=f'{family.name}: {check.name}') for family, check in CHECKS]
)
def test_evidence(check):
    found = check.run()
    assert found.passed, failure_text(found)


def test_every_check_says_against_what_and_why_its_tolerance():
    for _, check in CHECKS:
        assert check.name
        assert check.source
        assert check.tolerance.reason
        assert 0.0 < check.tolerance.value <= LOOSEST or check.tolerance is STANDS_FOR


def test_no_two_checks_of_a_family_have_one_name():
    assert len({(family.name, check.name) for family, check in CHECKS}) == len(CHECKS)


def test_the_document_has_the_row_of_every_check_and_no_other():
    shown, family = [], ''
    for line in DOCUMENT.read_text(encoding='utf-8').split('## The table')[1].splitlines():
        if line.startswith('### '):
            family = line.removeprefix('### ')
        elif line.startswith('| ') and not line.startswith(('| check |', '| --- |')):
            cells = line.replace('\\*', '*').strip('| ').split(' | ')
            shown.append((family, cells[0], cells[1], cells[5], cells[6]))
    claimed = [
        (family.name, c.name, c.source, f'{c.tolerance.value:.1e}', c.tolerance.reason)
        for family, c in CHECKS
    ]
    assert shown == claimed, 'copy the tables of runs/validation/validation.md there'


def check_of(compared, tolerance=PERCENT, error_of=''):
    return Check('x', 'a test', '', tolerance, error_of, lambda: compared).run()


def test_an_error_that_is_no_number_fails():
    assert not check_of((1.0, nan)).passed
    assert not check_of(([1.0, 1.0], [nan, 1.0])).passed


def test_a_printed_figure_allows_half_a_unit_of_its_last_digit():
    depth = printed('81.5873', 1e-9)
    assert check_of(81.58734e-9, depth).passed
    assert not check_of(81.58736e-9, depth).passed
    power = printed('4.4478e-4')
    assert check_of(4.44784e-4, power).passed
    assert power.value == pytest.approx(0.00005 / 4.4478, rel=1e-5)


def test_the_worst_of_many_is_shown():
    found = check_of(([1.0, 2.0, 4.0], [1.0, 2.1, 4.1]))
    assert (found.reference, found.ours) == (2.0, 2.1)
    scaled = check_of(([1.0, 2.0], [1.05, 2.0], 10.0), PERCENT, 'ten')
    assert scaled.error == pytest.approx(0.005)
    assert scaled.passed


def test_a_bound_is_kept_up_to_its_value_and_no_number_does_not_keep_it():
    assert check_of((2.0, 2.0), PERCENT, EXCESS).error == 0.0
    assert check_of((2.0, -9.0), PERCENT, EXCESS).error == 0.0
    above = check_of((2.0, 2.5), PERCENT, EXCESS)
    assert (above.error, above.passed) == (0.25, False)
    assert not check_of((2.0, nan), PERCENT, EXCESS).passed


def test_a_wrong_number_of_pohrt_and_popov_is_found(monkeypatch):
    monkeypatch.setattr('stickslip_ros.contact.roughness.POHRT_POPOV', 1.9413)
    assert names_of_failed(ROUGHNESS) == [
        'Q_1D for h = 1.1221 um, H = 0.7',
        'Q_1D as the paper prints it',
        'Q_1D with kappa cancelled',
    ]


def test_the_shear_modulus_of_johnson_is_found(monkeypatch):
    def quarter(contact):
        true = elasticity_of(contact)
        return Elasticity(true.normal_pa, true.shear_pa / 4.0)

    monkeypatch.setattr(f'{PACKAGE}.histories.elasticity_of', quarter)
    assert 'rough: initial stiffness, kernel' in names_of_failed(TANGENTIAL_LOAD)
    assert 'rough, F_n = 0.354 N: u_max' in names_of_failed(REFERENCE_TABLE)
    assert len(names_of_failed(FOREIGN, 'T/(mu F_n)')) == 2


def test_a_missing_hess_factor_is_found_by_the_rough_body_alone(monkeypatch):
    monkeypatch.setattr(f'{PACKAGE}.half_space.hess_factor', lambda n: 1.0)
    failed = names_of_failed(HALF_SPACE)
    assert len(failed) == 7
    assert all(name.startswith('rough, d =') for name in failed)


def test_a_loss_that_is_a_thousandth_too_large_is_found(monkeypatch):
    def too_large(*arguments):
        return 1.001 * entry_point(lost_energy)(*arguments)

    monkeypatch.setattr(f'{PACKAGE}.histories.lost_energy', too_large)
    assert 'sphere: loss per cycle at u_max' in names_of_failed(ENERGY, 'sphere')
    assert 'cone: friction loss, kernel' in names_of_failed(ONE_BY_ONE, 'cone')


def test_springs_that_do_not_feel_a_lighter_load_are_found(monkeypatch):
    def heavy(bank, forces_n, du_m, before_n, after_n):
        return move_springs(bank, forces_n, du_m, before_n, max(before_n, after_n))

    monkeypatch.setattr(f'{PACKAGE}.histories.move_springs', heavy)
    failed = names_of_failed(SPRING_BANK, 'preload ramps')
    assert 'rough, preload ramps: T/(mu F_n)' in failed
    assert 'smooth, preload ramps: friction loss' in failed


def test_the_factor_q_that_equation_9_has_too_many_is_found(monkeypatch):
    def per_wave(self, wave_number_per_m):
        wave = np.asarray(wave_number_per_m)
        return np.pi * wave**2 * self.density_2d(wave)

    monkeypatch.setattr(Spectrum, 'density_1d', per_wave)
    failed = names_of_failed(SPECTRA, 'no roll-off')
    assert 'no roll-off: 2 int C_1D dq (Eq. 9, corrected)' in failed
    assert 'no roll-off: 2 pi int q C_2D dq (Eq. 8)' not in failed


def test_a_friction_that_is_a_thousandth_too_large_is_found(monkeypatch):
    def too_large(*arguments):
        z_m, force_n, loss_j = deflect(*arguments)
        return z_m, 1.001 * force_n, loss_j

    monkeypatch.setattr(f'{PACKAGE}.friction_laws.deflect', too_large)
    failed = names_of_failed(FRICTION_LAWS, 'Dahl')
    assert {'Dahl: virgin curve', 'Dahl: ends of the loop'} <= set(failed)


def test_a_damping_that_is_ignored_is_found(monkeypatch):
    def undamped(parameters):
        return plant_of(parameters.updated({'runner.damping': 0.0}))

    monkeypatch.setattr(f'{PACKAGE}.drive.plant_of', undamped)
    assert len(names_of_failed(DRIVE, 'damped: ')) == 3


def test_all_answers_of_other_codes_are_used_and_are_those_of_the_pinned_versions(monkeypatch):
    rows = list(csv.DictReader(STORED.read_text(encoding='utf-8').splitlines()))
    used = set()

    def noted(*names):
        used.add(names)
        return answers(*names)

    monkeypatch.setattr(f'{PACKAGE}.foreign.answers', noted)
    FOREIGN.run()
    assert used == {(row['body'], row['quantity']) for row in rows}
    assert answers('random', 'mean_depth_m')[0].tolist() == list(SPHERE_LOADS_N)
    pinned = (ROOT / 'requirements' / 'evidence.txt').read_text(encoding='utf-8')
    pinned += (ROOT / 'Makefile').read_text(encoding='utf-8')
    for code in {(row['code'].lower(), row['version']) for row in rows}:
        assert '=='.join(code) in pinned


def test_the_page_says_how_far_random_spheres_are_from_their_body():
    page = DOCUMENT.read_text(encoding='utf-8')
    for place, load_n in enumerate(SPHERE_LOADS_N):
        told = [f'{load_n:g}']
        for name, ours in zip(ANSWERED, equivalent(load_n), strict=True):
            mean, scatter = (
                answers('random', f'{k}_{name}')[1][place] for k in ('mean', 'scatter')
            )
            told.append(f'{mean / ours:.2f} ± {scatter / ours:.2f}')
        assert f'| {" | ".join(told)} |' in page


def test_a_spring_sticks_slips_and_turns():
    springs = Springs(stiffness_n_per_m=2.0, limits_n=np.array([1.0]))
    history = pull(springs, np.array([0.25, 1.5, 0.5, 0.0]))
    assert history.force_n.tolist() == [0.5, 1.0, -1.0, -1.0]
    assert history.stored_j.tolist() == [0.0625, 0.25, 0.25, 0.25]
    assert history.lost_j.tolist() == [0.0, 1.0, 1.0, 1.5]


def test_the_line_has_as_many_springs_as_its_checks_say():
    assert len(rough_line_contact()[1].limits_n) == LINE_SPRINGS
