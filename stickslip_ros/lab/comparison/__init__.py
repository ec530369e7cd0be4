# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two runs, sweeps or experiments side by side: how far they differ, in numbers with units."""
