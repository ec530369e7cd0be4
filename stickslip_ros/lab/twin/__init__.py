# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A twin beside a rig: a fitted stand that is driven by what drives the rig, and its health."""
