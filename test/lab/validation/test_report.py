# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table and the picture of margins: what is written, and how a failure shows."""

import csv
from math import nan

import pytest

from stickslip_ros.errors import WrongKind
from stickslip_ros.lab.validation.references import Reference, read_references
from stickslip_ros.lab.validation.report import (
    as_objects,
    csv_text,
    report_sections,
    summary_text,
    value_text,
    write_report,
)
from stickslip_ros.lab.validation.self_test import CheckedAnswer, validate
from stickslip_ros.sections import as_json

ROW = Reference('One', 'depth_m', 'x=1', 1.0, 0.01, 1.0, 'a test', 'a test', 'nobody', '1')


@pytest.fixture(scope='module')
def outcomes():
    return validate([row for row in read_references() if row.family == 'Normal load'])


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


def test_table_and_picture_are_written_and_written_again_alike(outcomes, tmp_path):
    for name in 'ab':
        (tmp_path / name).mkdir()
    files = write_report(outcomes, tmp_path / 'a')
    assert [path.name for path in files] == ['validation.html', 'validation.csv']
    page = files[0].read_text(encoding='utf-8')
    assert '<h2>Normal load</h2>' in page
    assert page.count('data:image/svg+xml;base64') == 1
    assert files[1].read_text(encoding='utf-8') == csv_text(outcomes)
    again = write_report(outcomes, tmp_path / 'b')
    assert [p.read_bytes() for p in files] == [p.read_bytes() for p in again]


def test_the_csv_has_every_reference_with_all_digits(outcomes):
    rows = list(csv.DictReader(csv_text(outcomes).splitlines()))
    found = outcomes['Normal load']
    assert [row['case'] for row in rows] == [each.reference.case for each in found]
    assert [float(row['ours']) for row in rows] == [each.ours for each in found]
    assert {row['passed'] for row in rows} == {'True'}


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
