"""``stickslip validate``: what this installation computes, against stored references."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from stickslip_ros.files import make_folder
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.validation.report import as_objects, summary_text, value_text, write_report
from stickslip_ros.lab.validation.self_test import CheckedAnswer, failed, validate
from stickslip_ros.progress import shown_progress
from stickslip_ros.sections import Section


def validate_verb(arguments: argparse.Namespace) -> Answer:
    """Compare this installation with the references, and write the report."""
    make_folder(arguments.output)
    with shown_progress('families', quiet=arguments.json) as progress:
        outcomes = validate(progress=progress)
        files = write_report(outcomes, arguments.output)
    is_well = not failed(outcomes)
    content = {
        'passed': is_well,
        'checks': as_objects(outcomes),
        'files': [str(path) for path in files],
    }
    return Answer(content, _parts(outcomes, files), 0 if is_well else CHECK_FAILED)


def _parts(
    outcomes: Mapping[str, Sequence[CheckedAnswer]], files: Sequence[Path]
) -> Iterator[Section | str]:
    header = ('family', 'references', 'failed', 'largest error, of its tolerance')
    rows = []
    for family, found in outcomes.items():
        wrong = sum(not each.passed for each in found)
        largest = max(each.error / each.reference.tolerance for each in found)
        rows.append((family, len(found), wrong or '', f'{largest:.2g}'))
    yield Section('contact mechanics and drive against references', rows, header)
    yield from map(failure_text, failed(outcomes))
    yield summary_text(outcomes)
    yield from map(str, files)


def failure_text(found: CheckedAnswer) -> str:
    """Return what is wrong with an answer, and what error was to be expected."""
    row = found.reference
    return (
        f'FAIL {row.quantity} of {row.case or "the default"}: {value_text(found.ours, row.unit)}, '
        f'not {value_text(row.reference, row.unit)} ({row.source}, {row.made_by}); '
        f'error {found.error:.2g} above {row.tolerance:.2g}: {row.why}'
    )
