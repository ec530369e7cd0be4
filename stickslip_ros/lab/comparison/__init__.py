# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare two runs, sweeps or experiments in numbers with units."""
