# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The laboratory: runs, sweeps, fits, comparisons, figures, the panel and the command line."""
