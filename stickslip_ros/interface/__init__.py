# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The interface as data, without ROS: topics, services, messages, encoded requests."""
