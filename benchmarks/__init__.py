# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the drive is compared with, and how fast it is: ``python -m benchmarks``."""
