# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernels: compilation of functions to machine code, their records, and their cache."""
