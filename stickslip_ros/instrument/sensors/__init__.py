# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Computation of the sensors in ``parameters/sensors.py``, each in the module of its name."""
