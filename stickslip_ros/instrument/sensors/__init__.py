# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What each sensor of the table in ``parameters/sensors.py`` computes: a module of its name."""
