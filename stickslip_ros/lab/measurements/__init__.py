# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Measurements out of any source, recordings and tables; with their figures."""
