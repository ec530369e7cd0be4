# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fit parameters of the drive to measurements by weighted least squares, with error bars."""
