# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The numbers of a message have the units that their commands are declared with."""

import pytest

from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.interface.messages import find_quantity
from stickslip_ros.message_types import FLOAT64, INT32, JOINT_STATE


@pytest.mark.parametrize(
    ('topic', 'unit'),
    [('command/voltage', 'V'), ('command/jog', 'Hz'), ('/left/command/preload', 'N'), ('x', '')],
)
def test_a_plain_number_has_the_unit_of_its_command(topic: str, unit: str):
    assert find_quantity(topic, FLOAT64, '').unit == unit
    assert find_quantity('command/steps', INT32, '').unit == ''


def test_a_joint_has_the_units_of_its_command():
    for label in COMMANDS['joint'].numbers:
        field, _, unit = label.partition(' ')
        assert find_quantity('command/joint', JOINT_STATE, field).unit == unit
