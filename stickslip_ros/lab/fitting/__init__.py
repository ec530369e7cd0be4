# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters of the drive from measured forces: weighted least squares with error bars."""
