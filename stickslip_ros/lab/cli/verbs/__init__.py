# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The verbs of ``stickslip`` in the groups of its help."""

from stickslip_ros.lab.cli.verbs.data import DATA
from stickslip_ros.lab.cli.verbs.ros import ROS
from stickslip_ros.lab.cli.verbs.simulate import EVIDENCE, SIMULATE

GROUPS = {'simulate': SIMULATE, 'data': DATA, 'ROS': ROS, 'evidence': EVIDENCE}
VERBS = {verb.name: verb for group in GROUPS.values() for verb in group}
