# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Verbs that compare the model with the paper and with references."""

from stickslip_ros.lab.cli.options import PARAMETERS, WORKERS, folder, option, verb

EVIDENCE = (
    verb(
        'figures',
        "the paper's figures",
        "Make the paper's Figs 2, 6 and 7, and figures of the slew rate and of a rounded "
        'saw-tooth. Writes for each figure DIR/NAME.csv (all digits, SI), DIR/NAME.png, '
        'DIR/NAME.svg, and DIR/NAME.md with the caption. Names: fig2, fig6a, fig6b, fig7, slew, '
        'rounded.',
        folder('runs/figures'),
        option('--only', 'figures to make (default: all)', metavar='NAMES'),
        option('--points', 'points along an axis (default: those of each figure)', int, default=0),
        WORKERS,
        *PARAMETERS,
        module='evidence',
    ),
    verb(
        'validate',
        'self-test: contact and drive against references',
        'Compare results of this installation with its references: closed forms, single springs, '
        '3-D solutions, codes of others, printed values. Writes a page (validation.html) and '
        'validation.csv. Exit status 1 if a result is wrong.',
        folder('runs/validation'),
        module='evidence',
    ),
)
