# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The contact mechanics against what is known: closed forms, springs, a 3-D solution, tables."""
