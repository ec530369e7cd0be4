# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs without ROS: simulate, sweep, 0-amplitude, replay; with their figures."""
