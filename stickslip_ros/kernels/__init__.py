# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How functions become machine code, what they pass to each other, and where it is kept."""
