# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The digital twin of a rig: a fitted stand with the same input, and the health of the rig."""
