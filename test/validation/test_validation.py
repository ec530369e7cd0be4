"""Every check of the contact mechanics passes, and a wrong physics makes one fail."""

import csv
from math import nan
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.hemisphere import elasticity_of
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import deflect
from stickslip_ros.contact.self_affine import Spectrum
from stickslip_ros.contact.springs import drag
from stickslip_ros.errors import WrongKind
from stickslip_ros.validation.checks import (
    Check,
    Scale,
    Tolerance,
    compare,
    compare_bound,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.energy import energy
from stickslip_ros.validation.families import FAMILIES, validate
from stickslip_ros.validation.findings import Findings, failed_checks
from stickslip_ros.validation.friction_laws import friction_laws
from stickslip_ros.validation.histories import lost_energy
from stickslip_ros.validation.jaeger import jaeger
from stickslip_ros.validation.preload_ramp import both_on_the_ramp, preload_ramp
from stickslip_ros.validation.report import (
    as_objects,
    csv_text,
    markdown_text,
    summary_text,
    value_text,
    write_report,
)
from stickslip_ros.validation.roughness import roughness
from stickslip_ros.validation.spectra import spectra
from stickslip_ros.validation.springs import Springs, pull
from stickslip_ros.validation.tables import tables
from stickslip_ros.validation.tangential import tangential
from stickslip_ros.validation.three_dimensions import three_dimensions

drag = entry_point(drag)
deflect = entry_point(deflect)

DOCUMENT = Path(__file__).parents[2] / 'docs' / 'validation.md'
PACKAGE = 'stickslip_ros.validation'
LOOSEST = 0.05
"""The loosest tolerance is that of counting 45 elements."""
PERCENT = Tolerance(0.01, 'a test')
PNG_START = b'\x89PNG\r\n'


@pytest.fixture(scope='module')
def findings() -> tuple[Findings, ...]:
    return validate()


def failing() -> Findings:
    return Findings('Wrong', (compare('a length', 'a test', 1.0, 1.1, 'm', PERCENT),))


def names_of_failed(found: Findings) -> list[str]:
    return [check.name for check in failed_checks([found])]


def test_every_check_passes(findings):
    assert [check.name for check in failed_checks(findings)] == []
    assert len(findings) == len(FAMILIES)


def test_every_check_says_against_what_and_why_its_tolerance(findings):
    for check in (check for found in findings for check in found.checks):
        assert check.name
        assert check.reference_text
        assert check.reason
        assert 0.0 < check.tolerance <= LOOSEST


def test_no_two_checks_of_a_family_have_one_name(findings):
    for found in findings:
        names = [check.name for check in found.checks]
        assert len(set(names)) == len(names), found.family


def test_the_document_names_every_family_and_every_check(findings):
    text = DOCUMENT.read_text(encoding='utf-8')
    rows = [line for line in markdown_text(findings).splitlines() if line.startswith('|')]
    names = {row.split(' | ')[0] for row in rows}
    missing = [name for name in names if name not in text]
    missing += [found.family for found in findings if f'### {found.family}\n' not in text]
    assert not missing, 'copy the tables of runs/validation/validation.md into docs/validation.md'


def test_an_error_that_is_no_number_fails():
    assert not compare('x', 'a test', 1.0, nan, '', PERCENT).passed
    assert not compare_worst('x', 'a test', [1.0, 1.0], [nan, 1.0], '', PERCENT).passed


def test_a_printed_figure_allows_half_a_unit_of_its_last_digit():
    inside = compare_printed('d', 'a table', '81.5873', 81.58734e-9, 'm', per_unit=1e-9)
    outside = compare_printed('d', 'a table', '81.5873', 81.58736e-9, 'm', per_unit=1e-9)
    assert inside.passed
    assert not outside.passed
    power = compare_printed('Q', 'a table', '4.4478e-4', 4.44784e-4, '')
    assert power.passed
    assert power.tolerance == pytest.approx(0.00005 / 4.4478, rel=1e-5)


def test_the_worst_of_many_is_shown():
    check = compare_worst('x', 'a test', [1.0, 2.0, 4.0], [1.0, 2.1, 4.1], '', PERCENT)
    assert (check.reference, check.ours) == (2.0, 2.1)
    scale = Scale(10.0, 'ten')
    scaled = compare_worst('x', 'a test', [1.0, 2.0], [1.05, 2.0], '', PERCENT, scale)
    assert scaled.error == pytest.approx(0.005)
    assert scaled.error_of == 'ten'
    assert scaled.passed


def test_a_bound_is_kept_up_to_its_value_and_no_number_does_not_keep_it():
    assert compare_bound('x', 'a test', 2.0, 2.0, '').passed
    above = compare_bound('x', 'a test', 2.0, 2.5, '')
    assert (above.error, above.passed) == (0.25, False)
    assert not compare_bound('x', 'a test', 2.0, nan, '').passed


def test_a_wrong_number_of_pohrt_and_popov_is_found(monkeypatch):
    monkeypatch.setattr('stickslip_ros.contact.roughness.POHRT_POPOV', 1.9413)
    assert names_of_failed(roughness()) == [
        'Q_1D for h = 1.1221 um, H = 0.7',
        'Q_1D as the paper prints it',
        'Q_1D with kappa cancelled',
    ]


def test_the_shear_modulus_of_johnson_is_found(monkeypatch):
    def quarter(contact):
        true = elasticity_of(contact)
        return Elasticity(true.normal_pa, true.shear_pa / 4.0)

    monkeypatch.setattr(f'{PACKAGE}.stand.elasticity_of', quarter)
    assert 'rough: initial stiffness, kernel' in names_of_failed(tangential())
    assert 'rough, F_n = 0.354 N: u_max' in names_of_failed(tables())


def test_a_missing_hess_factor_is_found_by_the_rough_body_alone(monkeypatch):
    monkeypatch.setattr(f'{PACKAGE}.three_dimensions.hess_factor', lambda n: 1.0)
    failed = names_of_failed(three_dimensions())
    assert len(failed) == 7
    assert all(name.startswith('rough, d =') for name in failed)


def test_a_loss_that_is_a_thousandth_too_large_is_found(monkeypatch):
    def too_large(*arguments):
        return 1.001 * lost_energy(*arguments)

    monkeypatch.setattr(f'{PACKAGE}.histories.lost_energy', too_large)
    assert 'sphere: loss per cycle at u_max' in names_of_failed(energy())
    assert 'cone: friction loss, kernel' in names_of_failed(jaeger())


def test_springs_that_do_not_feel_a_lighter_load_are_found(monkeypatch):
    def heavy(bank, forces_n, du_m, before_n, after_n):
        return drag(bank, forces_n, du_m, before_n, max(before_n, after_n))

    monkeypatch.setattr(f'{PACKAGE}.bank_history.drag', heavy)
    both_on_the_ramp.cache_clear()
    failed = [check.name for check in preload_ramp() if not check.passed]
    both_on_the_ramp.cache_clear()
    assert 'rough, preload ramps: T/(mu F_n)' in failed
    assert 'smooth, preload ramps: friction loss' in failed


def test_the_factor_q_that_equation_9_has_too_many_is_found(monkeypatch):
    def printed(self, wave_number_per_m):
        wave = np.asarray(wave_number_per_m)
        return np.pi * wave**2 * self.density_2d(wave)

    monkeypatch.setattr(Spectrum, 'density_1d', printed)
    failed = names_of_failed(spectra())
    assert 'no roll-off: 2 int C_1D dq (Eq. 9, corrected)' in failed
    assert 'no roll-off: 2 pi int q C_2D dq (Eq. 8)' not in failed


def test_a_friction_that_is_a_thousandth_too_large_is_found(monkeypatch):
    def too_large(*arguments):
        z_m, force_n, loss_j = deflect(*arguments)
        return z_m, 1.001 * force_n, loss_j

    monkeypatch.setattr(f'{PACKAGE}.law_drivers.deflect', too_large)
    failed = names_of_failed(friction_laws())
    assert {'Dahl: virgin curve', 'Dahl: ends of the loop'} <= set(failed)


def test_a_spring_sticks_slips_and_turns():
    springs = Springs(stiffness_n_per_m=2.0, thresholds_n=np.array([1.0]))
    history = pull(springs, np.array([0.25, 1.5, 0.5, 0.0]))
    assert history.force_n.tolist() == [0.5, 1.0, -1.0, -1.0]
    assert history.stored_j.tolist() == [0.0625, 0.25, 0.25, 0.25]
    assert history.lost_j.tolist() == [0.0, 1.0, 1.0, 1.5]


@pytest.mark.parametrize(
    ('value', 'unit', 'text'),
    [
        (81.5873e-9, 'm', '81.5873 nm'),
        (-3.5e-2, 'N', '-35 mN'),
        (1.472149e11, 'Pa', '147.215 GPa'),
        (4.44782e-4, 'm^0.3', '0.000444782 m^0.3'),
        (0.8, '', '0.8'),
        (0.0, 'N', '0 N'),
        (nan, 'm', 'nan m'),
    ],
)
def test_a_value_is_shown_with_the_prefix_that_suits_it(value, unit, text):
    assert value_text(value, unit) == text


def test_table_and_page_are_written_and_written_again_alike(findings, tmp_path):
    files = write_report(findings, tmp_path / 'a' / 'b')
    assert [path.name for path in files] == ['validation.md', 'validation.csv', 'validation.png']
    assert files[0].read_text(encoding='utf-8') == markdown_text(findings)
    assert files[1].read_text(encoding='utf-8') == csv_text(findings)
    assert files[2].read_bytes().startswith(PNG_START)
    first, again = (write_report(findings[:3], tmp_path / folder) for folder in 'cd')
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in again]


def test_the_csv_has_every_check_with_all_digits(findings):
    rows = list(csv.DictReader(csv_text(findings).splitlines()))
    checks = [check for found in findings for check in found.checks]
    assert [row['check'] for row in rows] == [check.name for check in checks]
    assert [float(row['ours']) for row in rows] == [check.ours for check in checks]
    assert {row['passed'] for row in rows} == {'True'}


def test_a_family_that_fails_is_marked_everywhere(tmp_path):
    findings = validate([failing])
    assert summary_text(findings) == '1 checks, 1 failed'
    assert '| FAIL |' in markdown_text(findings)
    assert csv_text(findings).splitlines()[1].endswith('False')
    assert as_objects(findings)[0]['passed'] is False
    assert len(write_report(findings, tmp_path)) == 3


def test_a_check_that_is_no_number_is_null_in_json_and_can_be_drawn(tmp_path):
    check = compare('x', 'a test', 1.0, nan, '', PERCENT)
    findings = (Findings('Wrong', (check,)),)
    row = as_objects(findings)[0]
    assert (row['ours'], row['error'], row['passed']) == (None, None, False)
    write_report(findings, tmp_path)


def test_what_markdown_would_take_for_markup_is_written_otherwise():
    check = Check('2 G* a |x|', 'a test', 1.0, 1.0, '', 0.0, 0.01, 'a test')
    assert '| 2 G\\* a \\|x\\| |' in markdown_text([Findings('One', (check,))])


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    taken = tmp_path / 'taken'
    taken.write_text('')
    with pytest.raises(WrongKind, match='choose another folder'):
        write_report(validate([failing]), taken)
