# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Benchmarks of the node against bare rclpy programs: what they send and what they cost."""
