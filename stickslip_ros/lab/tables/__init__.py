# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measured tables as laboratories have them: columns, layouts, units."""
