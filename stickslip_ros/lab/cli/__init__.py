# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``stickslip``: each verb calls one function of the package."""
