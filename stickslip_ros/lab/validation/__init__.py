# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the contact mechanics: closed forms, springs, a 3-D solution, tables."""
