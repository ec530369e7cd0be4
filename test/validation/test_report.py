"""The table and the page of plots: what is written, and how a failure shows."""

import csv
from math import nan

import pytest

from stickslip_ros.errors import WrongKind
from stickslip_ros.validation.checks import Family, Tolerance, measures
from stickslip_ros.validation.evidence import validate
from stickslip_ros.validation.load_curves import NORMAL_LOAD
from stickslip_ros.validation.report import (
    as_objects,
    csv_text,
    markdown_text,
    summary_text,
    value_text,
    write_report,
)
from stickslip_ros.validation.roughness import ROUGHNESS

PNG_START = b'\x89PNG\r\n'


def family_of(name, compared):
    row = (name, 'a test', 'm', Tolerance(0.01, 'a test'))
    return Family('One', (measures(row)(lambda: (compared,)),))


FAILING = family_of('a length', (1.0, 1.1))


@pytest.fixture(scope='module')
def findings():
    return validate([NORMAL_LOAD, ROUGHNESS])


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
    again = write_report(findings, tmp_path / 'c')
    assert [p.read_bytes() for p in files] == [p.read_bytes() for p in again]


def test_the_csv_has_every_check_with_all_digits(findings):
    rows = list(csv.DictReader(csv_text(findings).splitlines()))
    outcomes = [each for found in findings for each in found.outcomes]
    assert [row['check'] for row in rows] == [each.check.name for each in outcomes]
    assert [float(row['ours']) for row in rows] == [each.ours for each in outcomes]
    assert {row['passed'] for row in rows} == {'True'}


def test_a_check_that_fails_is_marked_everywhere(tmp_path):
    findings = validate([FAILING])
    assert summary_text(findings) == '1 checks, 1 failed'
    assert '| FAIL |' in markdown_text(findings)
    assert csv_text(findings).splitlines()[1].endswith('False')
    assert as_objects(findings)[0]['passed'] is False
    assert len(write_report(findings, tmp_path)) == 3


def test_a_check_that_is_no_number_is_null_in_json_and_can_be_drawn(tmp_path):
    findings = validate([family_of('x', (1.0, nan))])
    row = as_objects(findings)[0]
    assert (row['ours'], row['error'], row['passed']) == (None, None, False)
    write_report(findings, tmp_path)


def test_what_markdown_would_take_for_markup_is_written_otherwise():
    findings = validate([family_of('2 G* a |x|', (1.0, 1.0))])
    assert '| 2 G\\* a \\|x\\| |' in markdown_text(findings)


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    taken = tmp_path / 'taken'
    taken.write_text('')
    with pytest.raises(WrongKind, match='choose another folder'):
        write_report(validate([FAILING]), taken)
