# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``python -m stickslip_ros`` is the command ``stickslip``."""

import sys

from stickslip_ros.lab.cli.start import stickslip

if __name__ == '__main__':
    sys.exit(stickslip())
