# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How a process starts, is asked to stop, and ends with which status."""
