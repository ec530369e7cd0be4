# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Runs in MCAP files: written, read, recovered, as files and as bags of rosbag2."""
