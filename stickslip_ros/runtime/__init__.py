# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bench in real time: its thread, orders, pacing and lockstep; no ROS."""
