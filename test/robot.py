# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Drive, record and test as a robot does; print what became of it, and what was imported for it.

A program, for environments without the laboratory (test_without_lab.py and `make wheel`).

"""

import sys

from stickslip_ros.extras import LAB
from stickslip_ros.parameters import Scalar
from stickslip_ros.testing import Stand
from stickslip_ros.testing.stand import reserve_domain


def main() -> None:
    """Start a drive, send it a command, record another one into the working folder."""
    with reserve_domain() as domain:
        settings: dict[str, Scalar] = {
            'record.directory': '.',
            'record.name': 'drive',
            'sim.block': 0.01,
        }
        stand = Stand(domain, settings)
        operator = stand.operator
        operator.wait_for_topics()
        operator.command('sawtooth', (300.0, 500.0, 20.0))
        operator.spin_until(lambda: bool(operator.events), 'the end of the command')
        print(operator.events[-1]['result'])
        answer = operator.set_recording(True)
        print(answer.success, answer.message)
        if answer.success:
            operator.command('voltage', (10.0,))
            operator.spin_until(lambda: len(operator.events) > 1, 'the end of the command')
            operator.set_recording(False)
        stand.close()
    print(sorted({each.partition('.')[0] for each in sys.modules} & {*LAB, 'mcap'}))


if __name__ == '__main__':
    main()
