# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every reference is met, the report says why, and a wrong physics makes answers fail."""

import csv
import runpy
from math import nan
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.contact.laws import deflect
from stickslip_ros.contact.roughness import Spectrum
from stickslip_ros.errors import WrongKind
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.lab.validation.references import (
    Reference,
    arguments_of,
    case_of,
    read_references,
)
from stickslip_ros.lab.validation.report import (
    as_objects,
    failure_text,
    report_sections,
    summary_text,
    write_report,
)
from stickslip_ros.lab.validation.self_test import MODULES, CheckedAnswer, answer, validate
from stickslip_ros.sections import as_json

deflect = entry_point(deflect)

ROOT = Path(__file__).parents[3]
DOCUMENT = ROOT / 'docs' / 'evidence' / 'validation.md'
PACKAGE = 'stickslip_ros.lab.validation'
LOOSEST = 0.05
"""The loosest tolerance, but for an assumption, is that of counting 45 elements."""
STANDS_FOR = '48 random rough spheres, mean'
ROWS = [row for row in read_references() if row.is_compared]


def forget():
    for module in MODULES:
        for value in vars(module).values():
            if hasattr(value, 'cache_clear'):
                value.cache_clear()


@pytest.fixture
def wrong(monkeypatch):
    """Put an error in; what was computed before and with it is forgotten."""

    def put(name, value):
        monkeypatch.setattr(name, value)
        forget()

    yield put
    forget()


def missed(family, **chosen):
    """Return the quantities of a family that fail with whatever physics there is now."""
    rows = [row for row in ROWS if row.family == family]
    rows = [row for row in rows if all(word in getattr(row, k) for k, word in chosen.items())]
    assert rows
    return {row.quantity for row in rows if not CheckedAnswer(row, answer(row)).passed}


@pytest.mark.parametrize('row', [pytest.param(r, id=f'{r.quantity}-{r.case}') for r in ROWS])
def test_the_package_answers_as_the_reference(row):
    found = CheckedAnswer(row, answer(row))
    assert found.passed, failure_text(found)


def test_every_reference_says_against_what_and_why_its_tolerance():
    for row in ROWS:
        assert row.family
        assert row.source
        assert row.made_by
        assert row.why
        assert row.relative_to > 0.0
        assert 0.0 < row.tolerance <= LOOSEST or row.source == STANDS_FOR


def test_a_case_is_words_and_numbers_again():
    case = {'profile': 'rough', 'force_n': 0.1, 'load_cell.gap': -2e-7, 'turns_m': '1e-08/-2e-08'}
    assert case_of(case) == (
        'profile=rough, force_n=0.1, load_cell.gap=-2e-07, turns_m=1e-08/-2e-08'
    )
    assert arguments_of(case_of(case)) == case
    assert arguments_of('') == {}


def test_it_tells_how_many_families_are_done():
    told = []
    rows = [row for row in ROWS if row.quantity in {'hess_factor', 'normal_modulus_pa'}]
    validate(rows, lambda done, total: told.append((done, total)))
    assert told[0] == (0, len(told))
    assert [done for done, _ in told] == list(range(len(told)))


def test_an_answer_that_is_no_number_fails():
    assert not CheckedAnswer(ROWS[0], nan).passed


def test_an_error_is_divided_by_what_the_reference_says():
    row = Reference('', 'depth_m', '', 2.0, 0.01, 10.0, '', '', '', '')
    assert CheckedAnswer(row, 2.05).error == pytest.approx(0.005)


def test_a_loss_that_is_a_thousandth_too_large_is_found(wrong):
    def too_large(curve, memory, places_m, log):
        follow_energies(curve, memory, places_m, log)
        log[:, 2] *= 1.001

    follow_energies = MODULES[0].follow_energies
    wrong(f'{PACKAGE}.contacts.follow_energies', too_large)
    assert missed('Energy') == {'cycle_loss_j', 'kernel_loss_j', 'wandering_missing'}
    assert missed('Springs one by one', case='cone') == {'wandering_loss_j'}


def test_the_factor_q_that_equation_9_has_too_many_is_found(wrong):
    def per_wave(self, wave_number_per_m):
        wave = np.asarray(wave_number_per_m)
        return np.pi * wave**2 * self.density_2d(wave)

    wrong('stickslip_ros.contact.roughness.Spectrum.density_1d', per_wave)
    assert Spectrum.density_1d is per_wave
    assert missed('Spectra', quantity='mean_square_m2', case='line') == {'mean_square_m2'}
    assert missed('Spectra', quantity='mean_square_m2', case='surface') == set()


def test_a_friction_that_is_a_thousandth_too_large_is_found(wrong):
    def too_large(*arguments):
        z_m, force_n, loss_j = deflect(*arguments)
        return z_m, 1.001 * force_n, loss_j

    wrong(f'{PACKAGE}.laws._deflect', too_large)
    assert {'virgin_friction_n', 'loop_end_n'} <= missed('Friction laws', source='Dahl')


def test_every_error_put_in_on_purpose_has_its_place_in_the_sources_and_is_counted_on_the_page():
    script = runpy.run_path(str(ROOT / 'scripts' / 'mutate.py'))
    page = DOCUMENT.read_text(encoding='utf-8')
    assert f'puts {len(script["MUTATIONS"])} errors' in page
    for mutation in script['MUTATIONS']:
        assert script['mutated'](mutation)


ROW = Reference('One', 'depth_m', 'x=1', 1.0, 0.01, 1.0, 'a test', 'a test', 'nobody', '1')


@pytest.fixture(scope='module')
def outcomes():
    return validate([row for row in read_references() if row.family == 'Normal load'])


def test_page_and_table_have_every_reference_and_are_written_again_alike(outcomes, tmp_path):
    for name in 'ab':
        (tmp_path / name).mkdir()
    files = write_report(outcomes, tmp_path / 'a')
    assert [path.name for path in files] == ['validation.html', 'validation.csv']
    assert '<h2>Normal load</h2>' in files[0].read_text(encoding='utf-8')
    rows = list(csv.DictReader(files[1].read_text(encoding='utf-8').splitlines()))
    found = outcomes['Normal load']
    assert [row['case'] for row in rows] == [each.reference.case for each in found]
    assert [float(row['ours']) for row in rows] == [each.ours for each in found]
    assert {row['passed'] for row in rows} == {'True'}
    again = write_report(outcomes, tmp_path / 'b')
    assert [p.read_bytes() for p in files] == [p.read_bytes() for p in again]


@pytest.mark.parametrize('ours', [1.1, nan])
def test_an_answer_that_is_wrong_or_no_number_is_marked_everywhere(ours, tmp_path):
    outcomes = {'One': [CheckedAnswer(ROW, ours)]}
    assert summary_text(outcomes) == '1 references, 1 failed'
    summary, family = report_sections(outcomes)
    assert summary.notes[0].startswith('FAIL depth_m of x=1')
    assert 'FAIL' in str(family.rows[0][-2])
    [row] = as_json(as_objects(outcomes))
    assert row['passed'] is False
    assert row['ours'] == (None if ours != ours else ours)  # noqa: PLR0124
    assert all(path.is_file() for path in write_report(outcomes, tmp_path))


def test_a_folder_that_cannot_be_written_is_refused(outcomes, tmp_path):
    taken = tmp_path / 'taken'
    taken.write_text('')
    with pytest.raises(WrongKind, match='choose another folder'):
        write_report(outcomes, taken)
