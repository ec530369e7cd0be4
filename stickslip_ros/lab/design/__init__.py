# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The periodic wave that does best: shapes, what a wave is worth, and the search for it."""
