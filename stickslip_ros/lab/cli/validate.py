# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip validate``: what this installation computes, against stored references."""

import argparse

from stickslip_ros.files import make_folder
from stickslip_ros.lab.cli.printing import CHECK_FAILED, Answer
from stickslip_ros.lab.validation.report import as_objects, sections, write_report
from stickslip_ros.lab.validation.self_test import failed, validate
from stickslip_ros.progress import shown_progress


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
    summary = next(sections(outcomes))
    return Answer(content, [summary, *map(str, files)], 0 if is_well else CHECK_FAILED)
