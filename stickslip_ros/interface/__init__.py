# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the outside sees: topics, services, messages, and requests as bytes; no ROS."""
